// From vertices to markers: which vertices reach this rank's faces, and where they are in index space.
#pragma once

#include "common/summing.hpp"
#include "immersed/surface_views.hpp"
#include "transfer/marker_views.hpp"
#include "transfer/node_bins.hpp"

namespace corpuscle {

struct MarkerSearch {
  Lattice lattice;
  Vec3 lower, upper;  // bounds of the lattice in space, with a margin
  double reach;       // of the kernel
  NodeBins bins;
};

/// What is remembered of each vertex from one step to the next. Arrays may have room for more.
struct VertexPlaces {
  int vertices = 0;
  Table<double> xi;            // [vertex, 3] where it was last found in the lattice
  Array<unsigned char> known;  // [vertex] 1 if it was, at the last look
  Array<unsigned char> reach;  // [vertex] 1 if it reaches this rank's faces
  Array<int> beyond;           // [1] lowest vertex found beyond a side
};

KOKKOS_INLINE_FUNCTION void lattice_to_index(const Lattice& lattice, const LatticePoint& q, double (&eta)[3]) {
  for (int d = 0; d < 3; ++d) eta[d] = lattice_to_index(lattice, d, q.xi(d));
}

/// Whether the kernel of a marker touches points of this rank along every direction, and whether it is beyond a side, by about
/// a cell at most: what is farther is elsewhere in the grid, where that bends, or nowhere.
KOKKOS_INLINE_FUNCTION bool reaches(const MarkerSearch& s, const double (&eta)[3], bool& beyond) {
  constexpr double on_side = 1e-9, a_cell = 1;
  beyond = false;
  bool near = true;
  for (int d = 0; d < 3; ++d) {
    const double low = s.lattice.boundary_below[d] ? -0.5 - on_side : -0.5 - s.reach;
    const double high = s.lattice.boundary_above[d] ? s.lattice.index.n[d] - 0.5 + on_side : s.lattice.index.n[d] - 1 + s.reach;
    const bool outside = eta[d] < low || eta[d] > high;
    const bool at_side = eta[d] < low ? s.lattice.boundary_below[d] : s.lattice.boundary_above[d];
    near = near && (!outside || (at_side && eta[d] >= low - a_cell && eta[d] <= high + a_cell));
    beyond = beyond || (outside && at_side);
  }
  beyond = beyond && near;
  return near && !beyond;
}

/// Whether a point is no farther beyond sides than the cells next to them are wide.
KOKKOS_INLINE_FUNCTION bool at_sides(const Lattice& lattice, const LatticePoint& q) {
  constexpr double most = 4;  // nodes of half cells
  for (int d = 0; d < 3; ++d) {
    if (lattice.boundary_below[d] && q.xi(d) < lattice.lower[d] - most) return false;
    if (lattice.boundary_above[d] && q.xi(d) > lattice.upper[d] + most) return false;
  }
  return true;
}

/// A vertex's place in the lattice, from a guess if there is one, and else from the nearest nodes of different parts of the
/// grid. A place in it is the right one whatever the start; only without, the nearest one beyond it is.
/// @returns false if it is not to be found
KOKKOS_INLINE_FUNCTION bool locate_vertex(const MarkerSearch& s, const Vec3& p, bool guessed, LatticePoint& q) {
  constexpr int most = 3;
  if (guessed && s.lattice.find_in_cell(p, q)) return true;
  if (guessed && s.lattice.locate(p, q) == Located::inside) {
    s.lattice.polish(p, q);
    return true;
  }
  int starts[most][3];
  bool found = false;
  for (int n = 0; n < most; ++n) {
    if (!nearest_node(s.bins, s.lattice, p, starts, n, starts[n])) break;
    const double xi[3] = {static_cast<double>(starts[n][0]), static_cast<double>(starts[n][1]), static_cast<double>(starts[n][2])};
    LatticePoint from;
    s.lattice.set(from, xi);
    const Located where = s.lattice.locate(p, from);
    if (where == Located::failed || (found && where != Located::inside) || !at_sides(s.lattice, from)) continue;
    q = from;
    found = true;
    if (where == Located::inside) break;
  }
  if (found) s.lattice.polish(p, q);
  return found;
}

KOKKOS_INLINE_FUNCTION bool within_bounds(const MarkerSearch& s, const Vec3& p) {
  return p.x >= s.lower.x && p.x <= s.upper.x && p.y >= s.lower.y && p.y <= s.upper.y && p.z >= s.lower.z && p.z <= s.upper.z;
}

/// Fills places.xi, known, reach and beyond.
inline void find_vertices(const MarkerSearch& search, const Components<double>& x, const VertexPlaces& places) {
  const auto beyond = places.beyond;
  Kokkos::deep_copy(Exec(), beyond, no_vertex);
  const MarkerSearch s = search;
  const VertexPlaces out = places;
  Kokkos::parallel_for(
      "corpuscle::transfer::find_vertices", Policy(0, places.vertices), KOKKOS_LAMBDA(int v) {
        const Vec3 p = load(x, v);
        const bool guessed = out.known(v);
        out.reach(v) = out.known(v) = 0;
        if (!within_bounds(s, p)) return;
        LatticePoint q;
        if (guessed) {
          const double xi[3] = {out.xi(v, 0), out.xi(v, 1), out.xi(v, 2)};
          s.lattice.set(q, xi);
        }
        if (!locate_vertex(s, p, guessed, q)) return;
        double eta[3];
        lattice_to_index(s.lattice, q, eta);
        bool outside;
        out.reach(v) = reaches(s, eta, outside) ? 1 : 0;
        if (outside) Kokkos::atomic_fetch_min(&out.beyond(0), v);
        out.known(v) = 1;
        for (int d = 0; d < 3; ++d) out.xi(v, d) = q.xi(d);
      });
}

/// How many markers there are, and the vertex of each, in the order of vertices.
inline int number_markers(const VertexPlaces& places, const MarkerViews& markers, int room) {
  const auto reach = places.reach;
  const auto vertex = markers.vertex;
  return running_sum<int>(
      "corpuscle::transfer::number_markers", places.vertices, KOKKOS_LAMBDA(int v, int& sum, bool last) {
        if (!reach(v)) return;
        if (last && sum < room) vertex(sum) = v;
        ++sum;
      });
}

/// Fills home of the markers. Which node is nearest is rounded, so that ranks which see the same point under
/// a shift agree on the tie.
inline void fill_markers(const MarkerSearch& search, const MarkerViews& markers) {
  const Lattice lattice = search.lattice;
  const MarkerViews out = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::fill_markers", Policy(0, markers.count), KOKKOS_LAMBDA(int marker) {
        const MarkerPlace place(lattice, out, marker);
        bool home = true;
        for (int d = 0; d < 3; ++d) {
          const double nearest = std::floor(std::floor((place.eta[d] + 0.5) * 1073741824.0 + 0.5) / 1073741824.0);
          home = home && (nearest >= 0 || lattice.boundary_below[d]) && (nearest < lattice.index.n[d] || lattice.boundary_above[d]);
        }
        out.home(marker) = home ? 1 : 0;
      });
}

/// Adds one to the first component of what is at home. @param count  [vertex, 3]
inline void mark_at_home(const MarkerViews& markers, const Components<double>& count) {
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::mark_at_home", Policy(0, markers.count), KOKKOS_LAMBDA(int marker) {
        if (m.home(marker)) count(m.vertex(marker), 0) += 1;
      });
}

inline int count_at_home(const MarkerViews& markers) {
  const auto home = markers.home;
  int count = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::count_at_home", Policy(0, markers.count), KOKKOS_LAMBDA(int m, int& sum) { sum += home(m); }, count);
  return count;
}

}  // namespace corpuscle
