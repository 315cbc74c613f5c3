// Signed crossings of the grid's index lines, through the centres of cells, with triangles. In index space triangles are
// flat and vertices are rounded to a fine lattice: whether a line meets a triangle is then decided exactly, and a
// closed surface never leaks.
#pragma once

#include "transfer/find_markers.hpp"

namespace corpuscle {

/// A spacing is this many units: errors of 1e-6 spacings.
constexpr int inside_bits = 20;
constexpr std::int64_t inside_unit = std::int64_t(1) << inside_bits;

/// Where a vertex is in index space, in units. @returns false if it was not found
KOKKOS_INLINE_FUNCTION bool place_in_units(const MarkerSearch& s, const VertexPlaces& places, int v, std::int64_t (&at)[3]) {
  if (!places.known(v)) return false;
  const double xi[3] = {places.xi(v, 0), places.xi(v, 1), places.xi(v, 2)};
  LatticePoint q;
  s.lattice.set(q, xi);
  double eta[3];
  lattice_to_index(s.lattice, q, eta);
  for (int d = 0; d < 3; ++d) at[d] = static_cast<std::int64_t>(std::floor(eta[d] * inside_unit + 0.5));
  return true;
}

/// Which side of the line from a to b the origin is on, in a plane: +1 left, -1 right. A tie goes as for an origin
/// moved by a little along the first axis and by much less along the second, so that both triangles of an edge agree; 0
/// only if a = b.
KOKKOS_INLINE_FUNCTION int side_of_edge(const std::int64_t (&a)[2], const std::int64_t (&b)[2]) {
  const std::int64_t area = a[0] * b[1] - a[1] * b[0], up = a[1] - b[1], along = b[0] - a[0];
  const std::int64_t decides = area != 0 ? area : (up != 0 ? up : along);
  return decides > 0 ? 1 : (decides < 0 ? -1 : 0);
}

/// Where the line along d that passes through zero of the other two coordinates meets a triangle.
struct Crossing {
  int sign = 0;         // +1 if the line enters the surface there, -1 if it leaves, 0 if they do not meet
  std::int64_t at = 0;  // in units along d
  double share[3];      // of the triangle's corners in what is linear on it
};
KOKKOS_INLINE_FUNCTION Crossing cross_triangle(const std::int64_t (&corner)[3][2], const std::int64_t (&along)[3]) {
  Crossing crossing;
  int turn = 0;
  std::int64_t weight[3], total = 0;
  for (int k = 0; k < 3; ++k) {
    const int b = k == 2 ? 0 : k + 1, c = k == 0 ? 2 : k - 1;
    const int side = side_of_edge(corner[b], corner[c]);
    if (side == 0 || (k > 0 && side != turn)) return crossing;
    turn = side;
    weight[k] = corner[b][0] * corner[c][1] - corner[b][1] * corner[c][0];
    total += weight[k];
  }
  for (int k = 0; k < 3; ++k) crossing.share[k] = static_cast<double>(weight[k]) / static_cast<double>(total);
  const double beyond_first =
      crossing.share[1] * static_cast<double>(along[1] - along[0]) + crossing.share[2] * static_cast<double>(along[2] - along[0]);
  crossing.at = along[0] + static_cast<std::int64_t>(std::floor(beyond_first + 0.5));
  crossing.sign = -turn;  // its normal, which points outward, has the sign of `turn` along d
  return crossing;
}

KOKKOS_INLINE_FUNCTION std::int64_t floor_units(std::int64_t a) { return a >> inside_bits; }

/// Calls visit(crossing, first cell of the line) for the lines along d through cells of the block that a triangle meets.
/// @param corner  [corner][direction] in units
/// @param beside  1: as for corners half a unit higher along all directions, so that none is in a plane of centres
template <class Visit>
KOKKOS_INLINE_FUNCTION void visit_crossings(const IndexSpace& index, const std::int64_t (&corner)[3][3], int d, int beside,
                                            const Visit& visit) {
  const int e = (d + 1) % 3, f = (d + 2) % 3, plane[2] = {e, f};
  int first[2], last[2];
  for (int m = 0; m < 2; ++m) {
    std::int64_t low = corner[0][plane[m]], high = low;
    for (int k = 1; k < 3; ++k) {
      const std::int64_t value = corner[k][plane[m]];
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    const std::int64_t most = index.n[plane[m]] - 1;
    first[m] = static_cast<int>(low > 0 ? floor_units(low) : 0);
    last[m] = static_cast<int>(floor_units(high) < most ? floor_units(high) : most);
  }
  const std::int64_t along[3] = {corner[0][d], corner[1][d], corner[2][d]};
  for (int b = first[1]; b <= last[1]; ++b)
    for (int a = first[0]; a <= last[0]; ++a) {
      std::int64_t relative[3][2];
      for (int k = 0; k < 3; ++k) {
        relative[k][0] = 2 * (corner[k][e] - a * inside_unit) + beside;
        relative[k][1] = 2 * (corner[k][f] - b * inside_unit) + beside;
      }
      const Crossing crossing = cross_triangle(relative, along);
      if (crossing.sign == 0) continue;
      int line[3];
      line[d] = 0, line[e] = a, line[f] = b;
      visit(crossing, line);
    }
}

/// Whether a triangle with these corners is all beyond the block's cells and a spacing around them.
KOKKOS_INLINE_FUNCTION bool beyond_block(const IndexSpace& index, const std::int64_t (&corner)[3][3]) {
  for (int d = 0; d < 3; ++d) {
    std::int64_t low = corner[0][d], high = low;
    for (int k = 1; k < 3; ++k) low = corner[k][d] < low ? corner[k][d] : low, high = corner[k][d] > high ? corner[k][d] : high;
    if (high < -inside_unit || low > index.n[d] * inside_unit) return true;
  }
  return false;
}

}  // namespace corpuscle
