// From vertices to markers: which vertices reach this rank's faces, and where they are in index space.
#pragma once

#include "immersed/surface_views.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

struct MarkerSearch {
  Lattice lattice;
  Vec3 lower, upper;  // bounds of the lattice in space, with a margin
  double reach;       // of the kernel
};

/// What is remembered of each vertex from one step to the next. Arrays may have room for more.
struct VertexPlaces {
  int vertices = 0;
  Table<double> xi;             // [vertex, 3] where it was last found in the lattice
  Array<unsigned char> known;   // [vertex] 1 if it was, at the last look
  Array<unsigned char> reach;   // [vertex] 1 if it reaches this rank's faces
  Array<int> beyond;            // [1] lowest vertex found beyond a side
};

/// Index coordinates in which walls are half a cell away from the first cell.
KOKKOS_INLINE_FUNCTION void lattice_to_index(const Lattice& lattice, const LatticePoint& q, double (&eta)[3]) {
  for (int d = 0; d < 3; ++d) {
    const double xi = q.xi(d);
    eta[d] = xi;
    if (lattice.boundary_below[d] && xi < 0) eta[d] = 0.5 * xi;
    if (lattice.boundary_above[d] && xi > lattice.index.n[d] - 1)
      eta[d] = lattice.index.n[d] - 1 + 0.5 * (xi - (lattice.index.n[d] - 1));
  }
}

/// Whether the kernel of a marker touches points of this rank along every direction, and whether it is beyond a side.
KOKKOS_INLINE_FUNCTION bool reaches(const MarkerSearch& s, const double (&eta)[3], bool& beyond) {
  constexpr double on_side = 1e-9;
  beyond = false;
  bool near = true;
  for (int d = 0; d < 3; ++d) {
    const double low = s.lattice.boundary_below[d] ? -0.5 - on_side : -0.5 - s.reach;
    const double high = s.lattice.boundary_above[d] ? s.lattice.index.n[d] - 0.5 + on_side : s.lattice.index.n[d] - 1 + s.reach;
    const bool outside = eta[d] < low || eta[d] > high;
    const bool at_side = eta[d] < low ? s.lattice.boundary_below[d] : s.lattice.boundary_above[d];
    near = near && (!outside || at_side);
    beyond = beyond || (outside && at_side);
  }
  beyond = beyond && near;
  return near && !beyond;
}

/// A vertex's place in the lattice, from a guess if there is one. @returns false if it is not to be found
KOKKOS_INLINE_FUNCTION bool locate_vertex(const Lattice& lattice, const Vec3& p, bool guessed, LatticePoint& q) {
  if (!guessed || lattice.locate(p, q) != Located::inside) {
    lattice.coarse_start(p, q);
    if (lattice.locate(p, q) == Located::failed) return false;
  }
  lattice.polish(p, q);
  return true;
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
        if (!locate_vertex(s.lattice, p, guessed, q)) return;
        double eta[3];
        lattice_to_index(s.lattice, q, eta);
        bool outside;
        out.reach(v) = reaches(s, eta, outside) ? 1 : 0;
        if (outside) Kokkos::atomic_fetch_min(&out.beyond(0), v);
        out.known(v) = 1;
        for (int d = 0; d < 3; ++d) out.xi(v, d) = q.xi(d);
      });
}

/// Vertices that are others than before begin their search where their body's first one is: the search from nothing is long.
inline void seed_places(const MarkerSearch& search, const SurfaceSet& set, const VertexPlaces& places) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const MarkerSearch s = search;
  const VertexPlaces out = places;
  const auto x = set.x;
  const auto first_vertex = set.first_vertex;
  Kokkos::parallel_for(
      "corpuscle::transfer::seed_places", Kokkos::TeamPolicy<Exec>(set.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int first = first_vertex(team.league_rank()), last = first_vertex(team.league_rank() + 1);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          LatticePoint q;
          const bool found = locate_vertex(s.lattice, load(x, first), false, q);
          out.known(first) = found ? 1 : 0;
          for (int d = 0; d < 3; ++d) out.xi(first, d) = q.xi(d);
        });
        team.team_barrier();
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, first + 1, last), [&](int v) {
          out.known(v) = out.known(first);
          for (int d = 0; d < 3; ++d) out.xi(v, d) = out.xi(first, d);
        });
      });
}

/// How many markers there are, and the vertex of each, in the order of vertices.
inline int number_markers(const VertexPlaces& places, const MarkerViews& markers, int room) {
  const auto reach = places.reach;
  const auto vertex = markers.vertex;
  int total = 0;
  Kokkos::parallel_scan(
      "corpuscle::transfer::number_markers", Policy(0, places.vertices),
      KOKKOS_LAMBDA(int v, int& sum, bool last) {
        if (!reach(v)) return;
        if (last && sum < room) vertex(sum) = v;
        ++sum;
      },
      total);
  return total;
}

/// Fills home and eta of the markers. Which node is nearest is rounded, so that ranks which see the same point under
/// a shift agree on the tie.
inline void fill_markers(const MarkerSearch& search, const VertexPlaces& places, const MarkerViews& markers) {
  const MarkerSearch s = search;
  const VertexPlaces in = places;
  const MarkerViews out = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::fill_markers", Policy(0, markers.count), KOKKOS_LAMBDA(int marker) {
        const int v = out.vertex(marker);
        const double xi[3] = {in.xi(v, 0), in.xi(v, 1), in.xi(v, 2)};
        LatticePoint q;
        s.lattice.set(q, xi);
        double eta[3];
        lattice_to_index(s.lattice, q, eta);
        bool home = true;
        for (int d = 0; d < 3; ++d) {
          if (s.lattice.boundary_below[d] && eta[d] < -0.5) eta[d] = -0.5;
          if (s.lattice.boundary_above[d] && eta[d] > s.lattice.index.n[d] - 0.5) eta[d] = s.lattice.index.n[d] - 0.5;
          out.eta(marker, d) = eta[d];
          const double nearest = std::floor(std::floor((eta[d] + 0.5) * 1073741824.0 + 0.5) / 1073741824.0);
          home = home && (nearest >= 0 || s.lattice.boundary_below[d]) &&
                 (nearest < s.lattice.index.n[d] || s.lattice.boundary_above[d]);
        }
        out.home(marker) = home ? 1 : 0;
      });
}

inline int count_at_home(const MarkerViews& markers) {
  const auto home = markers.home;
  int count = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::count_at_home", Policy(0, markers.count), KOKKOS_LAMBDA(int m, int& sum) { sum += home(m); },
      count);
  return count;
}

}  // namespace corpuscle
