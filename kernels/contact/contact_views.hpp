// Arrays of the contacts between surfaces.
#pragma once

#include "immersed/views.hpp"

namespace corpuscle {

/// What contact knows of surfaces at rest.
struct ContactRest {
  Components<double> x;  // [vertex place, 3] um
  Array<double> area;    // [vertex place] um2: how much of its surface a vertex stands for

  KOKKOS_INLINE_FUNCTION Vec3 at(const SurfaceSet& s, int v) const { return load(x, s.vertex_place(v)); }
  KOKKOS_INLINE_FUNCTION double area_of(const SurfaceSet& s, int v) const { return area(s.vertex_place(v)); }
};

/// The triangles that are near each vertex, or may come near it before the lists are made anew. Items are triangles
/// under images: item = image * triangles + triangle; they rise along a vertex' list. A group are the items of one body
/// under one image, as far as 16 bits reach: those of larger bodies may make several groups, one behind the other.
struct ContactLists {
  static constexpr int farthest = 65535;  // in a group, from its first item
  int items = 0, groups = 0;
  Array<int> first_group;       // [vertex + 1] into the contacts
  Array<int> first;             // [group + 1] into `beyond`
  Array<int> first_item;        // [group] the lowest
  Array<std::uint16_t> beyond;  // [item] how far beyond that of its group

  KOKKOS_INLINE_FUNCTION int item(int group, int entry) const { return first_item(group) + beyond(entry); }
};

/// The nearest point of each group of a vertex, of several groups of the same body and image all in the first; where none is within
/// reach, item is -1.
struct ContactViews {
  Array<int> item;       // [group]
  Array<double> gap;     // [group] um; negative where the vertex is on the wrong side
  Table<double> weight;  // [group, 3] of the triangle's corners at the nearest point
  Table<double> normal;  // [group, 3] unit, from there to where the vertex belongs
};

/// What contacts do, while it is being done.
struct ContactPushes {
  Array<double> push;    // [group] along the normal on the vertex, against it on the corners: a force or a way
  Array<int> hit_start;  // [triangle + 1] contacts of each triangle, after sort_hits()
  Array<int> hit;        // [group]
};

/// How far to look, um.
struct ContactReach {
  double other = 0;  // from a vertex to other bodies
  double own = 0;    // to its own body
  double apart = 0;  // parts of a body that are nearer than this at rest, or within two rings, do not touch each other
};

KOKKOS_INLINE_FUNCTION int item_triangle(const SurfaceSet& s, int item) { return item % s.triangles; }
KOKKOS_INLINE_FUNCTION int item_image(const SurfaceSet& s, int item) { return item / s.triangles; }

/// A vertex and a triangle of one body, where it is and not an image of it.
KOKKOS_INLINE_FUNCTION bool same_body(const SurfaceSet& s, int vertex, int item) {
  return item_image(s, item) == 0 && s.vertex_body(vertex) == s.triangle_body(item_triangle(s, item));
}
/// Whether a contact counts where a rank's own are the first `own` vertices: those do, and of rigid bodies, which all ranks have, those
/// that meet them.
KOKKOS_INLINE_FUNCTION bool counts(const SurfaceSet& s, int vertex, int item, int own) {
  return vertex < own || (s.vertex_body(vertex) >= s.cells && s.triangle(item_triangle(s, item), 0) < own);
}
KOKKOS_INLINE_FUNCTION bool same_group(const SurfaceSet& s, int item, int other) {
  return item_image(s, item) == item_image(s, other) && s.triangle_body(item_triangle(s, item)) == s.triangle_body(item_triangle(s, other));
}

}  // namespace corpuscle
