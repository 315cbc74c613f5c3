// The band of nodes around the surfaces: closest triangle, signed distance, and grid links that cross a surface.
#pragma once

#include "immersed/triangle.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// Unit face normals, and vertex normals weighted by the angle at the vertex.
inline void pseudo_normals(const SurfaceSet& set, const PseudoNormals& normals) {
  const SurfaceSet s = set;
  const auto x = set.x;
  const auto face = normals.face, vertex = normals.vertex;
  Kokkos::parallel_for(
      "corpuscle::immersed::face_normals", Policy(0, s.triangles), KOKKOS_LAMBDA(int t) {
        const Vec3 a = load(x, s.triangle(t, 0));
        const Vec3 n = cross(load(x, s.triangle(t, 1)) - a, load(x, s.triangle(t, 2)) - a);
        const double length = norm(n);
        store(face, t, n * (length > 0 ? 1 / length : 0));
      });
  Kokkos::parallel_for(
      "corpuscle::immersed::vertex_normals", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        const Vec3 at = load(x, v);
        Vec3 sum;
        for (int r = s.ring_start(v); r < s.ring_start(v + 1); ++r) {
          const int t = s.ring_triangle(r);
          const int corner = s.triangle(t, 0) == v ? 0 : (s.triangle(t, 1) == v ? 1 : 2);
          const Vec3 p = load(x, s.triangle(t, (corner + 1) % 3)) - at, q = load(x, s.triangle(t, (corner + 2) % 3)) - at;
          sum += std::atan2(norm(cross(p, q)), dot(p, q)) * load(face, t);
        }
        store(vertex, v, sum);
      });
}

/// Pseudonormal at a point of triangle t: exact sign for any point whose closest surface point it is.
KOKKOS_INLINE_FUNCTION Vec3 pseudo_normal(const SurfaceSet& s, const PseudoNormals& normals, int t, int feature) {
  if (feature == 0) return load(normals.face, t);
  if (feature <= 3) return load(normals.face, t) + load(normals.face, s.neighbour(t, feature - 1));
  return load(normals.vertex, s.triangle(t, feature - 4));
}

inline void clear_band(const Lattice& lattice, const NodeBox& box, const BandViews& band) {
  const auto key = band.key;
  const auto cut = band.cut;
  Kokkos::parallel_for(
      "corpuscle::immersed::clear_band", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        key(c) = no_key;
        cut(c) = 0;
      });
}

/// A triangle in index space. Not found where no corner was located.
struct TriangleBox {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300}, pad[3] = {0, 0, 0};
  double width = 0;  // half-width of the band, um
  bool found = false;

  /// The nodes of `within` that are within `wide` nodes of the triangle.
  KOKKOS_INLINE_FUNCTION NodeBox nodes(const NodeBox& within, const double (&wide)[3]) const {
    NodeBox box;
    for (int d = 0; d < 3; ++d) {
      box.lower[d] = static_cast<int>(std::ceil(low[d] - wide[d]));
      box.upper[d] = static_cast<int>(std::floor(high[d] + wide[d]));
    }
    return box.clipped(within.lower, within.upper);
  }
};
KOKKOS_INLINE_FUNCTION TriangleBox triangle_box(const SurfaceSet& s, const PlaceViews& places, int t, int m) {
  TriangleBox b;
  for (int corner = 0; corner < 3; ++corner) {
    const int item = m * s.vertices + s.triangle(t, corner);
    if (places.status(item) == Located::failed) continue;
    b.found = true;
    b.width = places.width(item) > b.width ? places.width(item) : b.width;
    for (int d = 0; d < 3; ++d) {
      const double xi = places.xi(item, d), p = places.pad(item, d);
      b.low[d] = xi < b.low[d] ? xi : b.low[d];
      b.high[d] = xi > b.high[d] ? xi : b.high[d];
      b.pad[d] = p > b.pad[d] ? p : b.pad[d];
    }
  }
  return b;
}

/// Key that a triangle offers to a node at p.
KOKKOS_INLINE_FUNCTION Key offer(const Vec3& p, const Corners& k, int item) {
  const TrianglePoint foot = closest_on_triangle(p, k.a, k.b, k.c);
  const Vec3 r = p - (foot.weight[0] * k.a + foot.weight[1] * k.b + foot.weight[2] * k.c);
  return pack_key(norm(r), static_cast<unsigned>(item));
}

/// Each triangle offers itself, with its distance, to the nodes of `within` in the band's width; the closest wins, the lowest
/// number among equals.
inline void mark_band(const Lattice& lattice, const NodeBox& within, const SurfaceSet& surface, const Images& images,
                      const PlaceViews& places, const BandViews& band) {
  const SurfaceSet s = surface;
  const auto key = band.key;
  Kokkos::parallel_for(
      "corpuscle::immersed::mark_band", Policy(0, s.triangles * images.count), KOKKOS_LAMBDA(int item) {
        const int t = item % s.triangles, m = item / s.triangles;
        const TriangleBox around = triangle_box(s, places, t, m);
        if (!around.found) return;
        const Corners k = corners(s, t, images.shift[m]);
        const Vec3 area_normal = cross(k.b - k.a, k.c - k.a);
        const double twice_area = norm(area_normal);
        if (!(twice_area > 0)) return;
        const Vec3 unit = area_normal * (1 / twice_area), centre = (k.a + k.b + k.c) * (1.0 / 3);
        const double ra = dot(k.a - centre, k.a - centre), rb = dot(k.b - centre, k.b - centre), rc = dot(k.c - centre, k.c - centre);
        const double radius = std::sqrt(ra > rb ? (ra > rc ? ra : rc) : (rb > rc ? rb : rc));
        const double width = around.width;
        const Key farthest = pack_key(width, 0);
        constexpr double rounding = 1 + 1e-6, round_off = 1e-12;  // of single precision in a key; of double, and room
        const NodeBox box = around.nodes(within, around.pad);
        for (int kk = box.lower[2]; kk <= box.upper[2]; ++kk) {
          for (int j = box.lower[1]; j <= box.upper[1]; ++j) {
            for (int i = box.lower[0]; i <= box.upper[0]; ++i) {
              const int c = lattice.node(i, j, kk);
              const Vec3 p = lattice.position(c), from_centre = p - centre;
              // Most triangles are told by simple bounds that a closer one has been there, or that the node is too far.
              const Key held = key(c);
              const double most = held < farthest ? rounding * key_value(held) : width, nearby = radius + most;
              const double above = dot(from_centre, unit), square = dot(from_centre, from_centre);
              if (std::fabs(above) > most || square > nearby * nearby) continue;
              const double beside = square - above * above;  // of the circle around the triangle, in its plane
              if (beside > radius * radius) {
                const double gap = std::sqrt(beside) - radius, reach = most + round_off * radius;
                if (gap * gap + above * above > reach * reach) continue;
              }
              const Key mine = offer(p, k, item);
              if (mine < farthest && mine < key(c)) Kokkos::atomic_fetch_min(&key(c), mine);
            }
          }
        }
      });
}

/// Sets the bit of every grid link between nodes of `within` that meets a triangle, and makes sure that both its ends belong
/// to the band.
inline void mark_cut_links(const Lattice& lattice, const NodeBox& within, const SurfaceSet& surface, const Images& images,
                           const PlaceViews& places, const BandViews& band) {
  const SurfaceSet s = surface;
  const auto key = band.key;
  const auto cut = band.cut;
  Kokkos::parallel_for(
      "corpuscle::immersed::mark_cut_links", Policy(0, s.triangles * images.count), KOKKOS_LAMBDA(int item) {
        const int t = item % s.triangles, m = item / s.triangles;
        const TriangleBox around = triangle_box(s, places, t, m);
        if (!around.found) return;
        const Corners k = corners(s, t, images.shift[m]);
        const Vec3 area_normal = cross(k.b - k.a, k.c - k.a);
        const double flat = 1e-12 * norm(area_normal);
        for (int d = 0; d < 3; ++d) {
          // A triangle is flat in space, not in index space: half a node covers its bend.
          double wide[3] = {0.5, 0.5, 0.5};
          wide[d] = 1.5;
          const NodeBox box = around.nodes(within, wide);
          const int links[3] = {box.extent(0) - (d == 0), box.extent(1) - (d == 1), box.extent(2) - (d == 2)};
          for (int kk = 0; kk < links[2]; ++kk) {
            for (int j = 0; j < links[1]; ++j) {
              for (int i = 0; i < links[0]; ++i) {
                const int c = lattice.node(box.lower[0] + i, box.lower[1] + j, box.lower[2] + kk);
                const int e = c + lattice.index.stride(d);
                const Vec3 p = lattice.position(c), q = lattice.position(e);
                // Most links lie on one side: told with a margin no smaller than the full test's.
                const double sp = dot(p - k.a, area_normal), sq = dot(q - k.a, area_normal);
                const double margin = flat * (std::fabs(q.x - p.x) + std::fabs(q.y - p.y) + std::fabs(q.z - p.z));
                if ((sp > margin && sq > margin) || (sp < -margin && sq < -margin)) continue;
                if (!segment_meets_triangle(p, q, k.a, k.b, k.c, area_normal)) continue;
                Kokkos::atomic_fetch_or(&cut(c), 1 << d);
                Kokkos::atomic_fetch_min(&key(c), offer(p, k, item));
                Kokkos::atomic_fetch_min(&key(e), offer(q, k, item));
              }
            }
          }
        }
      });
}

/// The nodes that a rank marks itself where ranks exchange what they have marked: its own and, of the halo, those that no
/// exchange fills, beside a physical boundary.
inline NodeBox marked_nodes(const Lattice& lattice) {
  NodeBox own;
  bool bounded = false;
  for (int d = 2; d >= 0; --d) {
    own.lower[d] = lattice.boundary_below[d] || bounded ? lattice.lower[d] : 0;
    own.upper[d] = lattice.boundary_above[d] || bounded ? lattice.upper[d] : lattice.index.n[d] - 1;
    bounded = bounded || lattice.boundary_below[d] || lattice.boundary_above[d];
  }
  return own;
}

/// What was marked beyond a periodic side names the images that are seen there: those that are seen from here instead.
inline void turn_images(const Lattice& lattice, int triangles, const Array<Key>& key) {
  const IndexSpace index = lattice.index;
  const auto keys = key;
  const bool low1 = lattice.boundary_below[1], high1 = lattice.boundary_above[1];
  const bool low2 = lattice.boundary_below[2], high2 = lattice.boundary_above[2];
  const std::array<int, 3> lower{lattice.lower[0], lattice.lower[1], lattice.lower[2]},
      upper{lattice.upper[0] + 1, lattice.upper[1] + 1, lattice.upper[2] + 1};
  for_box(
      "corpuscle::immersed::turn_images", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), at[3] = {i, j, k};
        if (keys(c) == no_key || index.owns(i, j, k)) return;
        const unsigned item = key_item(keys(c)), all = static_cast<unsigned>(triangles);
        const bool beside1 = (low1 && j < 0) || (high1 && j >= index.n[1]), beside2 = (low2 && k < 0) || (high2 && k >= index.n[2]);
        int image = static_cast<int>(item / all), place = 1;
        for (int d = 0; d < 3; ++d) {
          if (!index.periodic[d]) continue;
          const int global = index.first[d] + at[d], turn = global < 0 ? -1 : (global >= index.global[d] ? 1 : 0);
          const bool marked_here = (d < 1 && beside1) || (d < 2 && beside2);
          const int digit = image / place % 3, step = (digit + 1) % 3 - 1 + (marked_here ? 0 : turn);
          if (step < -1 || step > 1) {
            keys(c) = no_key;
            return;
          }
          image += ((step + 3) % 3 - digit) * place;
          place *= 3;
        }
        keys(c) = (keys(c) >> 32 << 32) | (static_cast<unsigned>(image) * all + item % all);
      });
}

/// Closest surface point and signed distance of a node whose closest item is known.
KOKKOS_INLINE_FUNCTION double signed_foot(const SurfaceSet& s, const PseudoNormals& normals, const Images& images, const Vec3& p,
                                          unsigned item, Vec3& foot) {
  const int t = static_cast<int>(item % static_cast<unsigned>(s.triangles));
  const Corners k = corners(s, t, images.shift[item / static_cast<unsigned>(s.triangles)]);
  const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
  foot = at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c;
  const Vec3 r = p - foot;
  return dot(r, pseudo_normal(s, normals, t, at.feature)) < 0 ? -norm(r) : norm(r);
}

/// Exact closest points and signs for the nodes of the band.
inline void measure_band(const Lattice& lattice, const NodeBox& box, const SurfaceSet& surface, const Images& images,
                         const PseudoNormals& normals, const BandViews& band) {
  const SurfaceSet s = surface;
  const BandViews b = band;
  for_box(
      "corpuscle::immersed::measure_band", {box.lower[0], box.lower[1], box.lower[2]},
      {box.upper[0] + 1, box.upper[1] + 1, box.upper[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = lattice.node(i, j, k);
        if (b.key(c) == no_key) return;
        Vec3 foot;
        b.distance(c) = signed_foot(s, normals, images, lattice.position(c), key_item(b.key(c)), foot);
        store(b.foot, c, foot);
      });
}

}  // namespace corpuscle
