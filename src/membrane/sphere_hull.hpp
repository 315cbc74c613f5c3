// A first, near-uniform triangulation of the unit sphere.
#pragma once

#include "membrane/mesh.hpp"

namespace corpuscle {

/// Convex hull of a Fibonacci lattice of exactly `vertices` points.
/// @throws ComputationError  if the hull leaves a point out
TriangleMesh sphere_hull(int vertices);

}  // namespace corpuscle
