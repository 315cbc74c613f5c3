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

/// sum += the first three of four columns.
inline void add_first_three(int count, const Components<double>& four, const Components<double>& sum) {
  Kokkos::parallel_for(
      "corpuscle::transfer::add_first_three", Policy(0, count),
      KOKKOS_LAMBDA(int i) { store(sum, i, load(sum, i) + load(four, i)); });
}

inline double sum_of_fourth(int count, const Components<double>& four) {
  double total = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::sum_of_fourth", Policy(0, count), KOKKOS_LAMBDA(int i, double& sum) { sum += four(i, 3); }, total);
  return total;
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
