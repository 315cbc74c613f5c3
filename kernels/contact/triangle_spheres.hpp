// Spheres around triangles: what is beyond them need not be asked more closely.
#pragma once

#include "immersed/views.hpp"

namespace corpuscle {

/// In single precision, and not smaller than the triangles for that: what does not meet a sphere does not meet its triangle.
struct TriangleSpheres {
  Table<float> sphere;  // [place, 4] um: centre and radius

  KOKKOS_INLINE_FUNCTION Vec3 centre(int place) const { return {sphere(place, 0), sphere(place, 1), sphere(place, 2)}; }
  /// Whether the triangle at a place may be nearer to p than `far`, um; so too where anything is not a number.
  KOKKOS_INLINE_FUNCTION bool may_reach(int place, const Vec3& p, double far) const {
    const Vec3 r = p - centre(place);
    const double most = far + sphere(place, 3);
    return !(dot(r, r) > most * most);
  }
  /// um, at least p's distance to it.
  KOKKOS_INLINE_FUNCTION double farthest(int place, const Vec3& p) const {
    constexpr double rounding = 1.2e-7;  // of a centre's coordinates; twice that of single precision
    const Vec3 c = centre(place);
    return norm(p - c) + rounding * (std::fabs(c[0]) + std::fabs(c[1]) + std::fabs(c[2]));
  }
};

KOKKOS_INLINE_FUNCTION Vec3 centre_of(const Corners& k) { return (1.0 / 3) * (k.a + k.b + k.c); }

/// Fills the spheres, at the surfaces' present positions.
/// @param order  [place] the triangle there; empty where each has its own
inline void enclose_triangles(const SurfaceSet& surface, const TriangleSpheres& spheres, const Array<int>& order = {}) {
  const SurfaceSet s = surface;
  const auto sphere = spheres.sphere;
  const auto triangle = order;
  Kokkos::parallel_for(
      "corpuscle::contact::enclose_triangles", Policy(0, s.triangles), KOKKOS_LAMBDA(int place) {
        constexpr double wider = 1 + 1e-6;  // several times what rounding takes off
        const Corners k = corners(s, triangle.extent(0) > 0 ? triangle(place) : place, {});
        const Vec3 centre = centre_of(k);
        for (int d = 0; d < 3; ++d) sphere(place, d) = static_cast<float>(centre[d]);
        const Vec3 rounded{sphere(place, 0), sphere(place, 1), sphere(place, 2)};
        const Vec3 a = k.a - rounded, b = k.b - rounded, c = k.c - rounded;
        const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
        sphere(place, 3) = static_cast<float>(wider * std::sqrt(aa > bb ? (aa > cc ? aa : cc) : (bb > cc ? bb : cc)));
      });
}

}  // namespace corpuscle
