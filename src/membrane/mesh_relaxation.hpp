// Making the edges of a mesh on a smooth surface as equal as they can be.
#pragma once

#include "membrane/mesh.hpp"
#include "membrane/surface_shape.hpp"

namespace corpuscle {

/// Move the vertices along the surface under springs on the edges, flipping edges to the Delaunay triangulation on the
/// way. Deterministic; keeps the numbers of vertices and triangles.
void relax_mesh(TriangleMesh& mesh, const SurfaceShape& shape);

}  // namespace corpuscle
