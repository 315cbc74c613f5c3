// What can be put right in a surface from a file without changing the surface.
#pragma once

#include "membrane/mesh_io.hpp"

namespace corpuscle {

/// Whether some edge belongs to one triangle only.
bool is_open(const TriangleMesh& mesh);

/// Give vertices that coincide within 1e-6 of the size of the surface the number of the first of them. The others are
/// gone; the rest keeps its order.
void merge_coincident(TriangleMesh& mesh);

/// Leave out triangles that have the same vertex twice, and vertices that no triangle uses; both are noted.
void drop_collapsed(MeshFile& file);

/// [triangle] number of the piece it belongs to, pieces in the order of their first triangles. Triangles that share an
/// edge are of one piece.
std::vector<int> connected_pieces(const TriangleMesh& mesh);

/// Make neighbours run along their common edges in opposite directions, and the volume of every piece positive. Edges
/// that are not shared by exactly two triangles are left alone. @returns how many triangles were turned
int orient_outward(TriangleMesh& mesh);

}  // namespace corpuscle
