// Triangles sorted by the cubic bin that their centre is in.
#pragma once

#include "common/counting_sort.hpp"
#include "common/joined.hpp"
#include "contact/triangle_spheres.hpp"

namespace corpuscle {

/// Bounds of the triangles' centres, and the largest distance from a centre to a corner. Sums join.
struct TriangleBounds : Joined<TriangleBounds> {
  double lower[3] = {1e300, 1e300, 1e300}, upper[3] = {-1e300, -1e300, -1e300}, radius = 0;

  template <class Other>
  KOKKOS_INLINE_FUNCTION void join(const Other& b) volatile {
    for (int d = 0; d < 3; ++d) {
      if (b.lower[d] < lower[d]) lower[d] = b.lower[d];
      if (b.upper[d] > upper[d]) upper[d] = b.upper[d];
    }
    if (b.radius > radius) radius = b.radius;
  }
};

struct TriangleBins {
  static constexpr int around = 2;  // bins to either side, in which all is that is near
  int n[3] = {1, 1, 1};
  double lower[3] = {0, 0, 0}, width = 1;  // um
  Array<int> start;                        // [bin + 1] first of `order` in each bin
  Array<int> order;                        // [triangle] in each bin in the order of their numbers

  KOKKOS_INLINE_FUNCTION int count() const { return n[0] * n[1] * n[2]; }
  /// Bin along d, which may be outside.
  KOKKOS_INLINE_FUNCTION int along(int d, double x) const {
    const double t = std::floor((x - lower[d]) / width), least = -1 - around, most = n[d] + around;
    return static_cast<int>(t > least ? (t < most ? t : most) : least);  // what is no number as well
  }
  KOKKOS_INLINE_FUNCTION int bin(int i, int j, int k) const { return i + n[0] * (j + n[1] * k); }
  KOKKOS_INLINE_FUNCTION int bin_of(const Vec3& p) const {
    int at[3];
    for (int d = 0; d < 3; ++d) {
      at[d] = along(d, p[d]);
      at[d] = at[d] < 0 ? 0 : (at[d] > n[d] - 1 ? n[d] - 1 : at[d]);
    }
    return bin(at[0], at[1], at[2]);
  }
};

inline TriangleBounds bounds_of_triangles(const SurfaceSet& surface) {
  const SurfaceSet s = surface;
  TriangleBounds bounds;
  Kokkos::parallel_reduce(
      "corpuscle::contact::bounds", Policy(0, s.triangles),
      KOKKOS_LAMBDA(int t, TriangleBounds& sum) {
        const Corners k = corners(s, t, {});
        const Vec3 centre = centre_of(k);
        TriangleBounds own;
        const double a = norm(k.a - centre), b = norm(k.b - centre), c = norm(k.c - centre);
        own.radius = a > b ? (a > c ? a : c) : (b > c ? b : c);
        for (int d = 0; d < 3; ++d) own.lower[d] = own.upper[d] = centre[d];
        sum += own;
      },
      bounds);
  return bounds;
}

/// Fills start and order.
inline void sort_triangles(const SurfaceSet& surface, const TriangleBins& bins) {
  const SurfaceSet s = surface;
  const TriangleBins b = bins;
  counting_sort(
      "corpuscle::contact::sort_triangles", s.triangles, b.count(), KOKKOS_LAMBDA(int t) { return b.bin_of(centre_of(corners(s, t, {}))); },
      b.start, b.order);
}

}  // namespace corpuscle
