// Where one fluid is outside a membrane and another inside, the velocity along it has a kink even without a force: its kernel's mean
// takes in more of the side where it is steeper. What shears there is taken off again, and forces go back the same way.
#pragma once

#include "transfer/slip.hpp"
#include "transfer/transfer_kernels.hpp"

namespace corpuscle {

/// How much of the shear at a marker its velocity takes along: `way` times the part along the surface of (grad u + grad u^T) n.
/// A plane membrane moves by `kink` spacings times [du/dn] too fast. With the mean shear e of both sides, [mu] from inside to outside,
/// [du/dn] = -(f + [mu] e) / mean mu: this is the part of e, as slip is that of f. Rotations have no such shear.
struct MarkerKink {
  double way = 0;  // um
  Vec3 normal, dual[3];  // of the grid's tangents at the marker

  /// `direction` is where the marker moves with the change of velocity along e: of the row e of the velocity's gradient.
  KOKKOS_INLINE_FUNCTION Vec3 of_gradient(const Vec3& du, int e) const {
    const Vec3 v = dot(dual[e], normal) * du + dot(du, normal) * dual[e];
    return way * (v - dot(v, normal) * normal);
  }
  /// The transpose: what multiplies the change of velocity along e in the power of the force f.
  KOKKOS_INLINE_FUNCTION Vec3 of_force(const Vec3& f, int e) const {
    const Vec3 tangential = f - dot(f, normal) * normal;
    return way * (dot(dual[e], normal) * tangential + dot(dual[e], tangential) * normal);
  }
};

/// One at a full spacing more than the kernel reaches from the grid's sides, nothing where it is folded back.
template <class Delta>
KOKKOS_INLINE_FUNCTION double away_from_sides(const TransferBlock& block, const double (&eta)[3]) {
  const IndexSpace& index = block.index();
  double share = 1;
  for (int d = 0; d < 3; ++d) {
    if (index.periodic[d]) continue;
    const double below = eta[d] + index.first[d], above = index.global[d] - 1 - below;
    share *= slip_share(below + 0.5 - Delta::reach) * slip_share(above + 0.5 - Delta::reach);
  }
  return share;
}

/// `way` is zero where there is nothing to take off.
template <class Delta>
KOKKOS_INLINE_FUNCTION MarkerKink marker_kink(const TransferBlock& block, const SlipViews& slip, const MarkerViews& m, int marker,
                                              const double (&eta)[3]) {
  MarkerKink kink;
  const int v = m.vertex(marker);
  const double ratio = slip.ratio_of(v), share = ratio == 1 ? 0 : away_from_sides<Delta>(block, eta);
  if (share == 0) return kink;
  kink.normal = load(slip.normal, v);
  Vec3 along[3];
  tangents_at(block, eta, along);
  const double spacing = spacing_along(along, kink.normal);
  kink.way = -2 * (ratio - 1) / (ratio + 1) * slip.law.kink * share * spacing;
  if (slip.gap.extent(0) > 0) kink.way *= slip_share(slip.gap(v) / spacing);
  const DualBasis dual(along[0], along[1], along[2]);
  for (int e = 0; e < 3; ++e) kink.dual[e] = dual.b[e];
  return kink;
}

/// The areas that a marker sees, and how they change along each direction of the grid: areas[3 d + e] is that along e. Not beside sides.
template <class Delta>
KOKKOS_INLINE_FUNCTION void changes_of_areas(const TransferBlock& block, const MarkerViews& m, int marker, Vec3 (&change)[9]) {
  for (int d = 0; d < 3; ++d)
    visit_sloped<Delta>(m, marker, d, [&](int i, int j, int k, double, const double(&slope)[3]) {
      const int row[3] = {i, j, k}, c = block.index().cell(i, j, k);
      const Vec3 area = Delta::points > 3 ? seen_area(block, d, c, row) : load(block.sharp_area[d], c);
      for (int e = 0; e < 3; ++e) change[3 * d + e] += slope[e] * area;
    });
}

/// markers.across and markers.dipole of the forces [vertex, 3], nN.
template <class Delta>
void resolve_kinked_forces(const TransferBlock& transfer_block, const SlipViews& slip_views, const MarkerViews& markers,
                           const Components<double>& force) {
  const TransferBlock block = transfer_block;
  const SlipViews slip = slip_views;
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::resolve_forces", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        const DualBasis dual = seen_areas<Delta>(block, m, marker, eta);
        Vec3 f = load(force, m.vertex(marker));
        const MarkerKink kink = marker_kink<Delta>(block, slip, m, marker, eta);
        for (int n = 0; n < 9; ++n) m.dipole(marker, n) = 0;
        if (kink.way != 0) {
          Vec3 change[9], rest;
          changes_of_areas<Delta>(block, m, marker, change);
          for (int d = 0; d < 3; ++d)
            for (int e = 0; e < 3; ++e) {
              const double q = dot(dual.b[d], kink.of_force(f, e));
              m.dipole(marker, 3 * d + e) = q;
              rest += q * change[3 * d + e];
            }
          f -= rest;
        }
        for (int d = 0; d < 3; ++d) m.across(marker, d) = dot(dual.b[d], f);
      });
}

/// Adds to the velocity [vertex, 3] what the faces of this rank give of the shear. After interpolate_velocity().
template <class Delta>
void add_kinks(const TransferBlock& transfer_block, const SlipViews& slip_views, const Array<double> (&flux)[3],
               const MarkerViews& markers, const Components<double>& velocity) {
  const TransferBlock block = transfer_block;
  const SlipViews slip = slip_views;
  const MarkerViews m = markers;
  const auto of_vertex = velocity;
  const FaceForce through{{flux[0], flux[1], flux[2]}};
  Kokkos::parallel_for(
      "corpuscle::transfer::add_kinks", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        const MarkerKink kink = marker_kink<Delta>(block, slip, m, marker, eta);
        if (kink.way == 0) return;
        const DualBasis dual = seen_areas<Delta>(block, m, marker, eta);
        Vec3 change[9], du[3];
        changes_of_areas<Delta>(block, m, marker, change);
        const int v = m.vertex(marker);
        const Vec3 own = load(of_vertex, v);
        for (int d = 0; d < 3; ++d) {
          double sum[3] = {0, 0, 0};
          visit_sloped<Delta>(m, marker, d, [&](int i, int j, int k, double, const double(&slope)[3]) {
            if (!block.owns(0, d == 0, i) || !block.owns(1, d == 1, j) || !block.owns(2, d == 2, k)) return;
            const double across = through(d, block.index().cell(i, j, k));
            for (int e = 0; e < 3; ++e) sum[e] += slope[e] * across;
          });
          for (int e = 0; e < 3; ++e) du[e] += (sum[e] - dot(change[3 * d + e], own)) * dual.b[d];
        }
        Vec3 moved = own;
        for (int e = 0; e < 3; ++e) moved += kink.of_gradient(du[e], e);
        store(of_vertex, v, moved);
      });
}

}  // namespace corpuscle
