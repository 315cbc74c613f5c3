// Cell centres, face area vectors and volumes of a curvilinear block from its node coordinates.
#pragma once

#include "common/vec3.hpp"
#include "grid/grid_views.hpp"

#include <cfloat>

namespace corpuscle {

/// Indexing of the nodes of a padded block: cell (i, j, k) has the nodes (i..i+1, j..j+1, k..k+1). Beyond a physical
/// boundary the node index is clamped, which collapses the first halo layer of cells onto the boundary faces.
struct NodeIndex {
  IndexSpace cells;
  KOKKOS_INLINE_FUNCTION int extent(int d) const { return cells.padded(d) + 1; }
  KOKKOS_INLINE_FUNCTION int size() const { return extent(0) * extent(1) * extent(2); }
  KOKKOS_INLINE_FUNCTION int operator()(int i, int j, int k) const {
    return (i + IndexSpace::halo) + extent(0) * ((j + IndexSpace::halo) + extent(1) * (k + IndexSpace::halo));
  }
};

KOKKOS_INLINE_FUNCTION double triple_product(const Vec3& a, const Vec3& b, const Vec3& c) { return dot(a, cross(b, c)); }

/// Volume of a hexahedron whose corner m has offsets (m & 1, m >> 1 & 1, m >> 2 & 1), by the long-diagonal formula
/// (Grandy, Efficient computation of volume of hexahedral cells, 1997).
KOKKOS_INLINE_FUNCTION double hexahedron_volume(const Vec3 (&p)[8]) {
  const Vec3 diagonal = p[7] - p[0];
  return (triple_product(diagonal, p[1] - p[0], p[3] - p[5]) + triple_product(diagonal, p[4] - p[0], p[5] - p[6]) +
          triple_product(diagonal, p[2] - p[0], p[6] - p[3])) /
         6.0;
}

/// Fill x, face_area and volume of `grid` from `node` [NodeIndex::size(), 3], um. The area vector of a face is half the
/// cross product of its diagonals, so the six of a cell add up to zero exactly.
template <class Nodes>
void compute_geometry(const Nodes& node, const GridViews& grid) {
  const IndexSpace index = grid.index;
  const NodeIndex at{index};
  const auto x = grid.x;
  const auto s0 = grid.face_area[0], s1 = grid.face_area[1], s2 = grid.face_area[2];
  const auto volume = grid.volume;
  constexpr int h = IndexSpace::halo;
  for_box(
      "corpuscle::grid::geometry", {-h, -h, -h}, {index.n[0] + h, index.n[1] + h, index.n[2] + h}, KOKKOS_LAMBDA(int i, int j, int k) {
        Vec3 p[8];
        Vec3 centre;
        for (int m = 0; m < 8; ++m) {
          p[m] = load(node, at(i + (m & 1), j + ((m >> 1) & 1), k + ((m >> 2) & 1)));
          centre += p[m];
        }
        const int c = index.cell(i, j, k);
        store(x, c, 0.125 * centre);
        store(s0, c, 0.5 * cross(p[6] - p[0], p[4] - p[2]));
        store(s1, c, 0.5 * cross(p[5] - p[0], p[1] - p[4]));
        store(s2, c, 0.5 * cross(p[3] - p[0], p[2] - p[1]));
        volume(c) = hexahedron_volume(p);
      });
}

/// Kind of every node of a block without bodies.
inline void mark_base_kinds(const GridViews& grid) {
  const IndexSpace index = grid.index;
  const auto kind = grid.base_kind;
  constexpr int h = IndexSpace::halo;
  for_box(
      "corpuscle::grid::base_kind", {-h, -h, -h}, {index.n[0] + h, index.n[1] + h, index.n[2] + h}, KOKKOS_LAMBDA(int i, int j, int k) {
        const int local[3] = {i, j, k};
        int beyond = 0;
        for (int d = 0; d < 3; ++d) {
          if (index.periodic[d]) continue;
          const int g = local[d] + index.first[d];
          const int layers = g < 0 ? -g : (g >= index.global[d] ? g - index.global[d] + 1 : 0);
          beyond = layers > beyond ? layers : beyond;
        }
        kind(index.cell(i, j, k)) = beyond == 0 ? NodeKind::fluid : (beyond == 1 ? NodeKind::boundary : NodeKind::none);
      });
}

/// Smallest volume of an owned cell, and where it is (compact cell number).
inline Kokkos::MinLoc<double, int>::value_type smallest_volume(const GridViews& grid) {
  using Reducer = Kokkos::MinLoc<double, int>;
  Reducer::value_type smallest;
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  Kokkos::parallel_reduce(
      "corpuscle::grid::smallest_volume", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, Reducer::value_type& least) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        const double volume_here = volume(index.cell(i, j, k));
        const double v = std::isfinite(volume_here) ? volume_here : -DBL_MAX;  // a node is not a number: worst of all
        if (v < least.val) least.val = v, least.loc = e;
      },
      Reducer(smallest));
  return smallest;
}

}  // namespace corpuscle
