// What all cells of one type share: the mesh they start from, the elastic constants, and the state of rest.
#pragma once

#include "membrane/mesh.hpp"
#include "membrane/laws.hpp"
#include "membrane/triangle_forces.hpp"

namespace corpuscle {

struct CellReference {
  TriangleMesh mesh;  // symmetry axis z, as made or read
  CellLaw law;
  MembraneLaw in_plane;
  std::vector<std::array<double, 3>> rest_length;  // [triangle] um, of the side opposite each corner
  std::vector<std::array<double, 3>> rest_angle;   // [triangle] rad, of that side, positive where convex outward
  std::vector<double> rest_area;                   // [triangle] um2
  double smallest_vertex_area = 0;                 // um2, over the vertices of the mesh
};

/// Build the mesh (or read it) and the reference state that the settings name:
/// shape: rest lengths, areas and angles are those of the mesh;
/// spontaneous_angle: the same, but all rest angles from Equation 13;
/// uniform: one rest length and area for all, rest angles from Equation 13; total area and volume 135 um2 and 94 um3
/// for the built-in cell, those of the mesh for a mesh from a file.
/// @throws InputError  for constants out of range (local_area_modulus must be positive) or a mesh that is not closed
CellReference make_reference(const CellSettings& cell);

/// The cell's mesh where the settings place it.
TriangleMesh placed_mesh(const CellReference& reference, const CellSettings& cell);

/// Whether two cells can share one reference.
bool same_type(const CellSettings& a, const CellSettings& b);

}  // namespace corpuscle
