// What all cells of one type share: the mesh they start from, the elastic constants, and the state of rest.
#pragma once

#include <optional>

#include "membrane/laws.hpp"
#include "membrane/mesh.hpp"
#include "membrane/triangle_forces.hpp"

namespace corpuscle {

/// What a cell whose sheet rests on another shape has come to rest as; lengths in um.
struct RelaxedShape {
  int iterations = 0;
  double diameter = 0, thickness_center = 0, thickness_max = 0;
  double dimple[2] = {0, 0};  // how far the face on the axis lies within the rim, below and above
  bool biconcave() const { return dimple[0] > 0 && dimple[1] > 0 && thickness_center < 0.75 * thickness_max; }
};

struct CellReference {
  TriangleMesh mesh;  // symmetry axis z, as made or read
  CellLaw law;
  MembraneLaw in_plane;
  std::vector<std::array<double, 3>> rest_length;  // [triangle] um, of the side opposite each corner
  std::vector<std::array<double, 3>> rest_angle;   // [triangle] rad, of that side, positive where convex outward
  std::vector<double> rest_area;                   // [triangle] um2
  double viscosity_ratio = 1;                      // of the fluid inside over that outside
  double smallest_vertex_area = 0;                 // um2, over the vertices of the mesh
  std::optional<RelaxedShape> relaxed;             // of reference "spheroid": what the mesh is then
};

/// Build the mesh (or read it) and the reference state that the settings name:
/// shape: rest lengths, areas and angles are those of the mesh;
/// spontaneous_angle: the same, but all rest angles from Equation 13;
/// uniform: one rest length and area for all, rest angles from Equation 13; total area and volume 135 um2 and 94 um3
/// for the biconcave cell (of 7.82 um), those of the mesh for any other.
/// spheroid: rest lengths and areas are those of the mesh mapped to an oblate spheroid of the same area and the given reduced
/// volume, latitudes by equal shares of area; rest angles from Equation 13 (the bilayer is a fluid and remembers no place);
/// total area and volume those of the biconcave mesh. The mesh is then relaxed, its volume held exactly, and what it has
/// become is in `relaxed` and on the screen.
/// An inflated sphere's sheet rests on the smaller sphere, and its tension answers the pressure inside.
/// @throws InputError  for constants out of range (local_area_modulus of springs must be positive) or a mesh that is not closed;
///                     for a spheroid from which the cell does not come to rest
CellReference make_reference(const CellSettings& cell);

/// The mesh drawn out along x, y and z by these factors, with its volume kept.
TriangleMesh stretched(TriangleMesh mesh, const Triple& factors);

/// The cell's mesh where the settings place it.
TriangleMesh placed_mesh(const CellReference& reference, const CellSettings& cell);

/// Whether two cells can share one reference.
bool same_type(const CellSettings& a, const CellSettings& b);

/// A strain of the law in words, for messages: "a link at 0.850 of its contour length".
std::string stretch_text(const MembraneLaw& law, double strain);

}  // namespace corpuscle
