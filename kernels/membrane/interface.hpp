// Vector operations on the velocities of the coupled interface, [vertex, 3], over the first `count` vertices.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"

namespace corpuscle {

inline void copy_vertices(int count, const Components<double>& from, const Components<double>& to) {
  Kokkos::parallel_for(
      "corpuscle::coupling::copy", Policy(0, count), KOKKOS_LAMBDA(int i) { store(to, i, load(from, i)); });
}

/// The first `count` values, or rows of three, which may be rounded.
inline void copy_values(int count, const Array<double>& from, const Array<double>& to) {
  Kokkos::parallel_for(
      "corpuscle::coupling::copy_values", Policy(0, count), KOKKOS_LAMBDA(int i) { to(i) = from(i); });
}
inline void copy_rounded(int count, const Components<double>& from, const Table<float>& to) {
  Kokkos::parallel_for(
      "corpuscle::coupling::copy_rounded", Policy(0, count), KOKKOS_LAMBDA(int i) {
        for (int d = 0; d < 3; ++d) to(i, d) = static_cast<float>(from(i, d));
      });
}

/// w = (x - x_old) / dt: the mean velocity of a step.
inline void mean_velocity(int count, const Components<double>& x, const Components<double>& x_old, double dt, const Components<double>& w) {
  Kokkos::parallel_for(
      "corpuscle::coupling::mean_velocity", Policy(0, count),
      KOKKOS_LAMBDA(int i) { store(w, i, (1 / dt) * (load(x, i) - load(x_old, i))); });
}

struct ResidualNorms {
  double residual = 0;  // sum of |answer - guess|^2
  double answer = 0;    // sum of |answer|^2
  double product = 0;   // sum of previous . (residual - previous)
  double change = 0;    // sum of |residual - previous|^2
};

/// residual = answer - guess, and its norms against the residual before.
inline ResidualNorms interface_residual(int count, const Components<double>& answer, const Components<double>& guess,
                                        const Components<double>& previous, const Components<double>& residual) {
  ResidualNorms norms;
  Kokkos::parallel_reduce(
      "corpuscle::coupling::residual", Policy(0, count),
      KOKKOS_LAMBDA(int i, double& square, double& size, double& product, double& change) {
        const Vec3 a = load(answer, i), r = a - load(guess, i), before = load(previous, i), step = r - before;
        store(residual, i, r);
        square += dot(r, r);
        size += dot(a, a);
        product += dot(before, step);
        change += dot(step, step);
      },
      norms.residual, norms.answer, norms.product, norms.change);
  return norms;
}

/// guess += factor residual; previous = residual.
inline void relax_interface(int count, double factor, const Components<double>& residual, const Components<double>& guess,
                            const Components<double>& previous) {
  Kokkos::parallel_for(
      "corpuscle::coupling::relax", Policy(0, count), KOKKOS_LAMBDA(int i) {
        const Vec3 r = load(residual, i);
        store(guess, i, load(guess, i) + factor * r);
        store(previous, i, r);
      });
}

/// All components one after the other, as the view stores them.
inline Array<double> flat(const Components<double>& field) { return Array<double>(field.data(), field.span()); }

}  // namespace corpuscle
