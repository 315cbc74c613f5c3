// The energy of the flow: what drives it, what it stores and what friction takes.
#include "fluid/energy.hpp"
#include "fluid/fluid_solver.hpp"

#include <algorithm>

namespace corpuscle {

FluidEnergy FluidSolver::energy(double body_volume) {
  const Comm& comm = grid_->comm();
  const bool convective = settings_.convection != FluidSettings::Convection::none;
  const double rho = settings_.density_pg_per_um3, carried = convective ? rho : 0.0;
  const auto own = skewed_ ? fluid_energy<true>(grid_->views(), g_, kind_, u_)
                           : fluid_energy<false>(grid_->views(), g_, kind_, u_);
  constexpr int columns = EnergyColumn::count;
  double sums[columns + 2];
  std::copy_n(own.value, columns, sums);
  sums[columns] = sums[columns + 1] = 0;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      if (grid_->halo().neighbour(d, end) >= 0) continue;
      const auto side =
          skewed_
              ? boundary_power<true>(grid_->views(), g_, kind_, mask_, carried, mu_, u_, p_, flux_[d], d, end)
              : boundary_power<false>(grid_->views(), g_, kind_, mask_, carried, mu_, u_, p_, flux_[d], d, end);
      sums[columns] += side[0];
      sums[columns + 1] += side[1];
    }
  comm.sum(sums, columns + 2);
  // Immersed nodes fill the rest of the fluid's volume, each by the same share on average.
  using Column = EnergyColumn;
  const double rest = grid_->total_volume() - body_volume - sums[Column::volume];
  const double share = sums[Column::immersed + Column::volume] > 0 ? rest / sums[Column::immersed + Column::volume] : 0;
  const auto whole = [&](int column) { return sums[column] + share * sums[Column::immersed + column]; };
  FluidEnergy energy;
  energy.boundaries_nW = sums[columns];
  energy.inflow_um3_per_us = sums[columns + 1];
  energy.dissipation_nW = mu_ * whole(Column::gradient_square);
  energy.kinetic_fJ = 0.5 * rho * whole(Column::speed_square);
  if (norm(imposed_gradient_) > 0) {
    const Triple mean = mean_velocity();
    energy.gradient_nW = -grid_->total_volume() * dot(imposed_gradient_, Vec3{mean[0], mean[1], mean[2]});
  }
  return energy;
}

}  // namespace corpuscle
