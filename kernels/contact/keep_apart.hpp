// Gaps that must not close: a limit on how much of a gap one step may take away, and the way back for what has crossed.
#pragma once

#include "common/extremes.hpp"
#include "common/joined.hpp"
#include "contact/find_contacts.hpp"

namespace corpuscle {

/// What a correction of the contacts aims at.
struct GapGoal {
  double share = 0;        // of the gap as it was found; 0: only contacts that have crossed are looked at
  double least = 0;        // um, whatever it was
  double relax = 1;        // share of what is missing that is made up at once: several contacts push the same corner
  int cells_vertices = 0;  // vertices that can move
};

/// What the gaps of a move fall short of.
struct Shortfall : Joined<Shortfall> {
  double most = 0;      // over the goal itself
  int limited = 0;      // contacts below their goal
  int through = 0;      // of them, those whose vertex is on the wrong side
  int first = 1 << 30;  // the lowest of these

  template <class Other>
  KOKKOS_INLINE_FUNCTION void join(const Other& b) volatile {
    most = larger(most, b.most);
    limited = limited + b.limited;
    through = through + b.through;
    if (b.first < first) first = b.first;
  }
};

/// push: the way by which vertex and corners must move for the gap, along the normal as it was found, to be at least
/// the goal.
/// @param counted  this rank's own vertices, whose contacts count
inline Shortfall gap_corrections(const SurfaceSet& surface, const Images& image_shifts, const ContactLists& lists,
                                 const ContactViews& contacts, const GapGoal& gap_goal, double range, int counted,
                                 const Array<double>& push) {
  const SurfaceSet s = surface;
  const Images images = image_shifts;
  const GapGoal goal = gap_goal;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  const auto way = push;
  Shortfall all;
  Kokkos::parallel_reduce(
      "corpuscle::contact::gap_corrections", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, Shortfall& sum) {
        for (int g = first(v); g < first(v + 1); ++g) {
          way(g) = 0;
          if (c.item(g) < 0 || c.gap(g) >= range || (goal.share == 0 && c.gap(g) >= 0)) continue;
          const int t = item_triangle(s, c.item(g));
          const Corners k = corners(s, t, {});
          const Vec3 foot = c.weight(g, 0) * k.a + c.weight(g, 1) * k.b + c.weight(g, 2) * k.c;
          const double now = dot(load(s.x, v) + images.shift[item_image(s, c.item(g))] - foot, load(c.normal, g));
          const double kept = goal.share * c.gap(g), wanted = kept > goal.least ? kept : goal.least;
          if (now >= wanted) continue;
          double mobility = v < goal.cells_vertices ? 1 : 0;
          for (int d = 0; d < 3; ++d)
            if (s.triangle(t, d) < goal.cells_vertices) mobility += c.weight(g, d) * c.weight(g, d);
          way(g) = goal.relax * (wanted - now) / mobility;
          Shortfall own;
          own.most = (wanted - now) / wanted;
          const bool counting = counts(s, v, c.item(g), counted);
          if (counting) own.limited = 1;
          if (counting && now < 0) own.through = 1, own.first = g;
          sum += own;
        }
      },
      all);
  return all;
}

/// Whether two triangles share a vertex.
KOKKOS_INLINE_FUNCTION bool adjacent(const SurfaceSet& s, int t, int other) {
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (s.triangle(t, a) == s.triangle(other, b)) return true;
  return false;
}

/// Which feature of a triangle the point with these weights is, as of TrianglePoint.
KOKKOS_INLINE_FUNCTION int feature_of(const double (&weight)[3]) {
  int zeros = 0, zero = 0, full = 0;
  for (int k = 0; k < 3; ++k) {
    if (weight[k] == 0) ++zeros, zero = k;
    if (weight[k] != 0) full = k;
  }
  return zeros == 0 ? 0 : zeros == 1 ? 1 + zero : 4 + full;
}

/// Outward, of unit length, at the place where a contact's nearest point is: on an edge of a fold the triangles' own normals would call
/// one side of it the other.
KOKKOS_INLINE_FUNCTION Vec3 outward_of(const SurfaceSet& s, const ContactViews& c, int g, int t) {
  const double weight[3] = {c.weight(g, 0), c.weight(g, 1), c.weight(g, 2)};
  const Vec3 outward = outward_at(s, t, feature_of(weight));
  const double length = norm(outward);
  return (length > 0 ? 1 / length : 0) * outward;
}

struct CrossingCount : Joined<CrossingCount> {
  int vertices = 0;     // on the wrong side
  int first = 1 << 30;  // the lowest contact of them
  double deepest = 0;   // um

  template <class Other>
  KOKKOS_INLINE_FUNCTION void join(const Other& b) volatile {
    vertices = vertices + b.vertices;
    if (b.first < first) first = b.first;
    if (b.deepest > deepest) deepest = b.deepest;
  }
};

/// Contacts on the wrong side: inside another body, or beyond the own surface where the vertex was on the other side of
/// the same place when it was last looked at; those are turned round, so that their gap is negative as well.
/// @param side  [vertex] on which it saw its own body last, kept from call to call: triangle * 2 + 1 outside, triangle * 2 inside;
///              -1 where nothing was within reach
/// @param counted  this rank's own vertices, whose crossings count
inline CrossingCount find_crossings(const SurfaceSet& surface, const ContactLists& lists, const ContactViews& contacts,
                                    const Array<int>& side, int counted) {
  const SurfaceSet s = surface;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  CrossingCount count;
  Kokkos::parallel_reduce(
      "corpuscle::contact::find_crossings", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, CrossingCount& sum) {
        int seen = -1;
        for (int g = first(v); g < first(v + 1); ++g) {
          if (c.item(g) < 0) continue;
          if (same_body(s, v, c.item(g))) {
            const int t = c.item(g), last = side(v);
            const double across = dot(load(c.normal, g), outward_of(s, c, g, t));
            if (std::fabs(across) < 0.5) continue;  // beside the place rather than over it
            const bool outside = across > 0;
            seen = 2 * t + (outside ? 1 : 0);
            if (last >= 0 && outside != (last % 2 == 1) && adjacent(s, t, last / 2)) {
              seen = 2 * t + last % 2;
              c.gap(g) = -c.gap(g);
              for (int d = 0; d < 3; ++d) c.normal(g, d) = -c.normal(g, d);
            }
          }
          if (c.gap(g) < 0 && counts(s, v, c.item(g), counted)) {
            CrossingCount own;
            own.vertices = 1;
            own.first = g;
            own.deepest = -c.gap(g);
            sum += own;
          }
        }
        side(v) = seen;
      },
      count);
  return count;
}

}  // namespace corpuscle
