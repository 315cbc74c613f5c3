// Forces to faces, fluxes to velocities. With the weights phi of the faces of direction d around a marker, a marker's velocity
// is the one whose fluxes through them, phi-averaged, are those of the fluid: S_d . U = sum phi flux, S_d = sum phi S. So a
// uniform velocity is exact on any grid. A force goes the same way back: Q = phi q_d across each face with sum q_d S_d = f, a
// difference of pressure, and f . U = sum Q flux.
#pragma once

#include "fluid/masked_gradient.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Calls visit(cell number, product of the weights, row along each direction, ends) for the faces of direction d that a marker
/// reaches, those beyond a side by the faces they mirror.
template <class Delta, class Visit>
KOKKOS_INLINE_FUNCTION void visit_faces(const TransferBlock& block, const double (&eta)[3], int d, const Visit& visit) {
  DeltaLine<Delta> line[3];
  for (int e = 0; e < 3; ++e) line[e] = delta_line<Delta>(block, e, e == d, eta[e]);
  for (int k = 0; k < Delta::points; ++k)
    for (int j = 0; j < Delta::points; ++j)
      for (int i = 0; i < Delta::points; ++i) {
        const int row[3] = {line[0].row[i], line[1].row[j], line[2].row[k]}, end[3] = {line[0].end[i], line[1].end[j], line[2].end[k]};
        visit(block.index().cell(row[0], row[1], row[2]), line[0].weight[i] * line[1].weight[j] * line[2].weight[k], row, end);
      }
}

/// Area of the face `c` of direction d as the kernel sees it. Where a marker that reaches this block's first faces reaches a row beyond the
/// halo on its other side, as the four-point kernel does, that is the line through the last two rows: exact where faces are alike.
KOKKOS_INLINE_FUNCTION Vec3 seen_area(const TransferBlock& block, int d, int c, const int (&row)[3]) {
  constexpr int halo = IndexSpace::halo;
  const IndexSpace& index = block.index();
  int inward[3];
  bool within = true;
  for (int e = 0; e < 3; ++e) {
    inward[e] = row[e] < -halo ? 1 : (row[e] >= index.n[e] + halo ? -1 : 0);
    within = within && inward[e] == 0;
  }
  if (within) return load(block.sharp_area[d], c);
  Vec3 sum;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    int at[3];
    for (int e = 0; e < 3; ++e) {
      const int second = corner >> e & 1;
      at[e] = row[e] + (1 + second) * inward[e];
      weight *= inward[e] == 0 ? 1 - second : (second ? -1 : 2);
    }
    if (weight != 0) sum += weight * load(block.sharp_area[d], index.cell(at[0], at[1], at[2]));
  }
  return sum;
}

/// The inverse of the matrix of face areas that a marker sees: dual.b[d] goes with the faces of direction d.
template <class Delta>
KOKKOS_INLINE_FUNCTION DualBasis seen_areas(const TransferBlock& block, const double (&eta)[3]) {
  Vec3 seen[3];
  for (int d = 0; d < 3; ++d) {
    Vec3 sum;
    visit_faces<Delta>(block, eta, d, [&](int c, double w, const int(&row)[3], const int(&)[3]) {
      sum += w * (Delta::points > 3 ? seen_area(block, d, c, row) : load(block.sharp_area[d], c));
    });
    seen[d] = sum;
  }
  return DualBasis(seen[0], seen[1], seen[2]);
}

/// Whether a marker reaches beyond a side, so that its weights are folded back.
template <class Delta>
KOKKOS_INLINE_FUNCTION bool is_folded(const TransferBlock& block, const double (&eta)[3]) {
  bool folded = false;
  for (int e = 0; e < 3; ++e)
    folded = folded || (block.lattice.boundary_below[e] && eta[e] < Delta::reach) ||
             (block.lattice.boundary_above[e] && eta[e] > block.index().n[e] - 1 - Delta::reach);
  return folded;
}

/// How the mean of value(i, j, k) over the faces of direction d that a marker reaches, which is not folded, changes along each direction of
/// the grid.
template <class Delta, class Lines, class Value, class Sum>
KOKKOS_INLINE_FUNCTION void changes_of_mean(const Lines& lines, int d, const Value& value, Sum (&change)[3]) {
  constexpr int points = Delta::points;
  double weight[3][points], slope[3][points];
  int base[3];
  for (int e = 0; e < 3; ++e) {
    const int line = e == d ? 3 + e : e;
    base[e] = lines.base(line);
    for (int p = 0; p < points; ++p) weight[e][p] = lines.weight(line, p);
    for (int p = 0; p < points; ++p) slope[e][p] = Delta::slope([&](int q) { return weight[e][q]; }, p);
  }
  for (int k = 0; k < points; ++k)
    for (int j = 0; j < points; ++j) {
      Sum mean{}, steep{};
      for (int i = 0; i < points; ++i) {
        const Sum here = value(base[0] + i, base[1] + j, base[2] + k);
        mean += weight[0][i] * here;
        steep += slope[0][i] * here;
      }
      change[0] += (weight[1][j] * weight[2][k]) * steep;
      change[1] += (slope[1][j] * weight[2][k]) * mean;
      change[2] += (weight[1][j] * slope[2][k]) * mean;
    }
}

/// The same as seen_areas() of its place, with the weights that it has.
template <class Delta, class Lines>
KOKKOS_INLINE_FUNCTION DualBasis seen_areas(const TransferBlock& block, const Lines& lines, const double (&eta)[3]) {
  if (is_folded<Delta>(block, eta)) return seen_areas<Delta>(block, eta);
  if (block.even) {
    const int any = block.index().cell(0, 0, 0);
    return DualBasis(load(block.sharp_area[0], any), load(block.sharp_area[1], any), load(block.sharp_area[2], any));
  }
  constexpr int points = Delta::points;
  Vec3 seen[3];
  for (int d = 0; d < 3; ++d) {
    int line[3];
    for (int e = 0; e < 3; ++e) line[e] = e == d ? 3 + e : e;
    Vec3 sum;
    for (int k = 0; k < points; ++k)
      for (int j = 0; j < points; ++j)
        for (int i = 0; i < points; ++i) {
          const int row[3] = {lines.base(line[0]) + i, lines.base(line[1]) + j, lines.base(line[2]) + k};
          const double w = lines.weight(line[0], i) * lines.weight(line[1], j) * lines.weight(line[2], k);
          const int c = block.index().cell(row[0], row[1], row[2]);
          sum += w * (points > 3 ? seen_area(block, d, c, row) : load(block.sharp_area[d], c));
        }
    seen[d] = sum;
  }
  return DualBasis(seen[0], seen[1], seen[2]);
}

/// base and weight of the markers that have rows.
template <class Delta>
void prepare_markers(const TransferBlock& transfer_block, const MarkerViews& markers) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::prepare_markers", Policy(0, m.rows), KOKKOS_LAMBDA(int row) {
        const MarkerPlace place(block.lattice, m, m.order(m.first + row));
        const MarkerLines<Delta> lines(block, place.eta);
        for (int line = 0; line < 6; ++line) m.base(row, line) = static_cast<short>(lines.first[line]);
        for (int n = 0; n < 6 * Delta::points; ++n) m.weight(row, n) = lines.value[n];
      });
}

/// markers.across of the forces [vertex, 3], nN. After prepare_markers(), as all that follows of rows.
template <class Delta>
void resolve_forces(const TransferBlock& transfer_block, const MarkerViews& markers, const Components<double>& force) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  Kokkos::parallel_for(
      "corpuscle::transfer::resolve_forces", Policy(0, m.rows), KOKKOS_LAMBDA(int row) {
        const int marker = m.order(m.first + row);
        const MarkerPlace place(block.lattice, m, marker);
        const DualBasis dual = seen_areas<Delta>(block, StoredLines<Delta>{m, row}, place.eta);
        const Vec3 f = load(force, m.vertex(marker));
        for (int d = 0; d < 3; ++d) m.across(row, d) = dot(dual.b[d], f);
      });
}

/// m.near, so that cells without markers are passed over.
template <class Delta>
void mark_near(const TransferBlock& transfer_block, const MarkerViews& markers) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  Kokkos::deep_copy(Exec(), m.near, static_cast<unsigned char>(0));
  Kokkos::parallel_for(
      "corpuscle::transfer::mark_near", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        const MarkerPlace place(block.lattice, m, marker);
        int lower[3], upper[3];
        for (int e = 0; e < 3; ++e) {
          const int cell = first_point<Delta>(false, place.eta[e]), face = first_point<Delta>(true, place.eta[e]);
          lower[e] = cell < face ? cell : face;
          upper[e] = (cell < face ? face : cell) + Delta::points;
          lower[e] = lower[e] > 0 ? lower[e] : 0;
          upper[e] = upper[e] < block.rows(e, true) ? upper[e] : block.rows(e, true);
        }
        for (int k = lower[2]; k < upper[2]; ++k)
          for (int j = lower[1]; j < upper[1]; ++j)
            for (int i = lower[0]; i < upper[0]; ++i) m.near(block.index().cell(i, j, k)) = 1;
      });
}

/// How many cells on a marker may reach one, or its low faces, from below and from above.
template <class Delta>
struct MarkerReach {
  static constexpr int below = -2, above = Delta::points == 3 ? 1 : 2;
};

/// Calls visit(row) for the markers that may reach cell (i, j, k) or its low
/// faces, in the order of cells and of markers in them.
template <class Delta, class Visit>
KOKKOS_INLINE_FUNCTION void visit_markers(const IndexSpace& index, const MarkerViews& m, int i, int j, int k, const Visit& visit) {
  constexpr int below = MarkerReach<Delta>::below, above = MarkerReach<Delta>::above;
  const int last = m.near(index.cell(i, j, k)) ? above : below - 1;
  for (int dk = below; dk <= last; ++dk)
    for (int dj = below; dj <= above; ++dj) {
      const int line = index.cell(i + below, j + dj, k + dk), end = m.start(line + above - below + 1);
      for (int s = m.start(line); s < end; ++s) visit(s - m.first);
    }
}

/// Planes of cells and their low faces, along the last direction.
struct Planes {
  int begin = 0, end = 0;
};

/// across [cell] kPa at the faces of this rank: gathered, in the order of cells and of markers in them.
template <class Delta>
struct SpreadForces {
  static constexpr int points = Delta::points;
  MarkerViews m;
  IndexSpace index;
  FaceForce out;

  /// Weights of a marker at a cell and its low face along e.
  KOKKOS_INLINE_FUNCTION bool reached(int row, int e, int at, double& of_cell, double& of_face) const {
    const int p = at - m.base(row, e), q = at - m.base(row, e + 3);
    of_cell = p >= 0 && p < points ? m.weight(row, e * points + p) : 0;
    of_face = q >= 0 && q < points ? m.weight(row, (e + 3) * points + q) : 0;
    return of_cell != 0 || of_face != 0;
  }
  KOKKOS_INLINE_FUNCTION void operator()(int i, int j, int k) const {
    double sum[3] = {0, 0, 0};
    visit_markers<Delta>(index, m, i, j, k, [&](int row) {
      double w[6];
      if (!reached(row, 2, k, w[2], w[5]) || !reached(row, 1, j, w[1], w[4]) || !reached(row, 0, i, w[0], w[3])) return;
      sum[0] += w[3] * w[1] * w[2] * m.across(row, 0);
      sum[1] += w[0] * w[4] * w[2] * m.across(row, 1);
      sum[2] += w[0] * w[1] * w[5] * m.across(row, 2);
    });
    const int c = index.cell(i, j, k);
    for (int d = 0; d < 3; ++d) out.across[d](c) = sum[d];
  }
  /// The same for the cells begin <= i < end of a line, where each marker is looked at once: on the host, which has a line a thread.
  void line(int begin, int end, int j, int k) const {
    constexpr int below = MarkerReach<Delta>::below, above = MarkerReach<Delta>::above;
    const int first = index.cell(0, j, k);
    for (int d = 0; d < 3; ++d)
      for (int i = begin; i < end; ++i) out.across[d](first + i) = 0;
    for (int dk = below; dk <= above; ++dk)
      for (int dj = below; dj <= above; ++dj) {
        const int last = m.start(index.cell(end - 1 + above, j + dj, k + dk) + 1);
        for (int s = m.start(index.cell(begin + below, j + dj, k + dk)); s < last; ++s) {
          const int row = s - m.first;
          double w[6];
          if (!reached(row, 2, k, w[2], w[5]) || !reached(row, 1, j, w[1], w[4])) continue;
          const int base = m.base(row, 0), face = m.base(row, 3), low = base < face ? base : face,
                    high = (base < face ? face : base) + points;
          const double q[3] = {m.across(row, 0), m.across(row, 1), m.across(row, 2)};
          for (int i = low > begin ? low : begin; i < (high < end ? high : end); ++i) {
            if (!reached(row, 0, i, w[0], w[3])) continue;
            out.across[0](first + i) += w[3] * w[1] * w[2] * q[0];
            out.across[1](first + i) += w[0] * w[4] * w[2] * q[1];
            out.across[2](first + i) += w[0] * w[1] * w[5] * q[2];
          }
        }
      }
  }
};

/// In some planes, of which all markers that reach them have rows.
template <class Delta>
void spread_forces(const TransferBlock& block, const MarkerViews& markers, const Planes& planes, const FaceForce& force) {
  for_box("corpuscle::transfer::spread_forces", {0, 0, planes.begin}, {block.rows(0, true), block.rows(1, true), planes.end},
          SpreadForces<Delta>{markers, block.index(), force});
}

/// Velocity that the sides give, where the face's point is reflected last along `last`: beyond other sides too it is itself
/// reflected, on from the side along that direction. Exact where the velocity is linear.
KOKKOS_INLINE_FUNCTION Vec3 given_velocity(const TransferBlock& block, const Components<double>& u, int d, int last, const int (&row)[3],
                                           const int (&end)[3]) {
  const IndexSpace& index = block.index();
  Vec3 sum;
  for (int on_side = 0; on_side < 8; ++on_side) {  // bit e: the point lies on the side along e
    int at[3];
    double weight = on_side >> last & 1 ? 1 : 0;
    for (int e = 0; e < 3; ++e) {
      const bool on = on_side >> e & 1;
      at[e] = on ? (end[e] == 0 ? -1 : index.n[e]) : row[e];
      if (e == last) continue;
      const bool reflected = e > last && end[e] >= 0, given = reflected && block.reflection[e][end[e]][e == d ? 1 : 0] < 0;
      weight *= on ? (given ? 2 : 0) : (given ? -1 : 1);
    }
    if (weight == 0) continue;
    // A face across d lies between two cells, or on a side.
    if (block.lattice.boundary_below[d] && at[d] == 0) at[d] = -1;
    const bool on = at[d] == -1 ? block.lattice.boundary_below[d] : at[d] == index.n[d] && block.lattice.boundary_above[d];
    const int c = index.cell(at[0], at[1], at[2]);
    sum += weight * (on ? load(u, c) : 0.5 * (load(u, c) + load(u, c - index.stride(d))));
  }
  return sum;
}

/// What the given velocities of the sides add to the flux through a face beyond them, whose flux is else the mirrored face's
/// times the product of the reflections. The velocity is reflected along one direction after the other.
KOKKOS_INLINE_FUNCTION double given_flux(const TransferBlock& block, const Components<double>& u, int d, const int (&row)[3],
                                         const int (&end)[3], const Vec3& area) {
  double flux = 0, factor = 1;
  for (int e = 0; e < 3; ++e) {
    if (end[e] < 0) continue;
    const double reflection = block.reflection[e][end[e]][e == d ? 1 : 0];
    if (reflection < 0) flux += 2 * factor * dot(area, given_velocity(block, u, d, e, row, end));
    factor *= reflection;
  }
  return flux;
}

/// velocity [vertex, 3], um/us, of the markers' vertices: the part that the faces of this rank give.
/// @param u  [cell, 3] um/us, read on the sides of the block
template <class Delta>
void interpolate_velocity(const TransferBlock& transfer_block, const Array<double> (&flux)[3], const Components<double>& u,
                          const MarkerViews& markers, const Components<double>& velocity) {
  const TransferBlock block = transfer_block;
  const MarkerViews m = markers;
  const auto of_vertex = velocity;
  const FaceForce through{{flux[0], flux[1], flux[2]}};
  Kokkos::parallel_for(
      "corpuscle::transfer::interpolate_velocity", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        constexpr int points = Delta::points;
        const IndexSpace& index = block.index();
        const MarkerPlace place(block.lattice, m, marker);
        const double(&eta)[3] = place.eta;
        const bool folded = is_folded<Delta>(block, eta);
        const MarkerLines<Delta> lines(block, eta);
        const DualBasis dual = seen_areas<Delta>(block, lines, eta);
        Vec3 part;
        for (int d = 0; d < 3; ++d) {
          const int line[3] = {d == 0 ? 3 : 0, d == 1 ? 4 : 1, d == 2 ? 5 : 2};
          double sum = 0;
          for (int c = 0; c < points; ++c) {
            const int k = lines.base(line[2]) + c;
            if (!block.owns(2, d == 2, k)) continue;
            for (int b = 0; b < points; ++b) {
              const int j = lines.base(line[1]) + b;
              if (!block.owns(1, d == 1, j)) continue;
              const double w = lines.weight(line[1], b) * lines.weight(line[2], c);
              for (int a = 0; a < points; ++a) {
                const int i = lines.base(line[0]) + a;
                if (block.owns(0, d == 0, i)) sum += w * lines.weight(line[0], a) * through(d, index.cell(i, j, k));
              }
            }
          }
          if (folded)
            visit_faces<Delta>(block, eta, d, [&](int c, double w, const int(&row)[3], const int(&end)[3]) {
              const bool beyond = end[0] >= 0 || end[1] >= 0 || end[2] >= 0;
              if (!beyond || !block.owns(0, d == 0, row[0]) || !block.owns(1, d == 1, row[1]) || !block.owns(2, d == 2, row[2])) return;
              sum += w * given_flux(block, u, d, row, end, load(block.sharp_area[d], c));
            });
          part += sum * dual.b[d];
        }
        store(of_vertex, m.vertex(marker), part);
      });
}

}  // namespace corpuscle
