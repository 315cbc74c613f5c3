// The slip correction: a membrane that a kernel smears out is hydrodynamically too thick.
#pragma once

#include "fluid/masked_gradient.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// A force along a plate, smeared over a width across it, moves the plate by c (width) f / mu less than a sharp one, f per
/// area. The kernel's width across a surface is its spacing along the normal, h_n^2 = the sum of (n . g_d)^2 over the grid's
/// directions g_d; from faces to cells and back a component along g_d is smeared along it once more, which adds `oblique` times the
/// square of (n . g_d)^2 / h_n^2 to `coefficient`. Measured on plates at several angles, with spacings of up to 3 to 1, to 0.01 h.
struct SlipLaw {
  double coefficient, oblique;
};
template <class Delta>
constexpr SlipLaw slip_law() {
  return Delta::points == 3 ? SlipLaw{0.085, 0.28} : SlipLaw{0.38, 0.22};
}

/// Velocity times viscosity for a tangential force per area f on a surface with that normal: symmetric in force and velocity.
KOKKOS_INLINE_FUNCTION Vec3 slip_motion(const SlipLaw& law, const Vec3 (&along)[3], const Vec3& normal, const Vec3& f) {
  const DualBasis dual(along[0], along[1], along[2]);
  double square[3], whole = 0;
  for (int d = 0; d < 3; ++d) {
    square[d] = dot(along[d], normal) * dot(along[d], normal);
    whole += square[d];
  }
  for (int d = 0; d < 3; ++d) square[d] *= square[d] / (whole * whole);
  Vec3 motion;
  for (int d = 0; d < 3; ++d) {
    double sum = 0;
    for (int e = 0; e < 3; ++e) {
      const double tangential = dot(dual.b[d], dual.b[e]) - dot(dual.b[d], normal) * dot(dual.b[e], normal);
      sum += (law.coefficient + 0.5 * law.oblique * (square[d] + square[e])) * tangential * dot(along[e], f);
    }
    motion += (std::sqrt(whole) * sum) * along[d];
  }
  return motion;
}

/// A membrane's slip, with what it depends on.
struct SlipViews {
  SlipLaw law;
  double viscosity;          // mPa s
  Components<double> force;  // [vertex, 3] nN, of the membrane on the fluid
  Components<double> normal;
  Array<double> area;  // [vertex] um2
  Array<double> chi;   // [vertex] from 1 for a membrane alone to 0 where others are near; without values: 1
};

/// Of a marker's vertex, um/us.
KOKKOS_INLINE_FUNCTION Vec3 slip_velocity(const Lattice& lattice, const SlipViews& slip, const MarkerViews& m, int marker) {
  const int v = m.vertex(marker);
  const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
  LatticePoint q;
  lattice.set(q, eta);
  for (int d = 0; d < 3; ++d) q.f[d] = q.f[d] < 0 ? 0 : (q.f[d] > 1 ? 1 : q.f[d]);
  Vec3 along[3];
  lattice.cell_tangents(q, along);
  const Vec3 n = load(slip.normal, v), f = load(slip.force, v);
  const double share = (slip.chi.extent(0) > 0 ? slip.chi(v) : 1.0) / (slip.viscosity * slip.area(v));
  return share * slip_motion(slip.law, along, n, f - dot(f, n) * n);
}

/// Adds the slip to the velocity of markers that are at home.
inline void add_slip(const TransferBlock& block, const SlipViews& slip, const MarkerViews& markers) {
  const Lattice lattice = block.lattice;
  const MarkerViews m = markers;
  const SlipViews s = slip;
  Kokkos::parallel_for(
      "corpuscle::transfer::add_slip", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        if (m.home(marker)) store(m.velocity, marker, load(m.velocity, marker) + slip_velocity(lattice, s, m, marker));
      });
}

/// Power of the forces on the slip, nW, of the vertices at home here: friction near the membranes that the kernel smears away.
inline double slip_power(const TransferBlock& block, const SlipViews& slip, const MarkerViews& markers) {
  const Lattice lattice = block.lattice;
  const MarkerViews m = markers;
  const SlipViews s = slip;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::slip_power", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker, double& sum) {
        if (m.home(marker)) sum += dot(load(s.force, m.vertex(marker)), slip_velocity(lattice, s, m, marker));
      },
      power);
  return power;
}

}  // namespace corpuscle
