// The viscosity of the momentum equation: one for the whole flow, or one that varies in space.
#pragma once

#include "grid/metrics.hpp"

namespace corpuscle {

/// Nothing is stored and nothing added: the operator is written over this viscosity.
struct UniformViscosity {};

/// `relative` [cell] is the viscosity at a node over that of the rest of the operator (FluidSolver::viscosity()), with valid
/// halos; boundary nodes hold the value on the boundary. `least` is not above any of them, nor above 1.
struct VaryingViscosity {
  Array<double> relative;
  double least;
  Components<double> x, face_area[3];  // as in GridViews
};

KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const UniformViscosity&, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const VaryingViscosity& v, int c) { return v.relative(c); }
/// On the face between two nodes.
KOKKOS_FORCEINLINE_FUNCTION double mean_viscosity(const UniformViscosity&, int, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double mean_viscosity(const VaryingViscosity& v, int a, int b) {
  return 0.5 * (v.relative(a) + v.relative(b));
}

/// (r - 1) grad u . area + (r - least) grad u^T . area on the face between c - stride(d) and c, where r is the viscosity. A uniform
/// part of the transpose's viscosity is the gradient of a divergence, which vanishes in the end. On the way there it is in the
/// operator: with less than `least` taken off, velocities along their own gradient would be driven, not resisted, where r < 1/2.
template <class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 excess_flux(const VaryingViscosity& v, double r, const Velocity& u, const IndexSpace& index, int d, int c) {
  const int low = c - index.stride(d);
  Vec3 a[3], du[3];
  for (int e = 0; e < 3; ++e) {
    const int s = index.stride(e);
    if (e == d) {
      a[e] = load(v.x, c) - load(v.x, low);
      du[e] = to_double(load(u, c) - load(u, low));
    } else {
      a[e] = 0.5 * (central_offset(v.x, c, s) + central_offset(v.x, low, s));
      du[e] = 0.25 * to_double(load(u, c + s) - load(u, c - s) + load(u, low + s) - load(u, low - s));
    }
  }
  const DualBasis dual(a[0], a[1], a[2]);
  const Vec3 area = load(v.face_area[d], c);
  Vec3 flux;
  for (int e = 0; e < 3; ++e)
    flux += ((r - 1) * dot(area, dual.b[e])) * du[e] + ((r - v.least) * dot(area, du[e])) * dual.b[e];
  return flux;
}

/// On the face towards `beyond`: the mean of its two nodes', on the boundary that of the boundary.
KOKKOS_FORCEINLINE_FUNCTION double face_viscosity(const VaryingViscosity& v, const Array<NodeKind>& kind, int c, int beyond) {
  return kind(beyond) == NodeKind::boundary ? v.relative(beyond) : mean_viscosity(v, c, beyond);
}

/// What a viscosity that varies adds to the viscous force on cell c, over the uniform one: div(r (grad u + grad u^T)) less
/// div grad u. Where r = least = 1 that is nothing.
template <class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 excess_force(const VaryingViscosity& v, const Velocity& u, const Array<NodeKind>& kind,
                                         const IndexSpace& index, int c) {
  Vec3 force;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      const int s = index.stride(d), face = end == 0 ? c : c + s;
      const double here = face_viscosity(v, kind, c, end == 0 ? c - s : c + s);
      if (here == 1 && v.least == 1) continue;
      force += (end == 0 ? -1.0 : 1.0) * excess_flux(v, here, u, index, d, face);
    }
  return force;
}

/// image -= what the viscosity adds to the uniform one's force.
template <class Image, class Velocity>
KOKKOS_FORCEINLINE_FUNCTION void subtract_excess(const UniformViscosity&, const Velocity&, const Array<NodeKind>&,
                                                 const IndexSpace&, int, Image&) {}
template <class Image, class Velocity>
KOKKOS_FORCEINLINE_FUNCTION void subtract_excess(const VaryingViscosity& v, const Velocity& u, const Array<NodeKind>& kind,
                                                 const IndexSpace& index, int c, Image& image) {
  const Vec3 excess = excess_force(v, u, kind, index, c);
  for (int m = 0; m < 3; ++m) image[m] -= excess[m];
}

}  // namespace corpuscle
