// Symmetric 3 x 3 matrices, and the rotation in a matrix.
#pragma once

#include "common/small_linear.hpp"

namespace corpuscle {

/// Eigenvalues in rising order, and unit eigenvectors.
struct SymmetricEigen {
  double value[3] = {};
  Vec3 vector[3];
};

/// By Jacobi's rotations, to round-off.
KOKKOS_INLINE_FUNCTION SymmetricEigen eigen_of(double (&a)[3][3]) {
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  constexpr int sweeps = 12;  // converges quadratically: six do
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        }
        for (int k = 0; k < 3; ++k) {
          const double kp = v[k][p], kq = v[k][q];
          v[k][p] = c * kp - s * kq, v[k][q] = s * kp + c * kq;
        }
      }
  int order[3] = {0, 1, 2};
  for (int pass = 0; pass < 2; ++pass)
    for (int n = 0; n < 2; ++n)
      if (a[order[n + 1]][order[n + 1]] < a[order[n]][order[n]]) {
        const int swap = order[n];
        order[n] = order[n + 1], order[n + 1] = swap;
      }
  SymmetricEigen result;
  for (int n = 0; n < 3; ++n) {
    const int from = order[n];
    result.value[n] = a[from][from];
    result.vector[n] = {v[0][from], v[1][from], v[2][from]};
  }
  return result;
}

/// Replaces a matrix, given by its columns, by the rotation nearest to it: its polar factor, by Newton's iteration
/// (Higham, SIAM J. Sci. Stat. Comput. 7, 1986). @returns false if it turns things inside out or flattens them
KOKKOS_INLINE_FUNCTION bool to_rotation(Vec3 (&column)[3]) {
  double square = 0;
  for (const Vec3& c : column) square += dot(c, c);
  if (!(square > 0)) return false;
  for (Vec3& c : column) c *= std::sqrt(3 / square);
  Vec3 inverse[3];
  constexpr int iterations = 30;
  for (int n = 0; n < iterations; ++n) {
    if (!(inverse_rows(column, inverse) > 0)) return false;
    double change = 0;
    for (int d = 0; d < 3; ++d) {
      const Vec3 next = 0.5 * (column[d] + inverse[d]);
      change += dot(next - column[d], next - column[d]);
      column[d] = next;
    }
    if (change < 1e-30) return true;
  }
  return true;
}

}  // namespace corpuscle
