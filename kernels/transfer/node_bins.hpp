// The grid's nodes in bins, to find the nearest one to a point wherever in the grid it is.
#pragma once

#include "common/counting_sort.hpp"
#include "immersed/lattice.hpp"

namespace corpuscle {

/// Nodes of the lattice by cubes of space. Grids that bend come near themselves: neighbours in space are none in index space.
struct NodeBins {
  Vec3 lower;
  double width = 0;  // um
  int n[3] = {};
  int rings = 0;     // of bins, within which a point that counts has a node
  Array<int> start;  // [bin + 1]
  Array<int> node;   // [node of the lattice] (k nj + j) ni + i, from its lower corner

  KOKKOS_INLINE_FUNCTION int along(int d, double x) const {
    const double at = std::floor((x - lower[d]) / width);
    return at < -1e6 ? -1000000 : at > 1e6 ? 1000000 : static_cast<int>(at);
  }
  KOKKOS_INLINE_FUNCTION int bin(int i, int j, int k) const { return (k * n[1] + j) * n[0] + i; }
};

KOKKOS_INLINE_FUNCTION void lattice_node(const Lattice& lattice, int number, int (&at)[3]) {
  const int ni = lattice.upper[0] - lattice.lower[0] + 1, nj = lattice.upper[1] - lattice.lower[1] + 1;
  at[0] = lattice.lower[0] + number % ni;
  at[1] = lattice.lower[1] + number / ni % nj;
  at[2] = lattice.lower[2] + number / ni / nj;
}

/// The node nearest to a point of those that are some cells away, along a direction of the grid, from all nodes in `others`.
/// @returns false if there is none near
KOKKOS_INLINE_FUNCTION bool nearest_node(const NodeBins& bins, const Lattice& lattice, const Vec3& p, const int (*others)[3], int count,
                                         int (&found)[3]) {
  constexpr int apart = 4;  // cells
  const int c[3] = {bins.along(0, p.x), bins.along(1, p.y), bins.along(2, p.z)};
  double best = 1e300;
  for (int r = 0; r <= bins.rings; ++r) {
    const double least = (r - 1) * bins.width;  // to any point of this ring
    if (r > 1 && best < least * least) break;
    for (int k = c[2] - r; k <= c[2] + r; ++k) {
      if (k < 0 || k >= bins.n[2]) continue;
      for (int j = c[1] - r; j <= c[1] + r; ++j) {
        if (j < 0 || j >= bins.n[1]) continue;
        const bool face = k == c[2] - r || k == c[2] + r || j == c[1] - r || j == c[1] + r;
        for (int i = c[0] - r; i <= c[0] + r; i += face || r == 0 ? 1 : 2 * r) {
          if (i < 0 || i >= bins.n[0]) continue;
          const int b = bins.bin(i, j, k);
          for (int e = bins.start(b); e < bins.start(b + 1); ++e) {
            int at[3];
            lattice_node(lattice, bins.node(e), at);
            const Vec3 way = lattice.position(lattice.node(at[0], at[1], at[2])) - p;
            const double square = dot(way, way);
            if (square >= best) continue;
            bool other = true;
            for (int s = 0; s < count; ++s) {
              bool near = true;
              for (int d = 0; d < 3; ++d) near = near && at[d] - others[s][d] < apart && others[s][d] - at[d] < apart;
              other = other && !near;
            }
            if (!other) continue;
            best = square;
            for (int d = 0; d < 3; ++d) found[d] = at[d];
          }
        }
      }
    }
  }
  return best < 1e300;
}

/// @param lower, upper  of the lattice in space
/// @param mean, longest  of the lattice's links, um
inline NodeBins make_node_bins(const Lattice& lattice, const Vec3& lower, const Vec3& upper, double mean, double longest) {
  NodeBins bins;
  int nodes = 1;
  for (int d = 0; d < 3; ++d) nodes *= lattice.upper[d] - lattice.lower[d] + 1;
  bins.lower = lower;
  bins.width = mean;
  const double most = 2.0 * nodes + 1000;
  double count;
  do {
    count = 1;
    for (int d = 0; d < 3; ++d) {
      const double along = std::floor((upper[d] - lower[d]) / bins.width) + 1;
      bins.n[d] = static_cast<int>(along < 1e6 ? along : 1e6);
      count *= along;
    }
    if (count > most) bins.width *= 1.2;
  } while (count > most);
  bins.rings = static_cast<int>(std::ceil(2 * longest / bins.width)) + 1;
  const int all = bins.n[0] * bins.n[1] * bins.n[2];
  bins.start = Array<int>(uninitialised("corpuscle::transfer::node_bin_start"), all + 1);
  bins.node = Array<int>(uninitialised("corpuscle::transfer::node_bin_order"), nodes);
  const NodeBins b = bins;
  const Lattice l = lattice;
  counting_sort(
      "corpuscle::transfer::node_bins", nodes, all,
      KOKKOS_LAMBDA(int number) {
        int at[3];
        lattice_node(l, number, at);
        const Vec3 p = l.position(l.node(at[0], at[1], at[2]));
        int to[3];
        for (int d = 0; d < 3; ++d) {
          to[d] = b.along(d, p[d]);
          to[d] = to[d] < 0 ? 0 : to[d] > b.n[d] - 1 ? b.n[d] - 1 : to[d];
        }
        return b.bin(to[0], to[1], to[2]);
      },
      bins.start, bins.node);
  return bins;
}

}  // namespace corpuscle
