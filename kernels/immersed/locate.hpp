// Where the surfaces' vertices are in index space, and who owns them.
#pragma once

#include "common/extremes.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

struct LocateOptions {
  bool warm = false;     // xi holds the positions of an earlier call
  bool guarded[6] = {};  // i_min, i_max, ... : sides whose distance is reported
  bool outflow[6] = {};  // sides whose distance from the first `travellers` vertices is reported
  int travellers = 0;
  Vec3 lower, upper;        // bounds of the lattice in space, with a margin
  double band_links = 1.1;  // half-width of the band in link lengths
};

/// Empty boxes and no findings.
inline void reset_places(const SurfaceSet& s, const PlaceViews& places) {
  const auto box = places.box;
  const auto found = places.found;
  Kokkos::parallel_for(
      "corpuscle::immersed::reset_boxes", Policy(0, static_cast<int>(box.extent(0))),
      KOKKOS_LAMBDA(int e) { box(e) = e % 6 < 3 ? 1 << 28 : -(1 << 28); });
  Kokkos::parallel_for(
      "corpuscle::immersed::reset_findings", Policy(0, 4), KOKKOS_LAMBDA(int e) { found(e) = e == 2 ? 0 : no_key; });
  Kokkos::deep_copy(Exec(), places.image, -1);
  static_cast<void>(s);
}

/// Distance of a located point to a side in local spacings; the boundary is half a spacing below the first node.
KOKKOS_INLINE_FUNCTION double spacings_to_side(const Lattice& lattice, const double (&xi)[3], int side) {
  const int d = side / 2;
  const double beyond = side % 2 == 0 ? xi[d] - lattice.lower[d] : lattice.upper[d] - xi[d];
  return beyond < 1 ? 0.5 * beyond : beyond - 0.5;
}

/// Grow the node box at `offset` so that it holds the band around a vertex.
KOKKOS_INLINE_FUNCTION void grow_box(const Array<int>& box, int offset, const double (&xi)[3], const double (&pad)[3]) {
  for (int d = 0; d < 3; ++d) {
    Kokkos::atomic_fetch_min(&box(offset + d), static_cast<int>(std::floor(xi[d] - pad[d])) - 1);
    Kokkos::atomic_fetch_max(&box(offset + 3 + d), static_cast<int>(std::ceil(xi[d] + pad[d])) + 1);
  }
}

/// The node next to a point along d. Rounded, so that ranks which see the same point under a shift agree on the tie.
KOKKOS_INLINE_FUNCTION int nearest_node(const LatticePoint& q, int d) {
  return q.base[d] + (std::floor(q.f[d] * 1073741824.0 + 0.5) >= 536870912.0 ? 1 : 0);
}

/// Fills every member of `places` but the boxes' initial values (see reset_places). A vertex is owned by the rank that
/// owns the node nearest to it in index space; beyond a physical boundary it is owned by nobody and reported.
inline void locate_vertices(const Lattice& lattice, const SurfaceSet& s, const Images& images, const LocateOptions& options,
                            const PlaceViews& places) {
  reset_places(s, places);
  const auto x = s.x;
  const auto body = s.vertex_body;
  const int vertices = s.vertices;
  const PlaceViews out = places;
  Kokkos::parallel_for(
      "corpuscle::immersed::locate_vertices", Policy(0, vertices), KOKKOS_LAMBDA(int v) {
        for (int m = 0; m < images.count; ++m) {
          const int item = m * vertices + v;
          const Vec3 p = load(x, v) + images.shift[m];
          const bool far = p.x < options.lower.x || p.x > options.upper.x || p.y < options.lower.y || p.y > options.upper.y ||
                           p.z < options.lower.z || p.z > options.upper.z;
          const bool known = options.warm && out.status(item) != Located::failed;
          const bool was_inside = known && out.status(item) == Located::inside;
          if (far) {
            out.status(item) = Located::failed;
            continue;
          }
          LatticePoint q;
          Located status = Located::failed;
          if (known) {
            const double start[3] = {out.xi(item, 0), out.xi(item, 1), out.xi(item, 2)};
            lattice.set(q, start);
            status = lattice.locate(p, q);
          }
          // A point that was inside and has left, or was carried round a periodic direction: look everywhere.
          if (status == Located::failed || (was_inside && status == Located::outside)) {
            lattice.coarse_start(p, q);
            status = lattice.locate(p, q);
          }
          out.status(item) = status;
          if (status == Located::failed) continue;
          lattice.polish(p, q);

          const double xi[3] = {q.xi(0), q.xi(1), q.xi(2)};
          LatticePoint near = q;  // tangents where the lattice ends, not extrapolated ones
          for (int d = 0; d < 3; ++d) near.f[d] = near.f[d] < 0 ? 0 : (near.f[d] > 1 ? 1 : near.f[d]);
          Vec3 tangent[3], row[3];
          lattice.cell_tangents(near, tangent);
          inverse_rows(tangent, row);
          double link = 0, pad[3];
          for (int d = 0; d < 3; ++d) link = norm(tangent[d]) > link ? norm(tangent[d]) : link;
          for (int d = 0; d < 3; ++d) pad[d] = options.band_links * link * norm(row[d]);
          out.width(item) = options.band_links * link;
          bool owned = true, beside = true, beyond = false;
          for (int d = 0; d < 3; ++d) {
            out.xi(item, d) = xi[d];
            out.pad(item, d) = pad[d];
            const int nearest = nearest_node(q, d);
            const bool below = lattice.boundary_below[d] && xi[d] < -1, above = lattice.boundary_above[d] && xi[d] > lattice.index.n[d];
            beyond = beyond || below || above;
            beside = beside && xi[d] > lattice.lower[d] - 2 && xi[d] < lattice.upper[d] + 2;
            const bool low = nearest >= 0 || lattice.boundary_below[d];
            const bool high = nearest < lattice.index.n[d] || lattice.boundary_above[d];
            owned = owned && low && high;
          }
          if (beyond) {
            if (beside) Kokkos::atomic_fetch_min(&out.found(0), static_cast<Key>(v));
            owned = false;
          }
          if (owned && out.image(v) < 0 && status == Located::inside) {
            out.image(v) = m;
            Kokkos::atomic_fetch_add(&out.found(2), static_cast<Key>(1));
          }
          for (int side = 0; side < 6; ++side) {
            const bool here = side % 2 == 0 ? lattice.boundary_below[side / 2] : lattice.boundary_above[side / 2];
            const bool leaves = options.outflow[side] && v < options.travellers;
            if (!here || !owned || !(options.guarded[side] || leaves)) continue;
            const double gap = spacings_to_side(lattice, xi, side), length = leaves ? gap * norm(tangent[side / 2]) : gap;
            Kokkos::atomic_fetch_min(&out.found(leaves ? 3 : 1), pack_key(length > 0 ? length : 0, static_cast<unsigned>(v)));
          }
          grow_box(out.box, 0, xi, pad);
          grow_box(out.box, 6 * (1 + body(v)), xi, pad);
        }
      });
}

/// Smallest distance between neighbouring nodes, over directions, at the nodes nearest to the vertices owned here, um. The
/// same whatever the decomposition: a vertex's owner holds its nearest node.
inline double smallest_spacing_at(const Lattice& lattice, int vertices, const PlaceViews& places) {
  const PlaceViews in = places;
  double smallest = 1e300;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::smallest_spacing", Policy(0, vertices),
      KOKKOS_LAMBDA(int v, double& least) {
        if (in.image(v) < 0) return;
        const int item = in.image(v) * vertices + v;
        const double xi[3] = {in.xi(item, 0), in.xi(item, 1), in.xi(item, 2)};
        LatticePoint q;
        lattice.set(q, xi);
        int at[3];
        for (int d = 0; d < 3; ++d) {
          at[d] = nearest_node(q, d);
          at[d] = at[d] < 0 ? 0 : (at[d] < lattice.index.n[d] ? at[d] : lattice.index.n[d] - 1);
        }
        const int c = lattice.node(at[0], at[1], at[2]);
        for (int d = 0; d < 3; ++d) {
          const double spacing = 0.5 * norm(lattice.position(c + lattice.index.stride(d)) - lattice.position(c - lattice.index.stride(d)));
          least = smaller(least, spacing);
        }
      },
      Smallest(smallest));
  return smallest;
}

}  // namespace corpuscle
