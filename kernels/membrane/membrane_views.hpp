// The arrays of all membranes, as kernels see them.
#pragma once

#include <algorithm>
#include <vector>

#include "immersed/surface_views.hpp"
#include "membrane/sections.hpp"
#include "membrane/triangle_forces.hpp"

namespace corpuscle {

/// Reference data are held once per cell type, with vertices and triangles numbered within the type as within each of
/// its cells; a cell itself is only positions and velocities.
struct MembraneViews {
  int cells = 0, vertices = 0, triangles = 0;                // totals over all cells, or over those of a part
  int first_cell = 0, first_vertex = 0, first_triangle = 0;  // of a part of them: see for_parts()
  double most_area = 1e300;                                  // share by which the area of a membrane that holds it may change
  double most_volume = 1e300;                                // the same of the volume of any
  SurfaceSet surface;                                        // shared with the fluid; the cells are its first bodies

  Array<int> type;                 // [cell]
  Array<CellLaw> law;              // [type]
  Array<int> type_first_triangle;  // [type] into the three below
  Components<double> rest_length;  // [type triangle, 3] um, of the side opposite each corner
  Components<double> rest_cos;     // [type triangle, 3] of the rest angle of that side
  Components<double> rest_sin;     // [type triangle, 3]
  Array<double> rest_area;         // [type triangle] um2

  Table<double> triangle_geometry;  // [triangle, 4] unit normal and area, um2
  Table<double> totals;             // [cell * sections, 2] area um2 and volume um3 of each section
  Table<double> corner_force;       // [triangle of the part, 9] force on each corner, nN
  Components<double> force;         // [vertex, 3] internal force, nN
  Array<int> status;                // [1] 1 + the highest number of a cell in trouble; 0 if none

  KOKKOS_INLINE_FUNCTION TriangleRest rest(int t) const {
    TriangleRest r;
    for (int k = 0; k < 3; ++k) {
      r.length[k] = rest_length(t, k);
      r.cos_angle[k] = rest_cos(t, k);
      r.sin_angle[k] = rest_sin(t, k);
    }
    r.area = rest_area(t);
    return r;
  }
};

/// Some of the cells, one after the other.
struct CellPart {
  int first_cell = 0, cells = 0;
  int first_vertex = 0, vertices = 0;
  int first_triangle = 0, triangles = 0;
};

/// An array of which only the rows from `first` on are at hand.
template <class View>
struct RowsFrom {
  using non_const_value_type = typename View::non_const_value_type;
  View rows;
  int first = 0;

  KOKKOS_FORCEINLINE_FUNCTION decltype(auto) operator()(int i) const { return rows(i - first); }
  KOKKOS_FORCEINLINE_FUNCTION decltype(auto) operator()(int i, int k) const { return rows(i - first, k); }
};

/// use(views) with those of one part of m's cells after the other, so that what is only of use in between takes memory for a part alone.
/// Kernels that can do so say that they are for a part.
template <class Use>
void for_parts(const MembraneViews& m, const std::vector<CellPart>& parts, const Use& use) {
  if (parts.size() < 2) return use(m);
  for (const CellPart& part : parts) {
    if (part.first_cell >= m.cells) return;  // those up to there alone are wanted
    MembraneViews views = m;
    views.first_cell = part.first_cell, views.first_vertex = part.first_vertex, views.first_triangle = part.first_triangle;
    views.cells = std::min(part.cells, m.cells - part.first_cell);
    views.vertices = std::min(part.vertices, m.vertices - part.first_vertex);
    views.triangles = part.triangles;
    use(views);
  }
}

}  // namespace corpuscle
