// Differences between a computed and an exact developed flow.
#pragma once

#include "fluid/integrals.hpp"

namespace corpuscle {

/// Largest |u - (0, 0, 2 mean (1 - r^2 / R^2))| over the owned cells of layer k (local number).
inline double poiseuille_difference(const GridViews& grid, const Components<double>& u, int k, double mean, double radius) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  double square = 0;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::poiseuille_difference", Policy(0, index.n[0] * index.n[1]),
      KOKKOS_LAMBDA(int e, double& most) {
        const int c = index.cell(e % index.n[0], e / index.n[0], k);
        const double r2 = x(c, 0) * x(c, 0) + x(c, 1) * x(c, 1);
        const Vec3 difference = load(u, c) - Vec3{0, 0, 2 * mean * (1 - r2 / (radius * radius))};
        most = larger(most, dot(difference, difference));
      },
      Largest(square));
  return std::sqrt(square);
}

/// Volume-weighted mean of p over the owned cells of layer k, as (sum of V p, sum of V).
inline void layer_pressure(const GridViews& grid, const Array<double>& p, int k, double (&sums)[2]) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::layer_pressure", Policy(0, index.n[0] * index.n[1]),
      KOKKOS_LAMBDA(int e, double& weighted, double& total) {
        const int c = index.cell(e % index.n[0], e / index.n[0], k);
        weighted += volume(c) * p(c);
        total += volume(c);
      },
      sums[0], sums[1]);
}

/// Largest difference between u and a velocity linear in coordinate d: low at `lower`, high at `upper`.
inline double couette_difference(const GridViews& grid, const Components<double>& u, int d, double lower, double upper, const Vec3& low,
                                 const Vec3& high) {
  const auto x = grid.x;
  const IndexSpace index = grid.index;
  double square = 0;
  reduce_owned(
      "corpuscle::fluid::couette_difference", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int c = index.cell(i, j, k);
        const double s = (x(c, d) - lower) / (upper - lower);
        const Vec3 difference = load(u, c) - ((1 - s) * low + s * high);
        most = larger(most, dot(difference, difference));
      },
      Largest(square));
  return std::sqrt(square);
}

}  // namespace corpuscle
