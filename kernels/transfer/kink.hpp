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
KOKKOS_INLINE_FUNCTION MarkerKink marker_kink(const TransferBlock& block, const SlipViews& slip, int v, const double (&eta)[3]) {
  MarkerKink kink;
  const double ratio = slip.ratio_of(v), share = ratio == 1 ? 0 : away_from_sides<Delta>(block, eta);
  if (share == 0) return kink;
  kink.normal = load(slip.normal, v);
  Vec3 along[3];
  tangents_at(block, eta, along);
  const double spacing = spacing_along(along, kink.normal);
  kink.way = kink_between(slip.law, ratio) * share * spacing;
  if (slip.gap.extent(0) > 0) kink.way *= slip_share(slip.gap(v) / spacing);
  const DualBasis dual(along[0], along[1], along[2]);
  for (int e = 0; e < 3; ++e) kink.dual[e] = dual.b[e];
  return kink;
}

/// The areas that a marker sees, and how they change along each direction of the grid: change[d][e] is that along e. Not beside sides.
template <class Delta, class Lines>
KOKKOS_INLINE_FUNCTION void changes_of_areas(const TransferBlock& block, const Lines& lines, Vec3 (&change)[3][3]) {
  if (block.even) return;
  for (int d = 0; d < 3; ++d)
    changes_of_mean<Delta>(
        lines, d,
        [&](int i, int j, int k) {
          const int row[3] = {i, j, k}, c = block.index().cell(i, j, k);
          return Delta::points > 3 ? seen_area(block, d, c, row) : load(block.sharp_area[d], c);
        },
        change[d]);
}

/// markers.across of the forces [vertex, 3], nN, less what their dipoles have of them.
template <class Delta>
void resolve_kinked_forces(const TransferBlock& transfer_block, const SlipViews& slip_views, const MarkerViews& markers,
                           const Components<double>& force) {
  const TransferBlock block = transfer_block;
  const SlipViews slip = slip_views;
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::resolve_forces", Policy(0, m.rows), KOKKOS_LAMBDA(int row) {
        const int marker = m.order(m.first + row), v = m.vertex(marker);
        const MarkerPlace place(block.lattice, m, marker);
        const StoredLines<Delta> lines{m, row};
        const DualBasis dual = seen_areas<Delta>(block, lines, place.eta);
        Vec3 f = load(force, v);
        const MarkerKink kink = marker_kink<Delta>(block, slip, v, place.eta);
        if (kink.way != 0) {
          Vec3 change[3][3], rest;
          changes_of_areas<Delta>(block, lines, change);
          for (int d = 0; d < 3; ++d)
            for (int e = 0; e < 3; ++e) rest += dot(dual.b[d], kink.of_force(f, e)) * change[d][e];
          f -= rest;
        }
        for (int d = 0; d < 3; ++d) m.across(row, d) = dot(dual.b[d], f);
      });
}

/// markers.dipole across the faces of direction d.
template <class Delta>
void resolve_dipoles(const TransferBlock& transfer_block, const SlipViews& slip_views, const MarkerViews& markers,
                     const Components<double>& force, int d) {
  const TransferBlock block = transfer_block;
  const SlipViews slip = slip_views;
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::resolve_dipoles", Policy(0, m.rows), KOKKOS_LAMBDA(int row) {
        const int marker = m.order(m.first + row), v = m.vertex(marker);
        const MarkerPlace place(block.lattice, m, marker);
        const MarkerKink kink = marker_kink<Delta>(block, slip, v, place.eta);
        const Vec3 f = load(force, v);
        const Vec3 across = kink.way != 0 ? seen_areas<Delta>(block, StoredLines<Delta>{m, row}, place.eta).b[d] : Vec3{};
        for (int e = 0; e < 3; ++e) m.dipole(row, e) = kink.way != 0 ? dot(across, kink.of_force(f, e)) : 0;
      });
}

/// spread_forces() of markers with dipoles, of direction d alone.
template <class Delta>
void spread_dipoles(const TransferBlock& block, const MarkerViews& markers, const Planes& planes, int direction, const Array<double>& across) {
  const MarkerViews m = markers;
  const IndexSpace index = block.index();
  const Array<double> out = across;
  const int d = direction;
  for_box(
      "corpuscle::transfer::spread_dipoles", {0, 0, planes.begin}, {block.rows(0, true), block.rows(1, true), planes.end},
      KOKKOS_LAMBDA(int i, int j, int k) {
        constexpr int points = Delta::points;
        const int at[3] = {i, j, k};
        double sum = 0;
        visit_markers<Delta>(index, m, i, j, k, [&](int row) {
          double w[3], slope[3];
          int line[3], point[3];
          for (int e = 2; e >= 0; --e) {
            line[e] = e == d ? 3 + e : e;
            point[e] = at[e] - m.base(row, line[e]);
            w[e] = point[e] >= 0 && point[e] < points ? m.weight(row, line[e] * points + point[e]) : 0;
            if (w[e] == 0) return;
          }
          sum += w[0] * w[1] * w[2] * m.across(row, d);
          const double q[3] = {m.dipole(row, 0), m.dipole(row, 1), m.dipole(row, 2)};
          if (q[0] == 0 && q[1] == 0 && q[2] == 0) return;  // the weights of those that are folded back have no slopes
          for (int e = 0; e < 3; ++e)
            slope[e] = Delta::slope([&](int p) { return m.weight(row, line[e] * points + p); }, point[e]);
          sum += q[0] * slope[0] * w[1] * w[2] + q[1] * w[0] * slope[1] * w[2] + q[2] * w[0] * w[1] * slope[2];
        });
        out(index.cell(i, j, k)) = sum;
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
        const MarkerPlace place(block.lattice, m, marker);
        const double(&eta)[3] = place.eta;
        const int v = m.vertex(marker);
        const MarkerKink kink = marker_kink<Delta>(block, slip, v, eta);
        if (kink.way == 0) return;
        const MarkerLines<Delta> lines(block, eta);
        const DualBasis dual = seen_areas<Delta>(block, lines, eta);
        Vec3 change[3][3], du[3];
        changes_of_areas<Delta>(block, lines, change);
        const Vec3 own = load(of_vertex, v);
        for (int d = 0; d < 3; ++d) {
          double sum[3] = {0, 0, 0};
          changes_of_mean<Delta>(
              lines, d,
              [&](int i, int j, int k) {
                const bool owned = block.owns(0, d == 0, i) && block.owns(1, d == 1, j) && block.owns(2, d == 2, k);
                return owned ? through(d, block.index().cell(i, j, k)) : 0.0;
              },
              sum);
          for (int e = 0; e < 3; ++e) du[e] += (sum[e] - dot(change[d][e], own)) * dual.b[d];
        }
        Vec3 moved = own;
        for (int e = 0; e < 3; ++e) moved += kink.of_gradient(du[e], e);
        store(of_vertex, v, moved);
      });
}

}  // namespace corpuscle
