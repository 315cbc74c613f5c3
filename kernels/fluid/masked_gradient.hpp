// Gradients of pressure, which exists only at fluid nodes and on outflow faces: differences use what is there.
#pragma once

#include "grid/metrics.hpp"

namespace corpuscle {

/// [cell] 1 where pressure has a value of its own: fluid nodes, and boundary nodes of outflow sides.
using PressureMask = Array<unsigned char>;

/// A difference along one index direction and the displacement that belongs to it.
struct Difference {
  double value = 0;
  Vec3 offset;
};

/// A force on faces, as the difference of pressure across each that would balance it: kPa, along +d, of the face between
/// c - stride(d) and c. It enters wherever that difference does, so that one which is a gradient on the grid is balanced by
/// a pressure exactly.
struct FaceForce {
  Array<double> across[3];  // [cell] with valid halos
  KOKKOS_INLINE_FUNCTION double operator()(int d, int c) const { return across[d](c); }
};
struct NoFaceForce {
  KOKKOS_INLINE_FUNCTION double operator()(int, int) const { return 0; }
};

/// Central where both neighbours have a pressure, one-sided where one has, zero where none has; less the force on the faces
/// between.
template <class P, class Force>
KOKKOS_INLINE_FUNCTION Difference masked_difference(const P& p, const PressureMask& mask, const Components<double>& x, int c, int stride,
                                                    const Force& force, int d) {
  const int low = mask(c - stride) ? c - stride : c, high = mask(c + stride) ? c + stride : c;
  if (low == high) return {0, central_offset(x, c, stride)};
  const double scale = (low != c && high != c) ? 0.5 : 1.0;
  const double between = (low != c ? force(d, c) : 0.0) + (high != c ? force(d, c + stride) : 0.0);
  return {scale * (p(high) - p(low) - between), scale * (load(x, high) - load(x, low))};
}

template <class P>
KOKKOS_INLINE_FUNCTION Difference masked_difference(const P& p, const PressureMask& mask, const Components<double>& x, int c, int stride) {
  return masked_difference(p, mask, x, c, stride, NoFaceForce(), 0);
}

/// Gradient at a fluid node, less the force there.
template <class P, class Force = NoFaceForce>
KOKKOS_INLINE_FUNCTION Vec3 cell_gradient(const P& p, const PressureMask& mask, const Components<double>& x, const IndexSpace& index, int c,
                                          const Force& force = {}) {
  const Difference d0 = masked_difference(p, mask, x, c, index.stride(0), force, 0);
  const Difference d1 = masked_difference(p, mask, x, c, index.stride(1), force, 1);
  const Difference d2 = masked_difference(p, mask, x, c, index.stride(2), force, 2);
  const DualBasis dual(d0.offset, d1.offset, d2.offset);
  return d0.value * dual.b[0] + d1.value * dual.b[1] + d2.value * dual.b[2];
}

/// (gradient - force) . area on the face between c - stride(d) and c, both of which have a pressure. On an orthogonal grid
/// the cross terms vanish and the coefficient alone is used.
template <bool skewed, class P, class Force = NoFaceForce>
KOKKOS_INLINE_FUNCTION double face_gradient(const P& p, const PressureMask& mask, const Components<double>& x, const Vec3& area,
                                            double coefficient, const IndexSpace& index, int d, int c, const Force& force = {}) {
  const int low = c - index.stride(d);
  if constexpr (!skewed) {
    return coefficient * (p(c) - p(low) - force(d, c));
  } else {
    Vec3 a[3];
    double difference[3];
    for (int e = 0; e < 3; ++e) {
      if (e == d) {
        a[e] = load(x, c) - load(x, low);
        difference[e] = p(c) - p(low) - force(d, c);
      } else {
        const Difference here = masked_difference(p, mask, x, c, index.stride(e), force, e);
        const Difference there = masked_difference(p, mask, x, low, index.stride(e), force, e);
        a[e] = 0.5 * (here.offset + there.offset);
        difference[e] = 0.5 * (here.value + there.value);
      }
    }
    const DualBasis dual(a[0], a[1], a[2]);
    double sum = 0;
    for (int e = 0; e < 3; ++e) sum += difference[e] * dot(area, dual.b[e]);
    return sum;
  }
}

}  // namespace corpuscle
