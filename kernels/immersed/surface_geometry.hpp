// Normals and areas of the immersed surfaces, from the positions of their vertices.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Half the cross product of two sides: the triangle's area along its normal, um2.
KOKKOS_INLINE_FUNCTION Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) {
  return 0.5 * cross(b - a, c - a);
}

template <class Triangles, class Positions>
KOKKOS_INLINE_FUNCTION Vec3 area_vector(const Triangles& triangle, const Positions& x, int t) {
  return area_vector(load(x, triangle(t, 0)), load(x, triangle(t, 1)), load(x, triangle(t, 2)));
}

/// Refresh set.normal and set.area from set.x, for all bodies.
inline void update_surface_geometry(const SurfaceSet& set) {
  const auto x = set.x, normal = set.normal;
  const auto area = set.area;
  const auto triangle = set.triangle;
  const auto ring_start = set.ring_start, ring_triangle = set.ring_triangle;
  Kokkos::parallel_for(
      "corpuscle::surface::surface_geometry", Policy(0, set.vertices), KOKKOS_LAMBDA(int i) {
        Vec3 sum;
        double ring_area = 0;
        for (int r = ring_start(i); r < ring_start(i + 1); ++r) {
          const Vec3 a = area_vector(triangle, x, ring_triangle(r));
          sum += a;
          ring_area += norm(a);
        }
        const double length = norm(sum);
        store(normal, i, length > 0 ? sum * (1 / length) : sum);
        area(i) = ring_area / 3;
      });
}

}  // namespace corpuscle
