// Markers: the points that pass forces to the grid and take velocities from it. A vertex has a marker where its kernel touches
// faces of this rank; of a cell near the sides of the rank's block there are copies on other ranks, and beyond periodic sides,
// whose vertices have markers of their own. So no kernel knows of periods or ranks.
#pragma once

#include "immersed/lattice.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Arrays have room for more markers than there are; `points` is that of the kernel. What faces ask of markers is held in rows for the
/// markers of some planes of cells at a time: 180 bytes each, 204 with dipoles.
struct MarkerViews {
  int count = 0;
  Array<int> vertex;          // [marker] where it comes from
  Array<unsigned char> home;  // [marker] 1 for the one marker of a vertex and its copies, of all ranks, that lies in its rank's own cells
  Table<double> xi;           // [vertex, 3] places in the lattice: VertexPlaces::xi
  int first = 0, rows = 0;    // those of `order` that have rows
  Table<short> base;          // [row, 6] first cell, then first face, along each direction that it reaches
  Table<double> weight;       // [row, 6 points] of those lines of points
  Table<double> across;       // [row, 3] what its force amounts to as pressure across faces of each direction, kPa
  Table<double> dipole;       // [row, 3] the same of its changes along each direction, across the faces of one (kink.hpp)
  Array<int> start;           // [cell + 1] first of `order` in each cell of the block, halo included
  Array<int> order;           // markers by cell, in each cell in the order of their numbers
  Array<unsigned char> near;  // [cell] 1 where a marker reaches the cell or its low faces
};

/// The rank's block as markers see it.
struct TransferBlock {
  Lattice lattice;
  Components<double> area[3], sharp_area[3];  // of faces, and as sharpen_faces() makes them
  bool even = false;                          // all faces of a direction have the same
  /// [direction][end][0: other velocities, 1: the normal one] by which a velocity is reflected beyond a side: -1 where the side
  /// gives it, +1 where it gives the derivative.
  double reflection[3][2][2];

  KOKKOS_INLINE_FUNCTION const IndexSpace& index() const { return lattice.index; }
  /// Number of cells (or faces) along e that belong to this rank.
  KOKKOS_INLINE_FUNCTION int rows(int e, bool faces) const { return index().n[e] + (faces && lattice.boundary_above[e] ? 1 : 0); }
  KOKKOS_INLINE_FUNCTION bool owns(int e, bool faces, int row) const { return row >= 0 && row < rows(e, faces); }
};

/// Index coordinates in which walls are half a cell away from the first cell, of one direction of the lattice.
KOKKOS_INLINE_FUNCTION double lattice_to_index(const Lattice& lattice, int d, double xi) {
  const int last = lattice.index.n[d] - 1;
  if (lattice.boundary_below[d] && xi < 0) return 0.5 * xi;
  if (lattice.boundary_above[d] && xi > last) return last + 0.5 * (xi - last);
  return xi;
}

/// A marker's position in index space: cells of this rank at 0, 1, ...; walls half a cell away, and nothing beyond them.
struct MarkerPlace {
  double eta[3];

  KOKKOS_INLINE_FUNCTION MarkerPlace(const Lattice& lattice, const MarkerViews& m, int marker) {
    const int v = m.vertex(marker);
    for (int d = 0; d < 3; ++d) {
      const double at = lattice_to_index(lattice, d, m.xi(v, d)), end = lattice.index.n[d] - 0.5;
      eta[d] = lattice.boundary_below[d] && at < -0.5 ? -0.5 : (lattice.boundary_above[d] && at > end ? end : at);
    }
  }
};

/// The points along one direction that a marker reaches.
template <class Delta>
struct DeltaLine {
  int base = 0;
  double weight[Delta::points];
  int row[Delta::points];  // the point itself, or its mirror image if it lies beyond a side
  int end[Delta::points];  // of the side that it lies beyond: 0 low, 1 high; -1 for none
};

template <class Delta>
KOKKOS_INLINE_FUNCTION int first_point(bool faces, double eta) {
  return Delta::first(faces ? eta + 0.5 : eta);
}

template <class Delta>
KOKKOS_INLINE_FUNCTION DeltaLine<Delta> delta_line(const TransferBlock& block, int e, bool faces, double eta) {
  const int n = block.index().n[e];
  const double t = faces ? eta + 0.5 : eta;
  DeltaLine<Delta> line;
  line.base = first_point<Delta>(faces, eta);
  for (int p = 0; p < Delta::points; ++p) {
    const int i = line.base + p;
    line.weight[p] = Delta::value(i - t);
    line.row[p] = i;
    line.end[p] = -1;
    if (block.lattice.boundary_below[e] && i < 0) line.row[p] = faces ? -i : -1 - i, line.end[p] = 0;
    if (block.lattice.boundary_above[e] && i > (faces ? n : n - 1)) line.row[p] = faces ? 2 * n - i : 2 * n - 1 - i, line.end[p] = 1;
  }
  return line;
}

/// The points that a marker reaches: along each direction the cells, then the faces. Weights of points beyond a side are folded back:
/// reflected where the side gives the velocity (no slip is then exact, and a force keeps its moment about the wall, which takes the rest
/// of it), added where it gives the derivative.
template <class Delta>
struct MarkerLines {
  static constexpr int points = Delta::points;
  int first[6];
  double value[6 * points];

  KOKKOS_INLINE_FUNCTION MarkerLines(const TransferBlock& block, const double (&eta)[3]) {
    for (int e = 0; e < 3; ++e)
      for (int faces = 0; faces < 2; ++faces) {
        const DeltaLine<Delta> line = delta_line<Delta>(block, e, faces == 1, eta[e]);
        double* const folded = value + (3 * faces + e) * points;
        for (int p = 0; p < points; ++p) folded[p] = 0;
        for (int p = 0; p < points; ++p) {
          const int to = line.row[p] - line.base;  // out of range where the weight is zero
          if (to >= 0 && to < points)
            folded[to] += line.end[p] < 0 ? line.weight[p] : block.reflection[e][line.end[p]][faces] * line.weight[p];
        }
        first[3 * faces + e] = line.base;
      }
  }
  KOKKOS_INLINE_FUNCTION int base(int line) const { return first[line]; }
  KOKKOS_INLINE_FUNCTION double weight(int line, int point) const { return value[line * points + point]; }
};

/// The same of a marker's row.
template <class Delta>
struct StoredLines {
  const MarkerViews& markers;
  int row;

  KOKKOS_INLINE_FUNCTION int base(int line) const { return markers.base(row, line); }
  KOKKOS_INLINE_FUNCTION double weight(int line, int point) const { return markers.weight(row, line * Delta::points + point); }
};

}  // namespace corpuscle
