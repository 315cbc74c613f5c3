// Gradients on the cell-centre lattice of a curvilinear block. All formulas are exact for linear fields on any grid.
#pragma once

#include "common/vec3.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// Vectors b[n] with b[n] . a[m] = 1 for n = m and 0 otherwise.
struct DualBasis {
  Vec3 b[3];
  KOKKOS_INLINE_FUNCTION DualBasis(const Vec3& a0, const Vec3& a1, const Vec3& a2) {
    b[0] = cross(a1, a2);
    b[1] = cross(a2, a0);
    b[2] = cross(a0, a1);
    const double inverse = 1 / dot(a0, b[0]);
    for (auto& v : b) v *= inverse;
  }
};

/// Half the difference of the centres on both sides of cell c along direction e.
template <class X>
KOKKOS_INLINE_FUNCTION Vec3 central_offset(const X& x, int c, int stride) {
  return 0.5 * (load(x, c + stride) - load(x, c - stride));
}

/// Coefficients of the face between c - stride(d) and c: gradient . area = g[d] (f_c - f_(c - stride)) + the sum over the
/// other directions e of g[e] times the mean over both cells of the central difference along e.
template <class X>
KOKKOS_INLINE_FUNCTION Vec3 face_coefficients(const X& x, const Vec3& area, const IndexSpace& index, int d, int c) {
  const int low = c - index.stride(d);
  Vec3 a[3];
  for (int e = 0; e < 3; ++e) {
    if (e == d)
      a[e] = load(x, c) - load(x, low);
    else
      a[e] = 0.5 * (central_offset(x, c, index.stride(e)) + central_offset(x, low, index.stride(e)));
  }
  const DualBasis dual(a[0], a[1], a[2]);
  return {dot(area, dual.b[0]), dot(area, dual.b[1]), dot(area, dual.b[2])};
}

}  // namespace corpuscle
