// Rows of the pressure equation: minus the divergence of the compact gradient, one row per owned cell.
#pragma once

#include "common/summing.hpp"
#include "fluid/masked_gradient.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// Neighbours of a row by position in the 3 x 3 x 3 block around it. Orthogonal grids need 7, skewed ones 19.
struct RowPattern {
  int count = 0;
  int di[19], dj[19], dk[19];

  static RowPattern make(bool skewed) {
    RowPattern pattern;
    const auto add = [&](int i, int j, int k) {
      const int n = pattern.count++;
      pattern.di[n] = i, pattern.dj[n] = j, pattern.dk[n] = k;
    };
    add(0, 0, 0);
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const int steps = i * i + j * j + k * k;
          if (steps == 1 || (steps == 2 && skewed)) add(i, j, k);
        }
    return pattern;
  }
};

/// Local accumulator for one row.
struct RowBlock {
  double value[27];
  KOKKOS_INLINE_FUNCTION RowBlock() {
    for (double& v : value) v = 0;
  }
  KOKKOS_INLINE_FUNCTION static int at(int i, int j, int k) { return (i + 1) + 3 * ((j + 1) + 3 * (k + 1)); }
};

/// Position in the row block of a step along direction d.
KOKKOS_INLINE_FUNCTION int block_step(int d) { return d == 0 ? 1 : (d == 1 ? 3 : 9); }

/// Add weight times the masked difference along e at cell `c`, which sits at `centre` of the row block.
KOKKOS_INLINE_FUNCTION void add_masked_difference(RowBlock& row, const PressureMask& mask, int c, int stride, int centre, int step,
                                                  double weight) {
  const bool low = mask(c - stride), high = mask(c + stride);
  if (!low && !high) return;
  const double w = (low && high) ? 0.5 * weight : weight;
  row.value[high ? centre + step : centre] += w;
  row.value[low ? centre - step : centre] -= w;
}

/// Add minus the outward flux of the compact gradient through the face of direction d at `c`, on side `sign` (+1: the
/// face is the row's upper one) of the row.
template <bool skewed>
KOKKOS_INLINE_FUNCTION void add_face(RowBlock& row, const PressureMask& mask, const Components<double>& x, const Vec3& area,
                                     double coefficient, const IndexSpace& index, int d, int c, int sign) {
  const int low = c - index.stride(d), centre = RowBlock::at(0, 0, 0), step = block_step(d);
  const int at_c = sign > 0 ? centre + step : centre, at_low = at_c - step;
  if constexpr (!skewed) {
    row.value[at_c] -= sign * coefficient;
    row.value[at_low] += sign * coefficient;
  } else {
    Vec3 a[3];
    for (int e = 0; e < 3; ++e) {
      if (e == d) {
        a[e] = load(x, c) - load(x, low);
      } else {
        // Any field serves here: only the offsets of the masked differences are wanted.
        const auto here = masked_difference(mask, mask, x, c, index.stride(e));
        const auto there = masked_difference(mask, mask, x, low, index.stride(e));
        a[e] = 0.5 * (here.offset + there.offset);
      }
    }
    const DualBasis dual(a[0], a[1], a[2]);
    for (int e = 0; e < 3; ++e) {
      const double weight = -sign * dot(area, dual.b[e]);
      if (e == d) {
        row.value[at_c] += weight;
        row.value[at_low] -= weight;
      } else {
        add_masked_difference(row, mask, c, index.stride(e), at_c, block_step(e), 0.5 * weight);
        add_masked_difference(row, mask, low, index.stride(e), at_low, block_step(e), 0.5 * weight);
      }
    }
  }
}

/// Fill `value` [row, pattern.count] with the coefficients. Rows of nodes that are not fluid hold their geometric
/// diagonal alone; outflow nodes, whose value is zero, drop out of the rows; entries outside the grid stay zero.
/// @param pinned  padded cell number of the node whose diagonal is doubled to fix the level of an all-Neumann problem
///                (exact for a compatible right-hand side: summing the rows leaves that node at zero); -1 for none
template <bool skewed>
void pressure_rows(const GridViews& grid, const Array<double> (&coefficient)[3], const Array<NodeKind>& kind, const PressureMask& mask,
                   const RowPattern& pattern, int pinned, const Table<double>& value) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const auto g0 = coefficient[0], g1 = coefficient[1], g2 = coefficient[2];
  for_owned(
      "corpuscle::fluid::pressure_rows", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), r = index.compact(i, j, k);
        RowBlock row;
        double geometric = 0;
        for (int d = 0; d < 3; ++d) {
          const auto& g = d == 0 ? g0 : (d == 1 ? g1 : g2);
          const auto& area = d == 0 ? area0 : (d == 1 ? area1 : area2);
          const int next = c + index.stride(d), low = c - index.stride(d);
          geometric += g(c) + g(next);
          if (kind(c) != NodeKind::fluid) continue;
          if (mask(next)) add_face<skewed>(row, mask, x, load(area, next), g(next), index, d, next, 1);
          if (mask(low)) add_face<skewed>(row, mask, x, load(area, c), g(c), index, d, c, -1);
        }
        const int centre = RowBlock::at(0, 0, 0);
        if (row.value[centre] == 0) row.value[centre] = geometric;
        if (c == pinned) row.value[centre] *= 2;
        for (int n = 0; n < pattern.count; ++n) {
          const int neighbour = index.cell(i + pattern.di[n], j + pattern.dj[n], k + pattern.dk[n]);
          const bool unknown = n == 0 || kind(neighbour) == NodeKind::fluid;
          value(r, n) = unknown ? row.value[RowBlock::at(pattern.di[n], pattern.dj[n], pattern.dk[n])] : 0.0;
        }
      });
}

/// Global row numbers of every pattern entry, -1 outside the grid; `row` holds the numbers with halos exchanged.
inline void pressure_columns(const IndexSpace& index, const Array<int>& row, const RowPattern& pattern, const Table<int>& column) {
  for_owned(
      "corpuscle::fluid::pressure_columns", index, KOKKOS_LAMBDA(int i, int j, int k) {
        for (int n = 0; n < pattern.count; ++n)
          column(index.compact(i, j, k), n) = row(index.cell(i + pattern.di[n], j + pattern.dj[n], k + pattern.dk[n]));
      });
}

/// number = first + compact number of each owned cell.
inline void number_rows(const IndexSpace& index, int first, const Array<int>& number) {
  for_owned(
      "corpuscle::fluid::row_number", index,
      KOKKOS_LAMBDA(int i, int j, int k) { number(index.cell(i, j, k)) = first + index.compact(i, j, k); });
}

/// slot [row, entry] = position of the entry in arrays packed row by row, -1 where column is negative; also each row's
/// global number and length. Returns the number of entries.
inline int assign_slots(const Table<int>& column, int first, int count, const Table<int>& slot, const Array<int>& row,
                        const Array<int>& length) {
  return running_sum<int>(
      "corpuscle::fluid::pressure_slots", static_cast<int>(row.extent(0)), KOKKOS_LAMBDA(int r, int& next, bool final) {
        int here = 0;
        for (int n = 0; n < count; ++n) {
          const bool present = column(r, n) >= 0;
          if (final) slot(r, n) = present ? next + here : -1;
          here += present;
        }
        if (final) row(r) = first + r, length(r) = here;
        next += here;
      });
}

/// packed(slot(r, n)) = entry(r, n)
template <class Entry, class Packed>
void pack_entries(const Entry& entry, const Table<int>& slot, const Packed& packed) {
  const int count = static_cast<int>(slot.extent(1));
  Kokkos::parallel_for(
      "corpuscle::fluid::pack_entries", Policy(0, static_cast<int>(slot.extent(0))), KOKKOS_LAMBDA(int r) {
        for (int n = 0; n < count; ++n)
          if (slot(r, n) >= 0) packed(slot(r, n)) = entry(r, n);
      });
}

}  // namespace corpuscle
