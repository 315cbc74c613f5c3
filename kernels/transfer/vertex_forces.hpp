// What forces on vertices amount to, [vertex, 3] over the first `count` vertices.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"

namespace corpuscle {

/// traction = factor force / area.
inline void force_per_area(int count, const Components<double>& force, const Array<double>& area, double factor,
                           const Components<double>& traction) {
  Kokkos::parallel_for(
      "corpuscle::transfer::force_per_area", Policy(0, count),
      KOKKOS_LAMBDA(int i) { store(traction, i, (factor / area(i)) * load(force, i)); });
}

/// Sum of force . velocity, nW.
inline double power_of(int count, const Components<double>& force, const Components<double>& velocity) {
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::power", Policy(0, count),
      KOKKOS_LAMBDA(int i, double& sum) { sum += dot(load(force, i), load(velocity, i)); }, power);
  return power;
}

}  // namespace corpuscle
