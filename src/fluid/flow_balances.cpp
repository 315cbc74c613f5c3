#include "fluid/flow_balances.hpp"

#include "fluid/energy.hpp"
#include "fluid/integrals.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

FluidEnergy flow_energy(FluidSolver& fluid, double body_volume) {
  const Grid& grid = fluid.grid();
  const GridViews& views = grid.views();
  const auto& g = fluid.coefficients();
  const auto& u = fluid.velocity();
  const bool convective = fluid.settings().convection != FluidSettings::Convection::none;
  const double rho = fluid.settings().density_pg_per_um3, carried = convective ? rho : 0.0, mu = fluid.viscosity();
  const auto own = fluid.skewed() ? fluid_energy<true>(views, g, fluid.kind(), u) : fluid_energy<false>(views, g, fluid.kind(), u);
  constexpr int columns = EnergyColumn::count;
  double sums[columns + 2];
  std::copy_n(own.value, columns, sums);
  fluid.visit_varying_viscosity([&](const VaryingViscosity& viscosity) {
    sums[EnergyColumn::gradient_square] += excess_dissipation(views, viscosity, fluid.kind(), u);
  });
  GridSides sides;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end)
      if (fluid.grid().halo().neighbour(d, end) < 0) sides.add(views.index, d, end);
  const auto power = fluid.skewed() ? boundary_power<true> : boundary_power<false>;
  const Sums<2> through = sides.boxes.count == 0
                              ? Sums<2>{}
                              : power(views, g, fluid.kind(), fluid.pressure_mask(), carried, mu, u, fluid.pressure(), fluid.flux(), sides);
  std::copy_n(through.value, 2, sums + columns);
  grid.comm().sum(sums, columns + 2);
  // Immersed nodes fill the rest of the fluid's volume, each by the same share on average.
  using Column = EnergyColumn;
  const double rest = grid.total_volume() - body_volume - sums[Column::volume];
  const double share = sums[Column::immersed + Column::volume] > 0 ? rest / sums[Column::immersed + Column::volume] : 0;
  const auto whole = [&](int column) { return sums[column] + share * sums[Column::immersed + column]; };
  FluidEnergy energy;
  energy.boundaries_nW = sums[columns];
  energy.inflow_um3_per_us = sums[columns + 1];
  energy.dissipation_nW = mu * whole(Column::gradient_square);
  energy.kinetic_fJ = 0.5 * rho * whole(Column::speed_square);
  if (norm(fluid.imposed_gradient()) > 0) {
    const Triple mean = mean_velocity(fluid);
    energy.gradient_nW = -grid.total_volume() * dot(fluid.imposed_gradient(), Vec3{mean[0], mean[1], mean[2]});
  }
  return energy;
}

double convection_over_viscosity(FluidSolver& fluid) {
  const Grid& grid = fluid.grid();
  const auto& u = fluid.velocity();
  const Components<double> term("corpuscle::fluid::term", grid.index().size(), 3);
  subtract_convection(grid.views(), fluid.kind(), fluid.settings().density_pg_per_um3, fluid.flux(), u, term);
  const double convective = grid.comm().sum(owned_square(grid.index(), fluid.kind(), term));
  Kokkos::deep_copy(term, 0.0);
  if (fluid.skewed())
    subtract_viscous<true>(grid.views(), fluid.coefficients(), fluid.kind(), fluid.viscosity(), u, term);
  else
    subtract_viscous<false>(grid.views(), fluid.coefficients(), fluid.kind(), fluid.viscosity(), u, term);
  const double viscous = grid.comm().sum(owned_square(grid.index(), fluid.kind(), term));
  return viscous > 0 ? std::sqrt(convective / viscous) : 0;
}

Triple mean_velocity(FluidSolver& fluid) {
  const Grid& grid = fluid.grid();
  double sums[3];
  volume_integral(grid.views(), fluid.kind(), fluid.velocity(), sums);
  grid.comm().sum(sums, 3);
  const double volume = grid.total_volume();
  return {sums[0] / volume, sums[1] / volume, sums[2] / volume};
}

std::vector<Triple> body_forces(FluidSolver& fluid, const EmbeddedBodies& bodies) {
  const Grid& grid = fluid.grid();
  Table<double> force("corpuscle::immersed::body_force", bodies.bodies, 3);
  const auto balance = fluid.skewed() ? momentum_balance<true> : momentum_balance<false>;
  balance(grid.views(), fluid.coefficients(), fluid.pressure_mask(), fluid.viscosity(), fluid.imposed_gradient(), fluid.velocity(),
          fluid.pressure(), bodies, force);
  auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), force);
  grid.comm().sum(host.data(), 3 * bodies.bodies);
  std::vector<Triple> result(bodies.bodies);
  for (int b = 0; b < bodies.bodies; ++b) result[b] = {host(b, 0), host(b, 1), host(b, 2)};
  return result;
}

}  // namespace corpuscle
