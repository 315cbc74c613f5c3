// The slip correction: a membrane that a kernel smears out is hydrodynamically too thick.
#pragma once

#include "fluid/masked_gradient.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// A force along a plate, smeared over a width across it, moves the plate by c (width) f / mu less than a sharp one, f per
/// area. The kernel's width across a surface is its spacing along the normal, h_n^2 = the sum of (n . g_d)^2 over the grid's
/// directions g_d; from faces to cells and back a component along g_d is smeared along it once more, which adds `oblique` times the
/// square of (n . g_d)^2 / h_n^2 to `coefficient`. Measured on plates at several angles, with spacings of up to 3 to 1, to 0.01 h
/// (four-point: 0.03 h). Between fluids of viscosities mu and r mu it is their mean that resists, and less is missing, by `layered` times
/// (r - 1)^2 / r, once the kink of the velocity is taken off (kink.hpp). That and `kink` are measured on a plane across one direction of
/// the grid, as means over where it lies, with what two fluids in a cell make of its viscosity: to 0.001 h for r from 1/10 to 50, if
/// slip_between() went on below what it ends at.
struct SlipLaw {
  double coefficient, oblique, layered, kink;
};
template <class Delta>
constexpr SlipLaw slip_law() {
  return Delta::points == 3 ? SlipLaw{0.104, 0.28, 0.0415, 0.237} : SlipLaw{0.38, 0.22, 0.0206, 0.358};
}

/// Slip between two fluids over that in one as viscous as the outer one. What is as short as the kernel's width hardly moves a vertex but
/// by slip: where none is left, a membrane that resists being strained (by its viscosity, above all) holds the fluid of all that width at
/// rest. The viscosity that a sphere so held adds, three spacings in radius, jumps from 6 to 30 % too much where slip ends (ratio 4.27).
/// Hence not less than `least`, by which a plane is too mobile (0.03 h of force per area over the outer viscosity for r = 5): 5 %, and none
/// with five spacings; blood in a slit, with ratio 5 and 1e-7 N s/m, has 1.37 times the plasma's viscosity on 0.5 um and 1.47 on 1 um
/// (1.44, 1.73 without).
KOKKOS_INLINE_FUNCTION double slip_between(const SlipLaw& law, double ratio) {
  constexpr double least = 0.2;
  const double slip = 2 * (1 - law.layered / law.coefficient * (ratio - 1) * (ratio - 1) / ratio) / (1 + ratio);
  return slip > least ? slip : least;
}

/// What the velocity of a membrane between two fluids takes along of the mean shear there, over spacings; see kink.hpp.
KOKKOS_INLINE_FUNCTION double kink_between(const SlipLaw& law, double ratio) { return -2 * (ratio - 1) / (ratio + 1) * law.kink; }

/// The spacing along a normal.
KOKKOS_INLINE_FUNCTION double spacing_along(const Vec3 (&along)[3], const Vec3& normal) {
  double square = 0;
  for (int d = 0; d < 3; ++d) square += dot(along[d], normal) * dot(along[d], normal);
  return std::sqrt(square);
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
  double viscosity;          // mPa s, outside
  Components<double> force;  // [vertex, 3] nN, of the membrane on the fluid
  Components<double> normal;
  Array<double> area;           // [vertex] um2
  Array<double> gap;            // [vertex] um to the nearest other surface; without values nothing is near
  Components<double> followed;  // [vertex, 1] share of the force that a step can follow; without values all of it
  Array<int> body;              // [vertex]
  Array<int> type;              // [body]
  Array<double> ratio;          // [type] of the viscosity inside to that outside; without values all are 1

  KOKKOS_INLINE_FUNCTION double ratio_of(int vertex) const { return ratio.extent(0) > 0 ? ratio(type(body(vertex))) : 1; }
};

/// The grid's directions, a spacing long, at a marker.
KOKKOS_INLINE_FUNCTION void tangents_at(const TransferBlock& block, const double (&eta)[3], Vec3 (&along)[3]) {
  LatticePoint q;
  block.lattice.set(q, eta);
  for (int d = 0; d < 3; ++d) q.f[d] = q.f[d] < 0 ? 0 : (q.f[d] > 1 ? 1 : q.f[d]);
  block.lattice.cell_tangents(q, along);
}

/// How much of the slip is left at a gap of so many spacings: all above 1.5, none below 0.5. A velocity that belongs to one
/// membrane would let two of them cross; one that all take from the same field cannot, since it is continuous.
KOKKOS_INLINE_FUNCTION double slip_share(double spacings) {
  const double t = spacings - 0.5;
  return t <= 0 ? 0 : (t >= 1 ? 1 : t * t * (3 - 2 * t));
}
constexpr double slip_reach = 1.5;  // spacings

/// How much is left beside a side that gives the velocity, of the slip along it. There the kernel is folded back, and a force
/// along a plate moves it too little by the same way as elsewhere down to a quarter of a spacing, and then by less: by nothing on the
/// side itself (plane plates between such a side and a free one, three-point kernel: to within 0.05 of the spacing).
KOKKOS_INLINE_FUNCTION double slip_share_along_side(double spacings) {
  constexpr double whole = 0.25;
  if (spacings >= whole) return 1;
  const double left = spacings > 0 ? 1 - spacings / whole : 1;
  return 1 - left * left;
}

/// Takes from v what half of the way to no slip takes beside the block's sides: applied to the force and to the motion, so that
/// the one is as the other for both. Across a side less is left than along it, so that no slip carries a membrane through it.
KOKKOS_INLINE_FUNCTION Vec3 fade_at_sides(const TransferBlock& block, const double (&eta)[3], const Vec3 (&along)[3], Vec3 v) {
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      if (!(end == 0 ? block.lattice.boundary_below[d] : block.lattice.boundary_above[d])) continue;
      if (block.reflection[d][end][1] > 0) continue;  // fluid leaves through it
      const double gap = end == 0 ? eta[d] + 0.5 : block.index().n[d] - 0.5 - eta[d];
      if (gap >= slip_reach) continue;
      const Vec3 across = cross(along[(d + 1) % 3], along[(d + 2) % 3]), n = (1 / norm(across)) * across;
      const bool sticks = block.reflection[d][end][0] < 0;
      const double beside = sticks ? std::sqrt(slip_share_along_side(gap)) : 1, through = std::sqrt(slip_share(gap));
      v = beside * v + ((through - beside) * dot(v, n)) * n;
    }
  return v;
}

/// In place of how many times as stiff as at rest a vertex is, the share of the forces at which slip is no faster than `most` times that
/// of the membrane at rest: what strain has stiffened further, explicit steps could not follow.
inline void limit_slip(int vertices, double most, const Array<double>& stiffening) {
  const Array<double> share = stiffening;
  Kokkos::parallel_for(
      "corpuscle::transfer::limit_slip", Policy(0, vertices), KOKKOS_LAMBDA(int i) { share(i) = share(i) > most ? most / share(i) : 1; });
}

/// Of a marker's vertex, um/us.
KOKKOS_INLINE_FUNCTION Vec3 slip_velocity(const TransferBlock& block, const SlipViews& slip, const MarkerViews& m, int marker) {
  const int v = m.vertex(marker);
  const double between = slip_between(slip.law, slip.ratio_of(v));
  const MarkerPlace place(block.lattice, m, marker);
  const double(&eta)[3] = place.eta;
  Vec3 along[3];
  tangents_at(block, eta, along);
  const Vec3 n = load(slip.normal, v), f = (slip.followed.extent(0) > 0 ? slip.followed(v, 0) : 1.0) * load(slip.force, v);
  double share = between / (slip.viscosity * slip.area(v));
  if (slip.gap.extent(0) > 0) share *= slip_share(slip.gap(v) / spacing_along(along, n));
  const Vec3 tangential = fade_at_sides(block, eta, along, f - dot(f, n) * n);
  return share * fade_at_sides(block, eta, along, slip_motion(slip.law, along, n, tangential));
}

/// Adds the slip to the velocity [vertex, 3] of vertices whose marker is at home.
inline void add_slip(const TransferBlock& transfer_block, const SlipViews& slip, const MarkerViews& markers,
                     const Components<double>& velocity) {
  const TransferBlock block = transfer_block;
  const auto of_vertex = velocity;
  const MarkerViews m = markers;
  const SlipViews s = slip;
  Kokkos::parallel_for(
      "corpuscle::transfer::add_slip", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        const int v = m.vertex(marker);
        if (m.home(marker)) store(of_vertex, v, load(of_vertex, v) + slip_velocity(block, s, m, marker));
      });
}

/// The grid's spacings [vertex, 3] along its directions, um, where vertices are at home here.
inline void spacings_at(const TransferBlock& transfer_block, const MarkerViews& markers, const Components<double>& spacings) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  const Components<double> out = spacings;
  Kokkos::parallel_for(
      "corpuscle::transfer::spacings_at", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        if (!m.home(marker)) return;
        Vec3 along[3];
        tangents_at(block, MarkerPlace(block.lattice, m, marker).eta, along);
        store(out, m.vertex(marker), Vec3{norm(along[0]), norm(along[1]), norm(along[2])});
      });
}

/// Columns [vertex, 3], um, of the matrix that makes slip of force, times viscosity and area, of the vertices at home here; away from other
/// surfaces and sides.
inline void slip_columns(const TransferBlock& transfer_block, const SlipViews& slip, const MarkerViews& markers,
                         const Components<double> (&columns)[3]) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  const SlipViews s = slip;
  const Components<double> first = columns[0], second = columns[1], third = columns[2];
  Kokkos::parallel_for(
      "corpuscle::transfer::slip_columns", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        if (!m.home(marker)) return;
        const int v = m.vertex(marker);
        Vec3 along[3];
        tangents_at(block, MarkerPlace(block.lattice, m, marker).eta, along);
        const Vec3 n = load(s.normal, v);
        const double between = slip_between(s.law, s.ratio_of(v));
        store(first, v, between * slip_motion(s.law, along, n, Vec3{1, 0, 0} - n[0] * n));
        store(second, v, between * slip_motion(s.law, along, n, Vec3{0, 1, 0} - n[1] * n));
        store(third, v, between * slip_motion(s.law, along, n, Vec3{0, 0, 1} - n[2] * n));
      });
}

/// Power of the forces on the slip, nW, of the vertices at home here: friction near the membranes that the kernel smears away.
inline double slip_power(const TransferBlock& transfer_block, const SlipViews& slip, const MarkerViews& markers) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  const SlipViews s = slip;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::slip_power", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker, double& sum) {
        if (m.home(marker)) sum += dot(load(s.force, m.vertex(marker)), slip_velocity(block, s, m, marker));
      },
      power);
  return power;
}

}  // namespace corpuscle
