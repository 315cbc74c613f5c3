// The slip correction: a membrane that a kernel smears out is hydrodynamically too thick.
#pragma once

#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Share of the spacing by which a membrane is too thick on each side.
template <class Delta>
constexpr double slip_coefficient = Delta::points == 3 ? 0.27 : 0.39;

/// How far the kernel smears a surface with that normal, in spacings along each direction: the spacing along the normal.
KOKKOS_INLINE_FUNCTION double spacing_along(const Lattice& lattice, const double (&xi)[3], const Vec3& normal) {
  LatticePoint q;
  lattice.set(q, xi);
  for (int d = 0; d < 3; ++d) q.f[d] = q.f[d] < 0 ? 0 : (q.f[d] > 1 ? 1 : q.f[d]);
  Vec3 tangent[3];
  lattice.cell_tangents(q, tangent);
  double square = 0;
  for (int d = 0; d < 3; ++d) {
    const double along = dot(tangent[d], normal);
    square += along * along;
  }
  return std::sqrt(square);
}

/// Adds chi c h f_t / mu to the velocity of markers that are at home, h the spacing along the normal and f_t the tangential force
/// per area.
/// @param force   [vertex, 3] nN, of the membrane on the fluid
/// @param chi     [vertex] from 1 for a membrane alone to 0 where others are near; without values: 1
inline void add_slip(const TransferBlock& transfer_block, double coefficient, double mu, const Components<double>& force,
                     const Components<double>& normal, const Array<double>& area, const Array<double>& chi, const MarkerViews& markers) {
  const Lattice lattice = transfer_block.lattice;
  const MarkerViews m = markers;
  const bool blended = chi.extent(0) > 0;
  Kokkos::parallel_for(
      "corpuscle::transfer::add_slip", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        if (!m.home(marker)) return;
        const int v = m.vertex(marker);
        const double xi[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        const Vec3 n = load(normal, v), f = load(force, v), tangential = f - dot(f, n) * n;
        const double share = coefficient * (blended ? chi(v) : 1.0);
        store(m.velocity, marker, load(m.velocity, marker) + (share * spacing_along(lattice, xi, n) / (mu * area(v))) * tangential);
      });
}

}  // namespace corpuscle
