#include "fluid/pressure_multigrid.hpp"

#include "fluid/flux.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

PressureMultigrid::PressureMultigrid(MultigridHierarchy& hierarchy, PressureCycle& cycle, const Array<double> (&coefficient)[3],
                                     int max_iterations)
    : comm_(hierarchy.comm()), halo_(&hierarchy.levels()[0].halo), cycle_(&cycle), max_iterations_(max_iterations) {
  const IndexSpace& index = hierarchy.levels()[0].views.index;
  operator_.index = index;
  for (int d = 0; d < 3; ++d) {
    coefficient_[d] = coefficient[d];
    operator_.conductance[d] = Array<double>("corpuscle::multigrid::conductance", index.size());
  }
  for (auto* vector : {&operator_.diagonal, &operator_.inverse, &p_, &s_, &w_, &r_})
    *vector = Array<double>("corpuscle::multigrid::vector", index.size());
  products_ = Kokkos::View<Sums<CgProducts::count>, Memory>("corpuscle::multigrid::products");
  products_host_ = HostCopy(products_);
  state_ = Kokkos::View<CgState, Memory>("corpuscle::multigrid::state");
  state_host_ = HostCopy(state_);
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
  const double tolerance = std::max(absolute_tolerance, least_reduction * norm);
  // The cycle sees residuals of order one: single precision has no room for very small ones.
  CgState state;
  state.scale = state.next_scale = 1 / norm;
  state.norm = norm, state.tolerance = tolerance, state.most = max_iterations_;
  state.done = !(norm > tolerance);
  spread_scalar(index, state.next_scale, rhs, finest.b);
  for (const auto& vector : {p_, s_}) Kokkos::deep_copy(Exec(), vector, 0.0);
  if (!look_always) state_host_.set(state);
  for (int n = 1; !state.done; ++n) {
    cycle_->run();
    halo_->exchange_with_others(finest.x, 1);
    cg_products(operator_, finest.x, r_, s_, w_, products_);
    if (look_always || comm_.size() > 1) {
      auto products = products_host_.read()();
      comm_.sum(products.value, CgProducts::count);
      state = cg_step(state, products);
      cg_advance(index, CgByValue{state}, finest.x, w_, p_, s_, x, r_, finest.b);
    } else {
      cg_step_on_device(products_, state_);
      cg_advance(index, CgOnDevice{state_}, finest.x, w_, p_, s_, x, r_, finest.b);
      if (n + 1 >= last_iterations_) state = state_host_.read()();
    }
  }
  result.iterations = last_iterations_ = state.iterations;
  norm = state.norm;
  result.converged = norm <= tolerance;
  return result;
}

}  // namespace corpuscle
