// Vector operations on the velocities of the coupled interface, [vertex, 3], over the first `count` vertices.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"

namespace corpuscle {

inline void copy_vertices(int count, const Components<double>& from, const Components<double>& to) {
  Kokkos::parallel_for(
      "corpuscle::coupling::copy", Policy(0, count), KOKKOS_LAMBDA(int i) { store(to, i, load(from, i)); });
}

/// w = (x - x_old) / dt: the mean velocity of a step.
inline void mean_velocity(int count, const Components<double>& x, const Components<double>& x_old, double dt,
                          const Components<double>& w) {
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
inline void relax_interface(int count, double factor, const Components<double>& residual,
                            const Components<double>& guess, const Components<double>& previous) {
  Kokkos::parallel_for(
      "corpuscle::coupling::relax", Policy(0, count), KOKKOS_LAMBDA(int i) {
        const Vec3 r = load(residual, i);
        store(guess, i, load(guess, i) + factor * r);
        store(previous, i, r);
      });
}

/// Differences of successive iterates, one column each, [3 vertex + component, column].
struct InterfaceDifferences {
  Components<double> residual;  // residual - previous residual
  Components<double> iterate;   // the same plus the difference of the guesses
};

/// Write column `column`, and let the present guess and residual become the previous ones.
inline void record_differences(int count, int column, const InterfaceDifferences& differences,
                               const Components<double>& guess, const Components<double>& residual,
                               const Components<double>& previous_guess, const Components<double>& previous) {
  Kokkos::parallel_for(
      "corpuscle::coupling::differences", Policy(0, count), KOKKOS_LAMBDA(int i) {
        for (int m = 0; m < 3; ++m) {
          const double r = residual(i, m), v = guess(i, m), step = r - previous(i, m);
          if (column >= 0) {
            differences.residual(3 * i + m, column) = step;
            differences.iterate(3 * i + m, column) = step + v - previous_guess(i, m);
          }
          previous(i, m) = r;
          previous_guess(i, m) = v;
        }
      });
}

/// products(c) = column c . column `with`, and products(c + columns) = column c . residual, of the residual differences.
inline void difference_products(int count, int columns, int with, const Components<double>& differences,
                                const Components<double>& residual, const Array<double>& products) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  Kokkos::parallel_for(
      "corpuscle::coupling::products", Kokkos::TeamPolicy<Exec>(2 * columns, Kokkos::AUTO),
      KOKKOS_LAMBDA(const Team& team) {
        const int column = team.league_rank() % columns;
        const bool of_residual = team.league_rank() >= columns;
        double total = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, 3 * count),
            [&](int e, double& sum) {
              sum += differences(e, column) * (of_residual ? residual(e / 3, e % 3) : differences(e, with));
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { products(team.league_rank()) = total; });
      });
}

/// guess += residual - sum over columns of weight(c) iterate(:, c).
inline void combine_differences(int count, int columns, const Array<double>& weight, const Components<double>& iterate,
                                const Components<double>& residual, const Components<double>& guess) {
  Kokkos::parallel_for(
      "corpuscle::coupling::combine", Policy(0, count), KOKKOS_LAMBDA(int i) {
        for (int m = 0; m < 3; ++m) {
          double value = residual(i, m);
          for (int c = 0; c < columns; ++c) value -= weight(c) * iterate(3 * i + m, c);
          guess(i, m) += value;
        }
      });
}

}  // namespace corpuscle
