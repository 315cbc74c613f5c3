// Projections repeated within a step of FluidSolver, until the pressure has followed.
#include "fluid/fluid_solver.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

/// The residual that the last projection left is small where the flow is nearly at rest as well: there, it is measured
/// against a share of the largest speed.
double FluidSolver::splitting() {
  constexpr double at_rest = 0.1;
  momentum_residual();
  const double cells = static_cast<double>(grid_->index().global[0]) * grid_->index().global[1] * grid_->index().global[2];
  const double floor = 1e-30 + at_rest * statistics_.reference_speed * std::sqrt(cells);
  return residual_norm_ / std::max(velocity_norm_, floor);
}

/// One projection turns the pressure's error of wave number k in a gap of width b into one smaller by (b^2 / 12) / (nu dt)
/// of itself or so, whatever k: with long steps and tight gaps the pressure follows a change of the flow over many steps,
/// not over time. Repeated from the pressure before, momentum equation and projection are a fixed point, whose solution
/// has no splitting left; since few slow modes are excited, the flow through each gap, Anderson acceleration finds it in
/// three to ten passes where plain ones take dozens.
void FluidSolver::repeat_projection(const EmbeddedBodies* bodies) {
  constexpr double small = 1e-3;  // the force on a sphere of 0.7 of its tube's diameter is then within 0.3 %, at steps of 4 us
  constexpr int most = 20;
  for (int pass = 1; pass < most; ++pass) {
    if (splitting() <= small) return;
    if (!acceleration_) acceleration_ = std::make_unique<PressureAcceleration>(grid_->comm(), grid_->index());
    if (pass == 1) acceleration_->start(p_old_);
    acceleration_->advance(p_);
    solve_and_project(bodies, momentum_residual());
  }
}

}  // namespace corpuscle
