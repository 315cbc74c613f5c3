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

/// Central where both neighbours have a pressure, one-sided where one has, zero where none has.
template <class P>
KOKKOS_INLINE_FUNCTION Difference masked_difference(const P& p, const PressureMask& mask, const Components<double>& x,
                                                    int c, int stride) {
  const int low = mask(c - stride) ? c - stride : c, high = mask(c + stride) ? c + stride : c;
  if (low == high) return {0, central_offset(x, c, stride)};
  const double scale = (low != c && high != c) ? 0.5 : 1.0;
  return {scale * (p(high) - p(low)), scale * (load(x, high) - load(x, low))};
}

/// Gradient at a fluid node.
template <class P>
KOKKOS_INLINE_FUNCTION Vec3 cell_gradient(const P& p, const PressureMask& mask, const Components<double>& x,
                                          const IndexSpace& index, int c) {
  const Difference d0 = masked_difference(p, mask, x, c, index.stride(0));
  const Difference d1 = masked_difference(p, mask, x, c, index.stride(1));
  const Difference d2 = masked_difference(p, mask, x, c, index.stride(2));
  const DualBasis dual(d0.offset, d1.offset, d2.offset);
  return d0.value * dual.b[0] + d1.value * dual.b[1] + d2.value * dual.b[2];
}

/// gradient . area on the face between c - stride(d) and c, both of which have a pressure. On an orthogonal grid the
/// cross terms vanish and the coefficient alone is used.
template <bool skewed, class P>
KOKKOS_INLINE_FUNCTION double face_gradient(const P& p, const PressureMask& mask, const Components<double>& x,
                                            const Vec3& area, double coefficient, const IndexSpace& index, int d,
                                            int c) {
  const int low = c - index.stride(d);
  if constexpr (!skewed) {
    return coefficient * (p(c) - p(low));
  } else {
    Vec3 a[3];
    double difference[3];
    for (int e = 0; e < 3; ++e) {
      if (e == d) {
        a[e] = load(x, c) - load(x, low);
        difference[e] = p(c) - p(low);
      } else {
        const Difference here = masked_difference(p, mask, x, c, index.stride(e));
        const Difference there = masked_difference(p, mask, x, low, index.stride(e));
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
