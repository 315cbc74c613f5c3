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

/// load = force + each vertex' share of the push on its cell. @param share  [cell, 3] nN; without values none is pushed
inline void start_loads(int count, const Components<double>& force, const Array<int>& vertex_body, const Table<double>& share,
                        const Components<double>& load_on_fluid) {
  const bool pushed = share.extent(0) > 0;
  Kokkos::parallel_for(
      "corpuscle::transfer::start_loads", Policy(0, count), KOKKOS_LAMBDA(int i) {
        Vec3 sum = load(force, i);
        if (pushed) sum += load(share, vertex_body(i));
        store(load_on_fluid, i, sum);
      });
}

/// Power of those pushes, nW.
inline double power_of_pushes(int count, const Array<int>& vertex_body, const Table<double>& share, const Components<double>& velocity) {
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::push_power", Policy(0, count),
      KOKKOS_LAMBDA(int i, double& sum) { sum += dot(load(share, vertex_body(i)), load(velocity, i)); }, power);
  return power;
}

/// sum += more.
inline void add_forces(int count, const Components<double>& more, const Components<double>& sum) {
  Kokkos::parallel_for(
      "corpuscle::transfer::add_forces", Policy(0, count), KOKKOS_LAMBDA(int i) { store(sum, i, load(sum, i) + load(more, i)); });
}

/// Sum of force . velocity, nW.
inline double power_of(int count, const Components<double>& force, const Components<double>& velocity) {
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::power", Policy(0, count), KOKKOS_LAMBDA(int i, double& sum) { sum += dot(load(force, i), load(velocity, i)); },
      power);
  return power;
}

/// v = mobility x force of the first `vertices`.
inline void scale_forces(int vertices, double mobility, const Components<double>& force, const Components<double>& velocity) {
  const Components<double> f = force, v = velocity;
  Kokkos::parallel_for(
      "corpuscle::transfer::scale_forces", Policy(0, vertices), KOKKOS_LAMBDA(int i) { store(v, i, mobility * load(f, i)); });
}

}  // namespace corpuscle
