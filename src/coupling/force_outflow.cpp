// Membranes that are forces, and where the fluid leaves the grid.
#include <fmt/format.h>

#include <algorithm>

#include "core/log.hpp"
#include "coupling/force_coupling.hpp"

namespace corpuscle {

void ForceCoupling::watch_outflow() {
  outflow_ = {};
  const auto open = [](const BoundarySettings& b) { return b.type == BoundarySettings::Type::outflow; };
  if (std::none_of(scene_.boundaries.begin(), scene_.boundaries.end(), open)) return;
  for (const auto& boundary : scene_.boundaries) {
    const int side = static_cast<int>(boundary.side), d = side / 2, end = side % 2;
    const auto& lattice = transfer_->block().lattice;
    if (boundary.type != BoundarySettings::Type::outflow || !(end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d])) continue;
    const NearSide near = nearest_to_side(transfer_->block(), transfer_->views(), d, end);
    if (near.distance < outflow_.distance) outflow_ = near;
  }
  const double least = fluid_.grid().comm().min(outflow_.distance);
  if (outflow_.distance > least) outflow_ = {least, -1};
}

/// Before the first step, after place().
void ForceCoupling::limit_outflow() {
  outflow_limit_ = scene_.time.stop_before_outflow_um;
  if (outflow_.distance < outflow_limit_) {
    outflow_limit_ = 0.5 * outflow_.distance;
    warn(
        "{}, where the end of the grid disturbs the flow: the run ends when {:.2g} um are left instead of "
        "time.stop_before_outflow_um = {:g}; move the cell (center_um) or lengthen the grid",
        nearest_outflow(), outflow_limit_, scene_.time.stop_before_outflow_um);
  }
}

/// How far the fluid gets in two steps at the fastest that it has been: a cell that is nearer may leave the grid before it is
/// looked at again. A reference speed that is only the one told from rest says nothing of it.
double ForceCoupling::two_steps_um(double dt) const {
  const auto& fluid = fluid_.statistics();
  return 2 * dt * (fluid.reference_speed > quiet_speed_ ? fluid.reference_speed : fluid.speed);
}

bool ForceCoupling::at_outflow(double dt) const { return outflow_.distance < std::max(outflow_limit_, two_steps_um(dt)); }

std::string ForceCoupling::outflow_limit(double dt) const {
  const double two_steps = two_steps_um(dt);
  if (two_steps > outflow_limit_) return fmt::format("{:.3g} um, as far as the flow gets in two steps (time.step_us)", two_steps);
  return fmt::format("{:.3g} um (time.stop_before_outflow_um)", outflow_limit_);
}

std::string ForceCoupling::nearest_outflow() const {
  const std::string text =
      outflow_.vertex < 0 ? "" : fmt::format("{} is {:.3g} um from an outflow", vertex_text(outflow_.vertex), outflow_.distance);
  return agree(fluid_.grid().comm(), text);
}

}  // namespace corpuscle
