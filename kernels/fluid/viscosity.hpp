// The viscosity of the momentum equation: one for the whole flow, or one that varies in space.
#pragma once

#include "grid/metrics.hpp"

namespace corpuscle {

/// Nothing is stored and nothing added: the operator is written over this viscosity.
struct UniformViscosity {};

/// `relative` [cell] is the viscosity at a node over that of the rest of the operator (FluidSolver::viscosity()), with valid
/// halos; boundary nodes hold the value on the boundary.
struct VaryingViscosity {
  Array<double> relative;
  Components<double> x, face_area[3];  // as in GridViews
};

KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const UniformViscosity&, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const VaryingViscosity& v, int c) { return v.relative(c); }

/// (grad u + grad u^T) . area on the face between c - stride(d) and c.
template <class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 strain_rate_flux(const VaryingViscosity& v, const Velocity& u, const IndexSpace& index, int d,
                                             int c) {
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
  for (int e = 0; e < 3; ++e) flux += dot(area, dual.b[e]) * du[e] + dot(area, du[e]) * dual.b[e];
  return flux;
}

/// What a viscosity that varies adds to the viscous force on cell c, over the uniform one: div((r - 1) (grad u + grad u^T)).
/// Where r = 1 the transpose is the gradient of a divergence that vanishes, and is left out there as in a uniform flow. r on
/// a face is the mean of its two nodes', on the boundary that of the boundary.
template <class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 excess_force(const VaryingViscosity& v, const Velocity& u, const Array<NodeKind>& kind,
                                         const IndexSpace& index, int c) {
  Vec3 force;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      const int s = index.stride(d), face = end == 0 ? c : c + s, beyond = end == 0 ? c - s : c + s;
      const double here = kind(beyond) == NodeKind::boundary ? v.relative(beyond) : 0.5 * (v.relative(c) + v.relative(beyond));
      if (here == 1) continue;
      force += (end == 0 ? 1 - here : here - 1) * strain_rate_flux(v, u, index, d, face);
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
