// Which triangles may touch which vertices, found through bins.
#pragma once

#include <cstdint>

#include <string>

#include "common/summing.hpp"
#include "contact/contact_views.hpp"
#include "contact/triangle_bins.hpp"
#include "immersed/triangle.hpp"

namespace corpuscle {

KOKKOS_INLINE_FUNCTION double distance_to(const Vec3& p, const Corners& k) {
  const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
  return norm(p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c));
}

/// Whether a triangle has a corner that is at most two edges away from a vertex: a sheet that buckles at the mesh's own
/// scale does not touch itself.
KOKKOS_INLINE_FUNCTION bool within_two_rings(const SurfaceSet& s, int v, int t) {
  const int a = s.triangle(t, 0), b = s.triangle(t, 1), c = s.triangle(t, 2);
  for (int r = s.ring_start(v); r < s.ring_start(v + 1); ++r) {
    const int u = s.triangle(s.ring_triangle(r), (s.ring_corner(r) + 1) % 3);
    for (int q = s.ring_start(u); q < s.ring_start(u + 1); ++q)
      for (int corner = 0; corner < 3; ++corner) {
        const int w = s.triangle(s.ring_triangle(q), corner);
        if (w == a || w == b || w == c) return true;
      }
  }
  return false;
}

/// Where the gaps of other ranks' vertices are asked for, um.
struct GapsWanted {
  static constexpr double far = 1e300;
  Vec3 lower{-far, -far, -far}, upper{far, far, far};

  bool everywhere() const { return upper.x == far; }

  KOKKOS_INLINE_FUNCTION bool at(const Vec3& p) const {
    for (int d = 0; d < 3; ++d)
      if (p[d] < lower[d] || p[d] > upper[d]) return false;
    return true;
  }
};

/// What the search of lists reads.
struct ContactSearch {
  SurfaceSet surface;
  Images images;
  TriangleBins bins;
  TriangleSpheres spheres;  // in the order of the bins
  ContactRest rest;
  ContactReach reach;  // with the skin
  GapsWanted wanted;

  /// Whether a triangle of vertex v's own body is far from it along the surface.
  KOKKOS_INLINE_FUNCTION bool is_apart(int v, int t) const {
    const SurfaceSet& s = surface;
    const Vec3 here = rest.at(s, v);
    Vec3 at[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = rest.at(s, s.triangle(t, k));
      const Vec3 way = at[k] - here;
      if (dot(way, way) < reach.apart * reach.apart) return false;  // nearly all, and cheap
    }
    return distance_to(here, {at[0], at[1], at[2]}) >= reach.apart && !within_two_rings(s, v, t);
  }

  /// Whether a triangle under an image, whose place is within the farthest reach, is one of vertex v's, which is at p.
  /// @param least  what meets copies alone is left to other ranks
  KOKKOS_INLINE_FUNCTION bool belongs(int v, const Vec3& p, int m, int place, bool least) const {
    const SurfaceSet& s = surface;
    const int t = bins.order(place), body = s.vertex_body(v), other = s.triangle_body(t);
    const bool own = m == 0 && body == other;
    if (!own && body >= s.cells && other >= s.cells) return false;
    if (own && body >= s.cells) return false;
    if (least && other >= s.own_cells) return false;
    const double far = own ? reach.own : reach.other;
    if (own && !(spheres.may_reach(place, p, far) && is_apart(v, t))) return false;
    return distance_to(p, corners(s, t, {})) <= far;
  }

  /// use(item) for all of vertex v's items, in no particular order.
  template <class Use>
  KOKKOS_INLINE_FUNCTION void visit(int v, const Use& use) const {
    const double farthest = reach.own > reach.other ? reach.own : reach.other;
    const Vec3 here = load(surface.x, v);
    const bool least = surface.vertex_body(v) >= surface.own_cells && !wanted.at(here);
    for (int m = 0; m < images.count; ++m) {
      const Vec3 p = here + images.shift[m];
      int low[3], high[3];
      bool near = true;
      for (int d = 0; d < 3 && near; ++d) {
        const int at = bins.along(d, p[d]);
        low[d] = at - bins.around < 0 ? 0 : at - bins.around;
        high[d] = at + bins.around > bins.n[d] - 1 ? bins.n[d] - 1 : at + bins.around;
        near = low[d] <= high[d];
      }
      if (!near) continue;
      for (int k = low[2]; k <= high[2]; ++k)
        for (int j = low[1]; j <= high[1]; ++j)
          for (int e = bins.start(bins.bin(low[0], j, k)); e < bins.start(bins.bin(high[0], j, k) + 1); ++e)
            if (spheres.may_reach(e, p, farthest) && belongs(v, p, m, e, least)) use(m * surface.triangles + bins.order(e));
    }
  }
};

/// From numbers to the first of each vertex, in place, over [vertex + 1]. @returns their sum; where it is beyond an int's largest
/// the firsts mean nothing
inline std::int64_t numbers_to_starts(const std::string& label, const Array<int>& numbers, int vertices) {
  const auto first = numbers;
  return running_sum<std::int64_t>(
      label, vertices + 1, KOKKOS_LAMBDA(int v, std::int64_t& sum, bool last) {
        const int own = v < vertices ? first(v) : 0;
        if (last) first(v) = static_cast<int>(sum);
        sum += own;
      });
}

/// What lists are made from.
struct ContactItems {
  Array<int> first;  // [vertex + 1] into `item`
  Array<int> item;   // [item] in order
};

/// items.first, and how many items there are.
inline std::int64_t count_items(const ContactSearch& search, const ContactItems& items) {
  const ContactSearch s = search;
  const auto first = items.first;
  const int vertices = s.surface.vertices;
  Kokkos::parallel_for(
      "corpuscle::contact::count_items", Policy(0, vertices), KOKKOS_LAMBDA(int v) {
        int count = 0;
        s.visit(v, [&](int) { ++count; });
        first(v) = count;
      });
  return numbers_to_starts("corpuscle::contact::first_items", first, vertices);
}

/// Whether an item belongs to the group that begins with `first`.
KOKKOS_INLINE_FUNCTION bool within_group(const SurfaceSet& s, int first, int item) {
  return item - first <= ContactLists::farthest && same_group(s, first, item);
}

/// items.item, in order, and how many groups each vertex has, in lists.first_group.
inline void fill_items(const ContactSearch& search, const ContactItems& items, const ContactLists& lists) {
  const ContactSearch s = search;
  const ContactItems out = items;
  const auto first_group = lists.first_group;
  Kokkos::parallel_for(
      "corpuscle::contact::fill_items", Policy(0, s.surface.vertices), KOKKOS_LAMBDA(int v) {
        const int begin = out.first(v);
        int end = begin;
        if (begin < out.first(v + 1))
          s.visit(v, [&](int item) {
            int to = end++;
            for (; to > begin && out.item(to - 1) > item; --to) out.item(to) = out.item(to - 1);
            out.item(to) = item;
          });
        int groups = 0;
        for (int e = begin, first = begin; e < end; ++e)
          if (e == begin || !within_group(s.surface, out.item(first), out.item(e))) first = e, ++groups;
        first_group(v) = groups;
      });
}

/// lists.first, first_item and beyond. After number_groups().
inline void pack_items(const SurfaceSet& surface, const ContactItems& items, const ContactLists& lists) {
  const SurfaceSet s = surface;
  const ContactItems in = items;
  const ContactLists out = lists;
  Kokkos::parallel_for(
      "corpuscle::contact::pack_items", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        const int end = in.first(v + 1);
        int group = out.first_group(v), first = -1;
        for (int e = in.first(v); e < end; ++e) {
          const int item = in.item(e);
          if (first < 0 || !within_group(s, first, item)) {
            first = item;
            out.first(group) = e;
            out.first_item(group++) = item;
          }
          out.beyond(e) = static_cast<std::uint16_t>(item - first);
        }
        if (v + 1 == s.vertices) out.first(group) = end;
      });
}

/// From numbers to first_group. @returns how many groups there are, of no more items than an int counts
inline int number_groups(const ContactLists& lists, int vertices) {
  return static_cast<int>(numbers_to_starts("corpuscle::contact::first_groups", lists.first_group, vertices));
}

}  // namespace corpuscle
