#include "fluid/pressure_multigrid.hpp"

#include "fluid/flux.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

PressureMultigrid::PressureMultigrid(MultigridHierarchy& hierarchy, PressureCycle& cycle,
                                     const Array<double> (&coefficient)[3], int max_iterations)
    : comm_(hierarchy.comm()), halo_(&hierarchy.levels()[0].halo), cycle_(&cycle), max_iterations_(max_iterations) {
  const IndexSpace& index = hierarchy.levels()[0].views.index;
  operator_.index = index;
  for (int d = 0; d < 3; ++d) {
    coefficient_[d] = coefficient[d];
    operator_.conductance[d] = Array<double>("corpuscle::multigrid::conductance", index.size());
  }
  for (auto* vector : {&operator_.diagonal, &operator_.inverse, &p_, &q_, &r_})
    *vector = Array<double>("corpuscle::multigrid::vector", index.size());
}

void PressureMultigrid::update(const PressureMask& mask) {
  mask_conductances(coefficient_, mask, operator_);
  level_diagonals(operator_, cycle_->finest().views.closed, cycle_->finest().own);
}

KrylovResult PressureMultigrid::solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance) {
  constexpr double least_reduction = 1e-10;  // in one solve; round-off allows about 1e-12
  auto& finest = cycle_->finest();
  const IndexSpace& index = finest.views.index;
  scalar_from_compact(index, rhs, r_);
  Kokkos::deep_copy(Exec(), x, 0.0);
  KrylovResult result;
  double norm = std::sqrt(comm_.sum(owned_dot(index, r_, r_)));
  result.residual = norm;
  if (!(norm > 0) || !std::isfinite(norm)) {
    result.converged = norm == 0;
    return result;
  }
  // The cycle sees residuals of order one: single precision has no room for very small ones.
  double scale = 1 / norm;
  spread_scalar(index, scale, rhs, finest.b);
  const double tolerance = std::max(absolute_tolerance, least_reduction * norm);
  double rz = 1;
  while (norm > tolerance && result.iterations < max_iterations_ && std::isfinite(norm)) {
    cycle_->run();
    const double next = comm_.sum(owned_dot(index, r_, finest.x)) / scale;
    new_direction(index, result.iterations == 0 ? 0.0 : next / rz, 1 / scale, finest.x, p_);
    rz = next;
    halo_->exchange(p_, 1);
    const double alpha = rz / comm_.sum(apply_and_dot(operator_, p_, q_));
    scale = 1 / norm;
    norm = std::sqrt(comm_.sum(advance_and_norm(index, alpha, scale, p_, q_, x, r_, finest.b)));
    ++result.iterations;
  }
  result.converged = norm <= tolerance;
  return result;
}

}  // namespace corpuscle
