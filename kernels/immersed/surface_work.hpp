// Work that a flow does on immersed surfaces.
#pragma once

#include "immersed/surface_stress.hpp"

namespace corpuscle {

/// Power of the fluid's forces on vertices first <= i < last, all those of some bodies, nW.
inline double fluid_power(const SurfaceSet& surface, const SurfaceStress& stress, int first, int last) {
  const SurfaceSet s = surface;
  const SurfaceStress t = stress;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::surface::fluid_power", Policy(first, last),
      KOKKOS_LAMBDA(int i, double& sum) { sum += dot(fluid_force(s, t, i), load(s.v, i)); }, power);
  return power;
}

/// Integral over all surfaces of u . (grad u) n with n outward, um3/us2, for a flow without divergence that moves with
/// them: v . (grad_s v) n - (v . n) div_s v. Minus this is by how much the integral of 2 D : D, the dissipation over mu,
/// exceeds that of |grad u|^2 in the fluid around.
inline double surface_gradient_work(const SurfaceSet& set) {
  const SurfaceSet s = set;
  const auto x = set.x, v = set.v;
  double work = 0;
  Kokkos::parallel_reduce(
      "corpuscle::surface::gradient_work", Policy(0, set.triangles),
      KOKKOS_LAMBDA(int t, double& sum) {
        const Vec3 a = area_vector(s, t);
        const double area = norm(a);
        if (!(area > 0)) return;
        const Vec3 n = a * (1 / area);
        const Vec3 corner[3] = {load(v, s.triangle(t, 0)), load(v, s.triangle(t, 1)), load(v, s.triangle(t, 2))};
        const Vec3 mean = (1.0 / 3) * (corner[0] + corner[1] + corner[2]);
        double along = 0, divergence = 0;
        for (int k = 0; k < 3; ++k) {
          const Vec3 side = load(x, s.triangle(t, (k + 2) % 3)) - load(x, s.triangle(t, (k + 1) % 3));
          const Vec3 gradient = (0.5 / area) * cross(n, side);  // of the linear function that is one at corner k
          along += dot(mean, gradient) * dot(corner[k], n);
          divergence += dot(corner[k], gradient);
        }
        sum += area * (along - dot(mean, n) * divergence);
      },
      work);
  return work;
}

/// Volume of all bodies together, um3.
inline double enclosed_volume(const SurfaceSet& set) {
  const SurfaceSet s = set;
  const auto x = set.x;
  const auto triangle_body = set.triangle_body, first_vertex = set.first_vertex;
  double volume = 0;
  Kokkos::parallel_reduce(
      "corpuscle::surface::enclosed_volume", Policy(0, set.triangles),
      KOKKOS_LAMBDA(int t, double& sum) {
        const Vec3 origin = load(x, first_vertex(triangle_body(t)));
        sum += dot(load(x, s.triangle(t, 0)) - origin, area_vector(s, t)) / 3;
      },
      volume);
  return volume;
}

}  // namespace corpuscle
