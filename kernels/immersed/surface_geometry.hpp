// Normals and areas of the immersed surfaces, from the positions of their vertices.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Half the cross product of two sides: the triangle's area along its normal, um2.
KOKKOS_INLINE_FUNCTION Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) { return 0.5 * cross(b - a, c - a); }

/// Of triangle t of a set.
KOKKOS_INLINE_FUNCTION Vec3 area_vector(const SurfaceSet& s, int t) {
  return area_vector(load(s.x, s.triangle(t, 0)), load(s.x, s.triangle(t, 1)), load(s.x, s.triangle(t, 2)));
}

/// Refresh normal and area from x, for all bodies.
inline void update_surface_geometry(const SurfaceSet& set) {
  const SurfaceSet s = set;
  Kokkos::parallel_for(
      "corpuscle::surface::surface_geometry", Policy(0, s.vertices), KOKKOS_LAMBDA(int i) {
        Vec3 sum;
        double ring_area = 0;
        for (int r = s.ring_start(i), end = s.ring_start(i + 1); r < end; ++r) {
          const Vec3 a = area_vector(s, s.ring_triangle(r));
          sum += a;
          ring_area += norm(a);
        }
        const double length = norm(sum);
        store(s.normal, i, length > 0 ? sum * (1 / length) : sum);
        s.area(i) = ring_area / 3;
      });
}

}  // namespace corpuscle
