// How the volume inside a closed surface is spread: its centroid, its principal axes, the axis of a disc.
#pragma once

#include <optional>

#include "membrane/mesh.hpp"

namespace corpuscle {

struct PrincipalAxes {
  Triple centroid{};           // of the enclosed volume, um
  Triple moment{};             // mean square distance from the plane through the centroid across each axis, um2, rising
  std::array<Triple, 3> axis;  // unit vectors
};

/// The mesh must be closed, its volume positive.
PrincipalAxes principal_axes(const TriangleMesh& mesh);

/// The axis of a surface that is distinctly flat in one direction and wider in the two others, which are more like each
/// other: a resting red cell, a disc, an oblate ellipsoid. The sense is that with the positive z component, or y, or x.
std::optional<Triple> disc_axis(const PrincipalAxes& axes);

/// Turn the mesh about `centre` so that the direction `axis` becomes z, by the shortest rotation, and move the centre to
/// the origin.
TriangleMesh turn_to_z(const TriangleMesh& mesh, const Triple& axis, const Triple& centre);

/// Extents along x, y, z, um.
Triple extents(const TriangleMesh& mesh);

}  // namespace corpuscle
