#include "fluid/fluid_state.hpp"

#include "fluid/fluid_solver.hpp"

namespace corpuscle {

namespace {

Components<double> clone(const Components<double>& view) {
  Components<double> own(uninitialised(view.label()), view.extent(0), view.extent(1));
  Kokkos::deep_copy(own, view);
  return own;
}

Array<double> clone(const Array<double>& view) {
  if (!view.data()) return view;
  Array<double> own(uninitialised(view.label()), view.extent(0));
  Kokkos::deep_copy(own, view);
  return own;
}

}  // namespace

FluidState FluidState::copy() const {
  FluidState s = *this;
  s.u = clone(u), s.u_old = clone(u_old), s.p = clone(p);
  for (int d = 0; d < 3; ++d) s.flux[d] = clone(flux[d]), s.flux_old[d] = clone(flux_old[d]);
  return s;
}

FluidState FluidSolver::state() const {
  FluidState s{u_, u_old_, p_, {}, {}, history_levels_, statistics_.reference_speed, 0, last_step_};
  for (int d = 0; d < 3; ++d) s.flux[d] = flux_[d], s.flux_old[d] = flux_old_[d];
  return s;
}

void FluidSolver::restore(const FluidState& state) {
  Kokkos::deep_copy(u_, state.u);
  Kokkos::deep_copy(u_old_, state.u_old);
  Kokkos::deep_copy(p_, state.p);
  for (int d = 0; d < 3; ++d) {
    Kokkos::deep_copy(flux_[d], state.flux[d]);
    if (flux_old_[d].data() && state.flux_old[d].data()) Kokkos::deep_copy(flux_old_[d], state.flux_old[d]);
  }
  history_levels_ = state.history_levels;
  last_step_ = state.step_us;
  statistics_.reference_speed = state.reference_speed;
  grid_->halo().exchange(u_);
  grid_->halo().exchange(u_old_);
  grid_->halo().exchange(p_);
  boundaries_.set_time(state.time_us - state.step_us);
  boundaries_.fill(u_old_);
  boundaries_.set_time(state.time_us);
  boundaries_.fill(u_);
}

}  // namespace corpuscle
