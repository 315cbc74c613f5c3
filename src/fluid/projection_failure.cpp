#include "fluid/projection_failure.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace corpuscle {

namespace {

/// The causes exclude one another in this order: a sum that is not zero leaves a divergence whatever the solver does, and a
/// flow that has run away leaves one whatever the tolerance.
std::string cause(const ProjectionFailure& f) {
  constexpr double runaway = 10;   // in one step; a start from rest is measured against what is prescribed
  constexpr double falling = 0.5;  // in the last solve
  const double round_off = 30 * std::numeric_limits<double>::epsilon() * f.face_flux;  // six faces, each a sum of a few terms
  if (!std::isfinite(f.divergence) || !std::isfinite(f.speed)) return "the fluxes are not a number: a diverging run; reduce time.step_us";
  if (std::abs(f.net_inflow) > f.target)
    return fmt::format(
        "the fluxes prescribed around the fluid do not conserve volume: {:.3g} um3/us more flow in than out, and there is no "
        "outflow. Make one side \"outflow\" ([[boundary]] type), or make prescribed velocities and the growth of bodies add up to "
        "zero",
        f.net_inflow);
  if (f.speed > runaway * f.earlier_speed)
    return fmt::format(
        "a diverging run: the largest speed has grown from {:.3g} to {:.3g} um/us within the step; reduce time.step_us, or with cells "
        "raise coupling.robin_coefficient_pg_per_um2_per_us",
        f.earlier_speed, f.speed);
  if (f.divergence <= round_off)
    return fmt::format(
        "the tolerance is finer than double precision, which leaves about {:.1g} um3/us of face fluxes up to {:.3g}; raise "
        "fluid.divergence_tolerance",
        round_off, f.face_flux);
  if (f.divergence <= falling * f.before)
    return fmt::format("too few iterations: the divergence was still falling, from {:.3g} in the last solve; raise fluid.max_iterations",
                       f.before);
  return fmt::format(
      "the linear solver has come to a halt, from {:.3g} in the last solve: a gap between surfaces, or between a surface and "
      "the wall, of less than two or three grid spacings{}; refine the grid (grid.nodes) or widen the gap",
      f.before, f.skewed ? " on this skewed grid" : "");
}

}  // namespace

std::string explain(const ProjectionFailure& f) {
  return fmt::format("pressure: the projection did not reach a divergence of {:.3g} um3/us (it is {:.3g}) in {} iterations. Cause: {}",
                     f.target, f.divergence, f.iterations, cause(f));
}

}  // namespace corpuscle
