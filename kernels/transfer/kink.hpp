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
  double way = 0;        // um
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

/// How much is taken off at a gap of so many spacings from a side that gives the velocity. The weights are folded back there, and so are
/// their slopes: the fluid is seen to go on beyond the side, with the membrane's mirror image, whose own kink takes from that of the
/// membrane, up to all of it on the side: what there is to take off grows with the gap.
KOKKOS_INLINE_FUNCTION double kink_share_beside(double spacings) {
  constexpr double all = 1.25;
  return spacings <= 0 ? 0 : (spacings >= all ? 1 : spacings / all);
}

/// Of the sides that a marker is near. Where fluid slips along a side or leaves through it, all is taken off.
KOKKOS_INLINE_FUNCTION double kink_share_at_sides(const TransferBlock& block, const double (&eta)[3]) {
  const IndexSpace& index = block.index();
  double share = 1;
  for (int d = 0; d < 3; ++d) {
    if (index.periodic[d]) continue;
    const double below = eta[d] + index.first[d] + 0.5;
    if (block.reflection[d][0][0] < 0) share *= kink_share_beside(below);
    if (block.reflection[d][1][0] < 0) share *= kink_share_beside(index.global[d] - below);
  }
  return share;
}

/// `way` is zero where there is nothing to take off.
KOKKOS_INLINE_FUNCTION MarkerKink marker_kink(const TransferBlock& block, const SlipViews& slip, int v, const double (&eta)[3]) {
  MarkerKink kink;
  const double ratio = slip.ratio_of(v), share = ratio == 1 ? 0 : kink_share_at_sides(block, eta);
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

/// How the weight of the cell or face `row` along e changes with a marker there, the points beyond sides being folded back.
template <class Delta>
KOKKOS_INLINE_FUNCTION double folded_slope(const TransferBlock& block, int e, bool faces, double eta, int row) {
  const DeltaLine<Delta> line = delta_line<Delta>(block, e, faces, eta);
  double sum = 0;
  for (int p = 0; p < Delta::points; ++p)
    if (line.row[p] == row)
      sum += (line.end[p] < 0 ? 1 : block.reflection[e][line.end[p]][faces]) * Delta::slope([&](int q) { return line.weight[q]; }, p);
  return sum;
}

/// As visit_faces(), with the changes of the product along each direction in its place.
template <class Delta, class Visit>
KOKKOS_INLINE_FUNCTION void visit_changes(const TransferBlock& block, const double (&eta)[3], int d, const Visit& visit) {
  constexpr int points = Delta::points;
  DeltaLine<Delta> line[3];
  double slope[3][points];
  for (int e = 0; e < 3; ++e) {
    line[e] = delta_line<Delta>(block, e, e == d, eta[e]);
    for (int p = 0; p < points; ++p) slope[e][p] = Delta::slope([&](int q) { return line[e].weight[q]; }, p);
  }
  for (int k = 0; k < points; ++k)
    for (int j = 0; j < points; ++j)
      for (int i = 0; i < points; ++i) {
        const int row[3] = {line[0].row[i], line[1].row[j], line[2].row[k]}, end[3] = {line[0].end[i], line[1].end[j], line[2].end[k]};
        const double a = line[0].weight[i], b = line[1].weight[j], c = line[2].weight[k];
        const double change[3] = {slope[0][i] * b * c, a * slope[1][j] * c, a * b * slope[2][k]};
        visit(block.index().cell(row[0], row[1], row[2]), change, row, end);
      }
}

/// The areas that a marker sees, and how they change along each direction of the grid: change[d][e] is that along e.
template <class Delta, class Lines>
KOKKOS_INLINE_FUNCTION void changes_of_areas(const TransferBlock& block, const Lines& lines, const double (&eta)[3], Vec3 (&change)[3][3]) {
  if (block.even) return;
  const bool folded = is_folded<Delta>(block, eta);
  for (int d = 0; d < 3; ++d) {
    const auto area = [&](int c, const int(&row)[3]) {
      return Delta::points > 3 ? seen_area(block, d, c, row) : load(block.sharp_area[d], c);
    };
    if (folded)
      visit_changes<Delta>(block, eta, d, [&](int c, const double(&w)[3], const int(&row)[3], const int(&)[3]) {
        for (int e = 0; e < 3; ++e) change[d][e] += w[e] * area(c, row);
      });
    else
      changes_of_mean<Delta>(
          lines, d,
          [&](int i, int j, int k) {
            const int row[3] = {i, j, k};
            return area(block.index().cell(i, j, k), row);
          },
          change[d]);
  }
}

/// How the sum of the fluxes through the faces of direction d, as a marker sees them, changes along each direction of the grid: this rank's
/// part. @param u  [cell, 3] um/us, read on the sides of the block
template <class Delta, class Lines>
KOKKOS_INLINE_FUNCTION void changes_of_flux(const TransferBlock& block, const FaceForce& through, const Components<double>& u,
                                            const Lines& lines, const double (&eta)[3], int d, double (&change)[3]) {
  const auto owned = [&](int i, int j, int k) { return block.owns(0, d == 0, i) && block.owns(1, d == 1, j) && block.owns(2, d == 2, k); };
  if (!is_folded<Delta>(block, eta)) {
    changes_of_mean<Delta>(
        lines, d, [&](int i, int j, int k) { return owned(i, j, k) ? through(d, block.index().cell(i, j, k)) : 0.0; }, change);
    return;
  }
  visit_changes<Delta>(block, eta, d, [&](int c, const double(&w)[3], const int(&row)[3], const int(&end)[3]) {
    if (!owned(row[0], row[1], row[2])) return;
    double flux = through(d, c);
    for (int e = 0; e < 3; ++e)
      if (end[e] >= 0) flux *= block.reflection[e][end[e]][e == d ? 1 : 0];
    if (end[0] >= 0 || end[1] >= 0 || end[2] >= 0) flux += given_flux(block, u, d, row, end, load(block.sharp_area[d], c));
    for (int e = 0; e < 3; ++e) change[e] += w[e] * flux;
  });
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
        const MarkerKink kink = marker_kink(block, slip, v, place.eta);
        if (kink.way != 0) {
          Vec3 change[3][3], rest;
          changes_of_areas<Delta>(block, lines, place.eta, change);
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
        const MarkerKink kink = marker_kink(block, slip, v, place.eta);
        const Vec3 f = load(force, v);
        const Vec3 across = kink.way != 0 ? seen_areas<Delta>(block, StoredLines<Delta>{m, row}, place.eta).b[d] : Vec3{};
        for (int e = 0; e < 3; ++e) m.dipole(row, e) = kink.way != 0 ? dot(across, kink.of_force(f, e)) : 0;
      });
}

/// spread_forces() of markers with dipoles, of direction d alone.
template <class Delta>
void spread_dipoles(const TransferBlock& transfer_block, const MarkerViews& markers, const Planes& planes, int direction,
                    const Array<double>& across) {
  const TransferBlock block = transfer_block;
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
            if (point[e] < 0 || point[e] >= points) return;
            w[e] = m.weight(row, line[e] * points + point[e]);
          }
          sum += w[0] * w[1] * w[2] * m.across(row, d);
          const double q[3] = {m.dipole(row, 0), m.dipole(row, 1), m.dipole(row, 2)};
          if (q[0] == 0 && q[1] == 0 && q[2] == 0) return;
          for (int e = 0; e < 3; ++e) {
            const int first = at[e] - point[e], last = index.n[e] - (e == d ? 0 : 1);
            const bool folded =
                (block.lattice.boundary_below[e] && first < 0) || (block.lattice.boundary_above[e] && first + points - 1 > last);
            slope[e] = folded ? folded_slope<Delta>(block, e, e == d, MarkerPlace(block.lattice, m, m.order(m.first + row)).eta[e], at[e])
                              : Delta::slope([&](int p) { return m.weight(row, line[e] * points + p); }, point[e]);
          }
          sum += q[0] * slope[0] * w[1] * w[2] + q[1] * w[0] * slope[1] * w[2] + q[2] * w[0] * w[1] * slope[2];
        });
        out(index.cell(i, j, k)) = sum;
      });
}

/// Adds to the velocity [vertex, 3] what the faces of this rank give of the shear. After interpolate_velocity(), of the same arguments.
template <class Delta>
void add_kinks(const TransferBlock& transfer_block, const SlipViews& slip_views, const Array<double> (&flux)[3],
               const Components<double>& u, const MarkerViews& markers, const Components<double>& velocity) {
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
        const MarkerKink kink = marker_kink(block, slip, v, eta);
        if (kink.way == 0) return;
        const MarkerLines<Delta> lines(block, eta);
        const DualBasis dual = seen_areas<Delta>(block, lines, eta);
        Vec3 change[3][3], du[3];
        changes_of_areas<Delta>(block, lines, eta, change);
        const Vec3 own = load(of_vertex, v);
        for (int d = 0; d < 3; ++d) {
          double sum[3] = {0, 0, 0};
          changes_of_flux<Delta>(block, through, u, lines, eta, d, sum);
          for (int e = 0; e < 3; ++e) du[e] += (sum[e] - dot(change[d][e], own)) * dual.b[d];
        }
        Vec3 moved = own;
        for (int e = 0; e < 3; ++e) moved += kink.of_gradient(du[e], e);
        store(of_vertex, v, moved);
      });
}

}  // namespace corpuscle
