// The smooth motion that surfaces' velocities are nearest to.
#pragma once

#include "contact/smooth_motion.hpp"

namespace corpuscle {

struct SpaceBounds {
  Vec3 lower, upper;  // um
};

/// By least squares, over some thousand vertices of this rank at their present places; at rest where they do not tell, or move by what is
/// no number.
/// @param bounds  of the surfaces
SmoothMotion fit_motion(const SurfaceSet& surface, const SpaceBounds& bounds);

/// 1/us, at most so much velocity a distance within the bounds.
double steepest_gradient(const SmoothMotion& motion, const SpaceBounds& bounds);

}  // namespace corpuscle
