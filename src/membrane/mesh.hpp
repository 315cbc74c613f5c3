// Closed triangulated surfaces on the host: what generators make, files hold, and bodies start from.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "input/case.hpp"

namespace corpuscle {

/// Triangles are counter-clockwise seen from outside; coordinates in um.
struct TriangleMesh {
  std::vector<Triple> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Refuse anything but one closed, oriented, manifold surface with its normals outward.
/// @param name  what to call the surface in messages, e.g. the file it came from
/// @throws InputError  saying what is wrong, where (vertices counted from 0), and the remedy
void check_closed_surface(const TriangleMesh& mesh, const std::string& name);

/// um2
double area(const TriangleMesh& mesh);

/// um3, positive if the triangles are counter-clockwise seen from outside
double volume(const TriangleMesh& mesh);

/// Turn the mesh by `spin_deg` about z, then z onto `axis` by the shortest rotation, then move the origin to `center`.
/// @throws InputError  if the axis has no length
TriangleMesh transform(const TriangleMesh& mesh, const Triple& axis, double spin_deg, const Triple& center);

/// One side of one triangle, opposite `corner`.
struct TriangleSide {
  int low, high, triangle, corner;
  bool rising;  // runs from vertex low to vertex high in its triangle's order
  bool same_edge(const TriangleSide& b) const { return low == b.low && high == b.high; }
};

/// All sides of all triangles, those that share an edge beside each other.
std::vector<TriangleSide> sorted_sides(const TriangleMesh& mesh);

/// For each triangle, the one across the edge opposite corner 0, 1, 2. The mesh must be a closed manifold.
std::vector<std::array<int, 3>> triangle_neighbours(const TriangleMesh& mesh);

/// Triangles around each vertex, counter-clockwise seen from outside, starting with the lowest number.
std::vector<std::vector<int>> vertex_rings(const TriangleMesh& mesh, const std::vector<std::array<int, 3>>& neighbours);

}  // namespace corpuscle
