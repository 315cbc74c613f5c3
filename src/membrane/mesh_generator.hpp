// Near-uniform triangle meshes with exactly the number of vertices asked for, the same for the same arguments.
#pragma once

#include "membrane/mesh.hpp"

namespace corpuscle {

/// The resting red blood cell of Equation 1 (with a0 = 0.0518, see the README), symmetry axis z, centred at the origin.
/// @param vertices  200 to 30000; triangles are 2 vertices - 4
/// @throws InputError  outside that range
/// @throws ComputationError  if the mesh fails its own checks of area, volume, valence and edge lengths
TriangleMesh biconcave_mesh(int vertices);

/// An ellipsoid with the given semi-axes in um (a sphere if they are equal), centred at the origin.
/// @param vertices  42 to 100000
/// @throws InputError  outside that range, or for semi-axes that are not positive or differ more than tenfold
/// @throws ComputationError  if the mesh fails its own checks
TriangleMesh ellipsoid_mesh(const Triple& semi_axes, int vertices);

}  // namespace corpuscle
