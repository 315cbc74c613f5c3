// Small symmetric positive definite systems, solved in registers.
#pragma once

#include "common/vec3.hpp"

namespace corpuscle {

/// Normal matrix of a weighted least-squares fit with N unknowns, and its LDL^T factorisation. The lower triangle is
/// stored by rows.
template <int N>
struct NormalMatrix {
  double a[N * (N + 1) / 2] = {};

  KOKKOS_INLINE_FUNCTION static constexpr int at(int row, int column) { return row * (row + 1) / 2 + column; }

  /// Add one data point with basis values `phi` and weight `w`.
  KOKKOS_INLINE_FUNCTION void add(const double (&phi)[N], double w) {
    for (int r = 0; r < N; ++r) {
      for (int c = 0; c <= r; ++c) a[at(r, c)] += w * phi[r] * phi[c];
    }
  }

  /// Factorise in place. @returns false if some unknown is determined by the others to within the share
  /// `least_pivot` of its own diagonal, that is, if the points do not carry the fit.
  KOKKOS_INLINE_FUNCTION bool factorise(double least_pivot) {
    for (int j = 0; j < N; ++j) {
      const double diagonal = a[at(j, j)];
      for (int k = 0; k < j; ++k) a[at(j, j)] -= a[at(j, k)] * a[at(j, k)] * a[at(k, k)];
      const double pivot = a[at(j, j)];
      if (!(pivot > least_pivot * diagonal)) return false;
      for (int i = j + 1; i < N; ++i) {
        double sum = a[at(i, j)];
        for (int k = 0; k < j; ++k) sum -= a[at(i, k)] * a[at(j, k)] * a[at(k, k)];
        a[at(i, j)] = sum / pivot;
      }
    }
    return true;
  }

  /// Solve in place after factorise().
  KOKKOS_INLINE_FUNCTION void solve(double (&b)[N]) const {
    for (int i = 0; i < N; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= a[at(i, k)] * b[k];
    }
    for (int i = 0; i < N; ++i) b[i] /= a[at(i, i)];
    for (int i = N - 1; i >= 0; --i) {
      for (int k = i + 1; k < N; ++k) b[i] -= a[at(k, i)] * b[k];
    }
  }
};

/// Rows of the inverse of the matrix whose columns are `column`. @returns the determinant; rows are valid if it is
/// not zero.
KOKKOS_INLINE_FUNCTION double inverse_rows(const Vec3 (&column)[3], Vec3 (&row)[3]) {
  row[0] = cross(column[1], column[2]);
  row[1] = cross(column[2], column[0]);
  row[2] = cross(column[0], column[1]);
  const double determinant = dot(column[0], row[0]);
  const double scale = determinant != 0 ? 1 / determinant : 0;
  for (int d = 0; d < 3; ++d) row[d] *= scale;
  return determinant;
}

}  // namespace corpuscle
