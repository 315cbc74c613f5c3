// Differences of a fixed point's iterates, for its acceleration.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

/// Differences of successive iterates, [entry, column].
struct IterateDifferences {
  Components<double> residual;  // residual - previous residual
  Components<double> iterate;   // the same plus the difference of the guesses
};

/// Write column `column` (none if negative), and let the present guess and residual become the previous ones.
inline void record_differences(int column, const IterateDifferences& differences, const Array<double>& guess, const Array<double>& residual,
                               const Array<double>& previous_guess, const Array<double>& previous) {
  const IterateDifferences to = differences;
  Kokkos::parallel_for(
      "corpuscle::acceleration::differences", Policy(0, static_cast<int>(guess.extent(0))), KOKKOS_LAMBDA(int i) {
        const double r = residual(i), v = guess(i), step = r - previous(i);
        if (column >= 0) {
          to.residual(i, column) = step;
          to.iterate(i, column) = step + v - previous_guess(i);
        }
        previous(i) = r;
        previous_guess(i) = v;
      });
}

/// products(c) = column c . column `with`, and products(c + columns) = column c . residual, of the residual differences.
inline void difference_products(int columns, int with, const Components<double>& differences, const Array<double>& residual,
                                const Array<double>& products) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const int count = static_cast<int>(residual.extent(0));
  Kokkos::parallel_for(
      "corpuscle::acceleration::products", Kokkos::TeamPolicy<Exec>(2 * columns, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int column = team.league_rank() % columns;
        const bool of_residual = team.league_rank() >= columns;
        double total = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, count),
            [&](int e, double& sum) { sum += differences(e, column) * (of_residual ? residual(e) : differences(e, with)); }, total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { products(team.league_rank()) = total; });
      });
}

/// guess += residual - sum over columns of weight(c) iterate(:, c).
inline void combine_differences(int columns, const Array<double>& weight, const Components<double>& iterate, const Array<double>& residual,
                                const Array<double>& guess) {
  Kokkos::parallel_for(
      "corpuscle::acceleration::combine", Policy(0, static_cast<int>(guess.extent(0))), KOKKOS_LAMBDA(int i) {
        double value = residual(i);
        for (int c = 0; c < columns; ++c) value -= weight(c) * iterate(i, c);
        guess(i) += value;
      });
}

}  // namespace corpuscle
