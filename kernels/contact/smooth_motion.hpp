// What all surfaces do together: velocities as a smooth function of where they are.
#pragma once

#include "common/sums.hpp"
#include "immersed/surface_views.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// A velocity that is a polynomial of second order in position, as in a tube or between walls.
struct SmoothMotion {
  static constexpr int terms = 10;
  Vec3 middle;
  double over_size = 0;  // 1/um: positions are at most about 1 away from the middle with it
  Vec3 share[terms];     // um/us

  KOKKOS_INLINE_FUNCTION void evaluate(const Vec3& x, double (&term)[terms]) const {
    const Vec3 r = over_size * (x - middle);
    const double all[terms] = {1, r.x, r.y, r.z, r.x * r.x, r.y * r.y, r.z * r.z, r.x * r.y, r.y * r.z, r.z * r.x};
    for (int a = 0; a < terms; ++a) term[a] = all[a];
  }
  KOKKOS_INLINE_FUNCTION Vec3 operator()(const Vec3& x) const {
    double term[terms];
    evaluate(x, term);
    Vec3 velocity;
    for (int a = 0; a < terms; ++a) velocity += term[a] * share[a];
    return velocity;
  }
};

/// Since lists were made.
struct MotionSince {
  SmoothMotion motion;  // from where the lists were made
  double time = 0;      // us, that it has gone on for, about

  KOKKOS_INLINE_FUNCTION Vec3 velocity(const Vec3& from) const { return motion(from); }
  KOKKOS_INLINE_FUNCTION Vec3 way(const Vec3& from) const { return time * motion(from); }
};

/// Products of the terms with each other, row by row of the upper half, and behind them with the velocities.
using MotionProducts = Sums<SmoothMotion::terms*(SmoothMotion::terms + 1) / 2 + 3 * SmoothMotion::terms>;

/// Over every so manieth vertex. @param motion  its middle and size
inline MotionProducts motion_products(const SurfaceSet& surface, const SmoothMotion& motion, int every) {
  const SurfaceSet s = surface;
  const SmoothMotion m = motion;
  MotionProducts products;
  Kokkos::parallel_reduce(
      "corpuscle::contact::motion_products", Policy(0, (s.vertices + every - 1) / every),
      KOKKOS_LAMBDA(int n, MotionProducts& sum) {
        double term[SmoothMotion::terms];
        m.evaluate(load(s.x, n * every), term);
        const Vec3 velocity = load(s.v, n * every);
        int at = 0;
        for (int a = 0; a < SmoothMotion::terms; ++a)
          for (int b = a; b < SmoothMotion::terms; ++b) sum[at++] += term[a] * term[b];
        for (int a = 0; a < SmoothMotion::terms; ++a)
          for (int d = 0; d < 3; ++d) sum[at++] += term[a] * velocity[d];
      },
      products);
  return products;
}

}  // namespace corpuscle
