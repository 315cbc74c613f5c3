// Distances to and intersections with one triangle.
#pragma once

#include "common/vec3.hpp"

namespace corpuscle {

/// Closest point of a triangle: barycentric weights of its corners, and where it lies.
struct TrianglePoint {
  double weight[3];
  int feature;  // 0: face; 1, 2, 3: the edge opposite corner 0, 1, 2; 4, 5, 6: corner 0, 1, 2
};

/// Closest point of triangle a, b, c to p (C. Ericson, Real-Time Collision Detection, section 5.1.5).
KOKKOS_INLINE_FUNCTION TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {{1, 0, 0}, 4};
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {{0, 1, 0}, 5};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double v = d1 / (d1 - d3);
    return {{1 - v, v, 0}, 3};
  }
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {{0, 0, 1}, 6};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double w = d2 / (d2 - d6);
    return {{1 - w, 0, w}, 2};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {{0, 1 - w, w}, 1};
  }
  const double scale = 1 / (va + vb + vc);
  return {{va * scale, vb * scale, vc * scale}, 0};
}

/// Whether segment p, q meets triangle a, b, c. Touching counts, with a margin of round-off, so that a segment through
/// a shared edge is never missed by both triangles.
KOKKOS_INLINE_FUNCTION bool segment_meets_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c,
                                                   const Vec3& area_normal) {
  const double sp = dot(p - a, area_normal), sq = dot(q - a, area_normal);
  const Vec3 d = q - p;
  const double length = norm(d), twice_area = norm(area_normal);
  const double flat = 1e-12 * twice_area * length;
  if ((sp > flat && sq > flat) || (sp < -flat && sq < -flat)) return false;
  const Vec3 pa = a - p, pb = b - p, pc = c - p;
  const double u = dot(d, cross(pb, pc)), v = dot(d, cross(pc, pa)), w = dot(d, cross(pa, pb));
  const double margin = 1e-10 * length * twice_area;
  if (std::fabs(u + v + w) < margin) return false;  // segment in the plane: its ends' other links tell
  return (u > -margin && v > -margin && w > -margin) || (u < margin && v < margin && w < margin);
}

}  // namespace corpuscle
