// The nearest point of every body that is near a vertex, with the sign of the gap.
#pragma once

#include "common/extremes.hpp"
#include "contact/contact_lists.hpp"

namespace corpuscle {

/// Unit normal, and how far it is to be relied on: all the way for triangles of some height and those of rigid bodies, not at all for those
/// of membranes whose corners lie nearly on a line, which may well look inward.
struct FaceNormal {
  Vec3 unit;
  double trust;

  KOKKOS_INLINE_FUNCTION FaceNormal(const SurfaceSet& s, int t) {
    constexpr double none = 0.1, all = 0.3;  // of 4 sqrt(3) area over the sum of the squared sides: 1 where they are equal
    const Corners k = corners(s, t, {});
    const Vec3 b = k.b - k.a, c = k.c - k.a, n = cross(b, c);
    const double length = norm(n), squares = dot(b, b) + dot(c, c) + dot(c - b, c - b);
    const double share = ((length > 0 ? 2 * 1.7320508075688772 * length / squares : 0) - none) / (all - none);
    unit = (length > 0 ? 1 / length : 0) * n;
    trust = s.triangle_body(t) >= s.cells || share >= 1 ? 1 : (share <= 0 ? 0 : share);
  }
};

/// Of a triangle, or in so far as it is nearly flat of its neighbours, between which it is hardly there.
KOKKOS_INLINE_FUNCTION Vec3 unit_normal(const SurfaceSet& s, int t) {
  const FaceNormal own(s, t);
  if (own.trust == 1) return own.unit;
  Vec3 sum = own.trust * own.unit;
  for (int k = 0; k < 3; ++k) {
    const FaceNormal other(s, s.neighbour(t, k));
    sum += ((1 - own.trust) * other.trust) * other.unit;
  }
  const double length = norm(sum);
  return length > 0 ? (1 / length) * sum : own.unit;
}

/// Outward at a point of triangle t: has the right sign for any point whose closest surface point it is (Baerentzen &
/// Aanaes, IEEE Trans. Vis. Comput. Graph. 11, 2005), with the normals of unit_normal().
KOKKOS_INLINE_FUNCTION Vec3 outward_at(const SurfaceSet& s, int t, int feature) {
  if (feature == 0) return unit_normal(s, t);
  if (feature <= 3) return unit_normal(s, t) + unit_normal(s, s.neighbour(t, feature - 1));
  const int v = s.triangle(t, feature - 4);
  Vec3 sum;
  for (int r = s.ring_start(v); r < s.ring_start(v + 1); ++r) {
    const int ring = s.ring_triangle(r), corner = s.ring_corner(r);
    const Vec3 at = load(s.x, v), p = load(s.x, s.triangle(ring, (corner + 1) % 3)) - at,
               q = load(s.x, s.triangle(ring, (corner + 2) % 3)) - at;
    sum += std::atan2(norm(cross(p, q)), dot(p, q)) * unit_normal(s, ring);
  }
  return sum;
}

/// How often a body's surface goes round a point: once inside, never outside, whatever folds there are nearby (solid angles: van Oosterom &
/// Strackee, IEEE Trans. Biomed. Eng. 30, 1983). Looks at all of its triangles.
KOKKOS_INLINE_FUNCTION double winding_around(const SurfaceSet& s, int body, const Vec3& p) {
  double angle = 0;
  for (int t = s.first_triangle(body); t < s.first_triangle(body + 1); ++t) {
    const Corners k = corners(s, t, {});
    const Vec3 a = k.a - p, b = k.b - p, c = k.c - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    angle += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return angle / (2 * 3.14159265358979323846);
}

/// Nearest so far among a group.
struct Nearest {
  double square = 1e300;  // of the distance, um2
  int item = -1;
  TrianglePoint at{};
};

/// Stores a group's nearest point: of another body's the gap is positive outside, of the own one everywhere.
KOKKOS_INLINE_FUNCTION void store_contact(const SurfaceSet& s, const Vec3& p, bool own, const Nearest& best, const ContactViews& c, int g) {
  const int t = item_triangle(s, best.item);
  const Corners k = corners(s, t, {});
  const Vec3 away = p - (best.at.weight[0] * k.a + best.at.weight[1] * k.b + best.at.weight[2] * k.c);
  const double distance = norm(away);
  const Vec3 outward = outward_at(s, t, best.at.feature);
  // Where a triangle has turned over, what is in front of it looks as if it were behind: all triangles are asked before another body's
  // inside is believed.
  const bool inside = dot(away, outward) < 0 && (own || winding_around(s, s.triangle_body(t), p) > 0.5);
  // On the surface itself the direction is the surface's.
  const double length = norm(outward);
  const Vec3 along = distance > 1e-9 ? (1 / distance) * away : (length > 0 ? (inside ? -1.0 : 1.0) / length : 0.0) * outward;
  const double sign = inside && !own ? -1 : 1;
  c.item(g) = best.item;
  c.gap(g) = sign * distance;
  for (int d = 0; d < 3; ++d) {
    c.weight(g, d) = best.at.weight[d];
    c.normal(g, d) = sign * along[d];
  }
}

/// Fills item, gap, weight and normal of the contacts, at the surfaces' present positions, for groups within reach
/// (without the skin). What is found does not depend on what else is in the lists.
/// @param spheres  of the present positions
/// @param before   [group] items found with these lists before, or -1: what is nearest is seldom farther than they are
inline void find_contacts(const SurfaceSet& surface, const Images& image_shifts, const ContactReach& far, const TriangleSpheres& spheres,
                          const Array<int>& before, const ContactLists& lists, const ContactViews& contacts) {
  const SurfaceSet s = surface;
  const Images images = image_shifts;
  const ContactReach reach = far;
  const TriangleSpheres around = spheres;
  const Array<int> last_item = before;
  const ContactLists in = lists;
  const ContactViews out = contacts;
  Kokkos::parallel_for(
      "corpuscle::contact::find_contacts", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        const Vec3 here = load(s.x, v);
        const int last = in.first_group(v + 1);
        for (int next = in.first_group(v); next < last;) {
          const int group = next, first = in.first_item(group), image = item_image(s, first);
          const Vec3 p = here + images.shift[image];
          const bool own = same_body(s, v, first);
          const double most = own ? reach.own : reach.other;
          double distance = most;  // no triangle that is farther is the nearest
          if (last_item(group) >= 0) {
            const double farthest = around.farthest(item_triangle(s, last_item(group)), p);
            distance = farthest < most ? farthest : most;
          }
          Nearest best;
          best.square = most * most;
          for (; next < last && (next == group || same_group(s, first, in.first_item(next))); ++next) {
            out.item(next) = -1;
            for (int e = in.first(next); e < in.first(next + 1); ++e) {
              const int t = in.item(next, e) - image * s.triangles;
              if (!around.may_reach(t, p, distance)) continue;
              const Corners k = corners(s, t, {});
              const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
              const Vec3 r = p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c);
              const double square = dot(r, r);
              if (!(square < best.square)) continue;
              best = {square, in.item(next, e), at};
              const double found = std::sqrt(square);
              distance = found < distance ? found : distance;
            }
          }
          if (best.item >= 0) store_contact(s, p, own, best, out, group);
        }
      });
}

/// gap [vertex] to the nearest other body, um; `none` where there is none within reach.
inline void gaps_to_others(const SurfaceSet& surface, const ContactLists& lists, const ContactViews& contacts, double none,
                           const Array<double>& gap) {
  const SurfaceSet s = surface;
  const ContactLists in = lists;
  const ContactViews c = contacts;
  Kokkos::parallel_for(
      "corpuscle::contact::gaps", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        double least = none;
        for (int g = in.first_group(v); g < in.first_group(v + 1); ++g)
          if (c.item(g) >= 0 && !same_body(s, v, c.item(g)) && c.gap(g) < least) least = c.gap(g);
        gap(v) = least;
      });
}

/// Between what a gap is: within one body, between two membranes, or between a membrane and a rigid body.
enum class GapWithin { body, membranes, bodies };

/// um, the least of all vertices; 1e30 where nothing is within reach.
inline double least_gap(GapWithin within, const SurfaceSet& surface, const ContactLists& lists, const ContactViews& contacts) {
  const SurfaceSet s = surface;
  const ContactLists in = lists;
  const ContactViews c = contacts;
  double least = 1e30;
  Kokkos::parallel_reduce(
      "corpuscle::contact::least_gap_within", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, double& sum) {
        for (int g = in.first_group(v); g < in.first_group(v + 1); ++g) {
          if (c.item(g) < 0) continue;
          const bool rigid = s.vertex_body(v) >= s.cells || s.triangle_body(item_triangle(s, c.item(g))) >= s.cells;
          const GapWithin what = same_body(s, v, c.item(g)) ? GapWithin::body : rigid ? GapWithin::bodies : GapWithin::membranes;
          if (what == within) sum = smaller(sum, c.gap(g));
        }
      },
      Smallest(least));
  return least;
}

/// Of the first `vertices`.
inline double least_of(int vertices, const Array<double>& gap) {
  double least = 1e30;
  Kokkos::parallel_reduce(
      "corpuscle::contact::least_gap", Policy(0, vertices), KOKKOS_LAMBDA(int v, double& sum) { sum = smaller(sum, gap(v)); },
      Smallest(least));
  return least;
}

}  // namespace corpuscle
