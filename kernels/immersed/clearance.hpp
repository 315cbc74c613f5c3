// Whether surfaces cross, and how near different bodies come to each other.
#pragma once

#include "immersed/triangle.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// How many links from an outside node lead inside without being cut by a triangle. Only where surfaces cross, each other
/// or themselves: there the side of the closest triangle is not the node's.
KOKKOS_INLINE_FUNCTION int crossed_links(const Lattice& lattice, const BandViews& band, const Array<NodeKind>& kind, int c) {
  constexpr double rounding = 1e-6;  // in links: a node on a surface has no side
  int found = 0;
  for (int side = 0; side < 6; ++side) {
    const int d = side / 2, stride = lattice.index.stride(d), other = side % 2 == 0 ? c - stride : c + stride;
    if (kind(other) != NodeKind::inside || (band.cut(side % 2 == 0 ? other : c) & (1 << d))) continue;
    const double least = rounding * norm(lattice.position(other) - lattice.position(c));
    if (band.distance(c) < least || (band.key(other) != no_key && band.distance(other) > -least)) continue;
    ++found;
  }
  return found;
}

/// Distance of a point to an item of the search, in grid spacings at node i.
KOKKOS_INLINE_FUNCTION double spacings_to_item(const Lattice& lattice, const int (&i)[3], const SurfaceSet& s, const Images& images,
                                               const Vec3& from, int item) {
  const Corners k = corners(s, item % s.triangles, images.shift[item / s.triangles]);
  const TrianglePoint at = closest_on_triangle(from, k.a, k.b, k.c);
  const Vec3 r = at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c - from;
  Vec3 tangent[3], row[3];
  lattice.node_tangents(i, tangent);
  inverse_rows(tangent, row);
  return norm(Vec3{dot(row[0], r), dot(row[1], r), dot(row[2], r)});
}

/// The least gap between two bodies, or a body and its own or another's image, in spacings, and the owned node beside it,
/// packed into found(0). Seen at the links whose ends are closest to different bodies: every gap of up to one spacing has
/// such links, wider ones may have none in the band.
inline void find_least_gap(const Lattice& lattice, const NodeBox& box, const SurfaceSet& surface, const Images& images,
                           const BandViews& band, const Array<Key>& found) {
  const SurfaceSet s = surface;
  const BandViews b = band;
  Kokkos::deep_copy(Exec(), found, no_key);
  Kokkos::parallel_for(
      "corpuscle::immersed::least_gap", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        if (b.key(c) == no_key || !lattice.index.owns(i[0], i[1], i[2])) return;
        const int mine = static_cast<int>(key_item(b.key(c)));
        for (int d = 0; d < 3; ++d) {
          const int other = c + lattice.index.stride(d);
          if (b.key(other) == no_key) continue;
          const int its = static_cast<int>(key_item(b.key(other)));
          const bool same_image = mine / s.triangles == its / s.triangles;
          if (same_image && key_body(s.triangle_body, b.key(c)) == key_body(s.triangle_body, b.key(other))) continue;
          const double there = spacings_to_item(lattice, i, s, images, load(b.foot, c), its);
          const double back = spacings_to_item(lattice, i, s, images, load(b.foot, other), mine);
          Kokkos::atomic_fetch_min(&found(0), pack_key(there < back ? there : back, static_cast<unsigned>(c)));
        }
      });
}

}  // namespace corpuscle
