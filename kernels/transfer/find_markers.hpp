// From vertices to markers: which images of each vertex reach this rank's faces, and where they are in index space.
#pragma once

#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Shifts under which vertices are seen, and how many periods each is: the identity first.
struct PeriodImages {
  int count = 1;
  Vec3 shift[27];
  int turns[27][3] = {};
};

struct MarkerSearch {
  Lattice lattice;
  PeriodImages images;
  Vec3 lower, upper;  // bounds of the lattice in space, with a margin
  double reach;       // of the kernel
};

/// What is remembered of each vertex from one step to the next.
struct VertexPlaces {
  Table<double> xi;       // [vertex, 3] where it was last found in the lattice
  Array<int> image;       // [vertex] under which image; -1 before it was
  Array<unsigned> reach;  // [vertex] bit for each image that reaches this rank's faces
  Array<int> first;       // [vertex + 1] of its markers
  Array<int> beyond;      // [1] lowest vertex found beyond a side
};
constexpr int no_vertex = 1 << 30;

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

/// The image's place in the lattice, from a guess if there is one. @returns `outside` for one whose place is extrapolated
KOKKOS_INLINE_FUNCTION Located locate_image(const Lattice& lattice, const Vec3& p, bool guessed, LatticePoint& q) {
  Located found = guessed ? lattice.locate(p, q) : Located::failed;
  if (found != Located::inside) {  // it may have been carried round a periodic direction
    lattice.coarse_start(p, q);
    found = lattice.locate(p, q);
  }
  if (found != Located::failed) lattice.polish(p, q);
  return found;
}

KOKKOS_INLINE_FUNCTION Vec3 image_position(const PeriodImages& images, const Vec3& x, int m) { return x + images.shift[m]; }

/// Start for the image m of a vertex that was found as image `from` at xi.
KOKKOS_INLINE_FUNCTION void image_guess(const MarkerSearch& s, const double (&xi)[3], int from, int m, LatticePoint& q) {
  double start[3];
  for (int d = 0; d < 3; ++d) start[d] = xi[d] + (s.images.turns[m][d] - s.images.turns[from][d]) * s.lattice.index.global[d];
  s.lattice.set(q, start);
}

/// Fills places.xi, image, reach and beyond.
inline void find_images(const MarkerSearch& search, const Components<double>& x, const VertexPlaces& places) {
  const auto beyond = places.beyond;
  Kokkos::deep_copy(Exec(), beyond, no_vertex);
  const MarkerSearch s = search;
  const VertexPlaces out = places;
  Kokkos::parallel_for(
      "corpuscle::transfer::find_images", Policy(0, static_cast<int>(places.image.extent(0))), KOKKOS_LAMBDA(int v) {
        const Vec3 here = load(x, v);
        const double xi[3] = {out.xi(v, 0), out.xi(v, 1), out.xi(v, 2)};
        const int from = out.image(v);
        unsigned mask = 0;
        int found = -1, better = 0;  // what reaches this rank's faces before what is in the lattice at all
        for (int m = 0; m < s.images.count; ++m) {
          const Vec3 p = image_position(s.images, here, m);
          if (!(p.x >= s.lower.x && p.x <= s.upper.x && p.y >= s.lower.y && p.y <= s.upper.y && p.z >= s.lower.z &&
                p.z <= s.upper.z))
            continue;
          LatticePoint q;
          if (from >= 0) image_guess(s, xi, from, m, q);
          const Located located = locate_image(s.lattice, p, from >= 0, q);
          if (located == Located::failed) continue;
          double eta[3];
          lattice_to_index(s.lattice, q, eta);
          bool outside;
          if (reaches(s, eta, outside)) mask |= 1u << m;
          if (outside) Kokkos::atomic_fetch_min(&out.beyond(0), v);
          const int good = mask >> m & 1u ? 3 : (located == Located::inside ? 2 : 1);
          if (good <= better) continue;
          found = m, better = good;
          for (int d = 0; d < 3; ++d) out.xi(v, d) = q.xi(d);
        }
        out.image(v) = found;
        out.reach(v) = mask;
      });
}

KOKKOS_INLINE_FUNCTION int count_bits(unsigned mask) {
  int n = 0;
  for (; mask; mask &= mask - 1) ++n;
  return n;
}

/// places.first, and how many markers there are.
inline int number_markers(const VertexPlaces& places) {
  const auto reach = places.reach;
  const auto first = places.first;
  const int vertices = static_cast<int>(places.image.extent(0));
  int total = 0;
  Kokkos::parallel_scan(
      "corpuscle::transfer::number_markers", Policy(0, vertices + 1),
      KOKKOS_LAMBDA(int v, int& sum, bool last) {
        if (last) first(v) = sum;
        if (v < vertices) sum += count_bits(reach(v));
      },
      total);
  return total;
}

/// Fills vertex, home and eta of the markers. Which node is nearest is rounded, so that ranks which see the same point under
/// a shift agree on the tie.
inline void fill_markers(const MarkerSearch& search, const Components<double>& x, const VertexPlaces& places,
                         const MarkerViews& markers) {
  const MarkerSearch s = search;
  const VertexPlaces in = places;
  const MarkerViews out = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::fill_markers", Policy(0, static_cast<int>(places.image.extent(0))), KOKKOS_LAMBDA(int v) {
        const unsigned mask = in.reach(v);
        const double xi[3] = {in.xi(v, 0), in.xi(v, 1), in.xi(v, 2)};
        int marker = in.first(v);
        for (int m = 0; m < s.images.count; ++m) {
          if (!(mask >> m & 1u)) continue;
          const Vec3 p = image_position(s.images, load(x, v), m);
          LatticePoint q;
          image_guess(s, xi, in.image(v), m, q);
          locate_image(s.lattice, p, true, q);
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
          out.vertex(marker) = v;
          out.home(marker) = home ? 1 : 0;
          ++marker;
        }
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
