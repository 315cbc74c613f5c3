// Geometric multigrid on an orthogonal grid, for the pressure and for the velocity: cells are joined in pairs along the
// directions that couple most strongly, and conductances of coarse faces are those of the fine faces on them, in
// parallel. Pairs are those of the whole grid, so the cycle is the same however the grid is cut over ranks. It works in
// single precision, half the memory and twice the lanes of double: what that leaves, the iteration around it takes out.
#pragma once

#include "common/chebyshev.hpp"
#include "common/vec3.hpp"
#include "fluid/masked_gradient.hpp"
#include "fluid/viscosity.hpp"
#include "grid/halo_copy.hpp"

namespace corpuscle {

using CycleReal = float;

/// The unknown of one cell: a number, or a vector.
template <class Real>
KOKKOS_FORCEINLINE_FUNCTION Real value_at(const Array<Real>& field, int c) {
  return field(c);
}
template <class Real>
KOKKOS_FORCEINLINE_FUNCTION Vector3<Real> value_at(const Components<Real>& field, int c) {
  return load(field, c);
}
template <class Real>
KOKKOS_FORCEINLINE_FUNCTION void set_value(const Array<Real>& field, int c, Real value) {
  field(c) = value;
}
template <class Real>
KOKKOS_FORCEINLINE_FUNCTION void set_value(const Components<Real>& field, int c, const Vector3<Real>& value) {
  store(field, c, value);
}

/// Kernels are labelled by what they solve for.
template <class Field>
std::string cycle_label(const char* step) {
  return std::string(Field::rank == 1 ? "corpuscle::multigrid::" : "corpuscle::velocity_multigrid::") + step;
}

/// One level. A x at cell c is diagonal(c) x(c) minus the sum over its faces of conductance times x beyond the face;
/// x is zero beyond physical boundaries. Cells without an unknown have no conductances, and inverse = 0.
template <class Real>
struct LevelOperator {
  IndexSpace index;
  Array<Real> conductance[3];  // [cell] of the face between cell - stride(d) and cell
  Array<Real> diagonal, inverse;

  template <class Field>
  KOKKOS_FORCEINLINE_FUNCTION auto apply(const Field& x, int c) const {
    const int s1 = index.stride(1), s2 = index.stride(2);
    return diagonal(c) * value_at(x, c) - conductance[0](c) * value_at(x, c - 1) - conductance[0](c + 1) * value_at(x, c + 1) -
           conductance[1](c) * value_at(x, c - s1) - conductance[1](c + s1) * value_at(x, c + s1) -
           conductance[2](c) * value_at(x, c - s2) - conductance[2](c + s2) * value_at(x, c + s2);
  }
};

/// The same for the cycle, and how it is coarsened: cell I of this rank's part of the coarser level holds the cells from
/// factor I + shift.
struct MultigridLevel : LevelOperator<CycleReal> {
  int factor[3] = {1, 1, 1};  // cells of this level in one of the next coarser, along each direction
  int shift[3] = {0, 0, 0};   // 1 where the first cell of this rank is the second of a pair
  IndexSpace part;            // of the coarser level, what this rank makes
  int begin[3] = {0, 0, 0};   // where the part begins in the coarser level as this rank has it: not at 0 where it has the whole
  bool split = false;         // whether somewhere the cells of a pair belong to different ranks
  bool closed[3][2] = {};     // sides whose conductance does not count in the diagonal
  bool shared[3][2] = {};     // sides whose halo is filled by others, or from the other end of a period
};

/// Conductances between nodes that both have a pressure, on owned cells and one halo layer.
/// @param viscosity  UniformViscosity, or what they are times as large by
template <class Real, class Viscosity = UniformViscosity>
void mask_conductances(const Array<double> (&coefficient)[3], const PressureMask& mask, const LevelOperator<Real>& level,
                       const Viscosity& viscosity = {}) {
  const IndexSpace index = level.index;
  const Viscosity relative = viscosity;
  for (int d = 0; d < 3; ++d) {
    const auto g = level.conductance[d];
    const auto from = coefficient[d];
    const int stride = index.stride(d);
    std::array<int, 3> upper{index.n[0] + 1, index.n[1] + 1, index.n[2] + 1};
    upper[d] += 1;
    for_box(
        "corpuscle::multigrid::conductance", {-1, -1, -1}, upper, KOKKOS_LAMBDA(int i, int j, int k) {
          const int c = index.cell(i, j, k);
          g(c) = mask(c) && mask(c - stride) ? from(c) * mean_viscosity(relative, c, c - stride) : 0.0;
        });
  }
}

/// Cells of the finer level in coarse cell I along d, which may lie beyond a periodic or another rank's side.
KOKKOS_INLINE_FUNCTION int children(const MultigridLevel& fine, int d, int coarse) {
  int at = fine.index.first[d] + fine.shift[d] + fine.factor[d] * coarse;
  if (at < 0) at = fine.factor[d] * ((fine.index.global[d] - 1) / fine.factor[d]);
  const int rest = fine.index.global[d] - at;
  return rest < fine.factor[d] ? rest : fine.factor[d];
}

/// Conductances of this rank's part of the next coarser level; those of the finer one in its first halo layer must be valid. The distance
/// between cell centres along a joined direction grows, so a conductance is divided by the mean number of cells joined
/// on its two sides.
inline void coarsen_conductances(const MultigridLevel& fine, const MultigridLevel& coarse) {
  const IndexSpace index = fine.part, fine_index = fine.index, all = coarse.index;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    const auto g = coarse.conductance[d];
    std::array<int, 3> upper{index.n[0], index.n[1], index.n[2]};
    upper[d] += 1;
    for_box(
        "corpuscle::multigrid::coarsen", {0, 0, 0}, upper, KOKKOS_LAMBDA(int i, int j, int k) {
          const int at[3] = {i, j, k};
          int first[3];
          for (int m = 0; m < 3; ++m) first[m] = fine.factor[m] * at[m] + fine.shift[m];
          const bool low = index.first[d] + at[d] == 0 && !index.periodic[d];
          const bool high = index.first[d] + at[d] == index.global[d];
          if (high) first[d] = fine_index.n[d];
          const int below = low ? 0 : children(fine, d, at[d] - 1);
          const int above = !high ? children(fine, d, at[d]) : (index.periodic[d] ? fine.factor[d] : 0);
          const CycleReal cells = low ? above : (above == 0 ? below : CycleReal(0.5) * (above + below));
          const int c = fine_index.cell(first[0], first[1], first[2]);
          CycleReal sum = 0;
          for (int b = 0; b < children(fine, f, at[f]); ++b)
            for (int a = 0; a < children(fine, e, at[e]); ++a)
              sum += fine.conductance[d](c + a * fine_index.stride(e) + b * fine_index.stride(f));
          g(all.cell(i + fine.begin[0], j + fine.begin[1], k + fine.begin[2])) = sum / cells;
        });
  }
}

// What a cycle does to one cell.

/// coarse = sums over the joined cells, for a cell of this rank's part of the coarser level. Without branches, so that it vectorises: what
/// is not joined is read (it is never beyond the halo) and counts nothing.
template <class Field>
struct RestrictSums {
  MultigridLevel fine;
  IndexSpace coarse;
  Field values, coarse_values;

  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    const int s1 = fine.index.stride(1), s2 = fine.index.stride(2);
    const int c =
        fine.index.cell(fine.factor[0] * i + fine.shift[0], fine.factor[1] * j + fine.shift[1], fine.factor[2] * k + fine.shift[2]);
    const CycleReal w0 = children(fine, 0, i) - 1, w1 = children(fine, 1, j) - 1, w2 = children(fine, 2, k) - 1;
    const auto pair = [&](int at) { return value_at(values, at) + w0 * value_at(values, at + 1); };
    set_value(coarse_values, coarse.cell(i + fine.begin[0], j + fine.begin[1], k + fine.begin[2]),
              pair(c) + w1 * pair(c + s1) + w2 * (pair(c + s2) + w1 * pair(c + s1 + s2)));
  }
};

template <class Field>
void restrict_sums(const MultigridLevel& fine, const IndexSpace& coarse, const Field& values, const Field& coarse_values) {
  for_owned(cycle_label<Field>("restrict"), fine.part, RestrictSums<Field>{fine, coarse, values, coarse_values});
}

/// diagonal = own + the conductances of a cell's faces.
template <class Real>
void level_diagonals(const LevelOperator<Real>& level, const bool (&closed)[3][2], const Array<CycleReal>& own) {
  const IndexSpace index = level.index;
  bool low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = closed[d][0], high[d] = closed[d][1];
  const bool l0 = low[0], l1 = low[1], l2 = low[2], h0 = high[0], h1 = high[1], h2 = high[2];
  for_owned(
      "corpuscle::multigrid::diagonal", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        Real sum = own(c);
        if (i > 0 || !l0) sum += level.conductance[0](c);
        if (j > 0 || !l1) sum += level.conductance[1](c);
        if (k > 0 || !l2) sum += level.conductance[2](c);
        if (i + 1 < index.n[0] || !h0) sum += level.conductance[0](c + index.stride(0));
        if (j + 1 < index.n[1] || !h1) sum += level.conductance[1](c + index.stride(1));
        if (k + 1 < index.n[2] || !h2) sum += level.conductance[2](c + index.stride(2));
        level.diagonal(c) = sum;
        level.inverse(c) = sum > 0 ? 1 / sum : Real(0);
      });
}

/// inverse from the diagonal in all cells, those of the halo too.
template <class Real>
void invert_diagonal(const LevelOperator<Real>& level) {
  Kokkos::parallel_for(
      "corpuscle::multigrid::inverse", Policy(0, level.index.size()),
      KOKKOS_LAMBDA(int c) { level.inverse(c) = level.diagonal(c) > 0 ? 1 / level.diagonal(c) : Real(0); });
}

/// own = 0 but at `pinned` (padded cell number on the rank that owns it, -1 elsewhere), where it is as large as the
/// conductances together: that fixes the level of an all-Neumann problem.
inline void pin_level(const LevelOperator<CycleReal>& level, int pinned, const Array<CycleReal>& own) {
  Kokkos::deep_copy(Exec(), own, CycleReal(0));
  if (pinned < 0) return;
  const IndexSpace index = level.index;
  Kokkos::parallel_for(
      "corpuscle::multigrid::pin", Policy(0, 1), KOKKOS_LAMBDA(int) {
        CycleReal sum = 0;
        for (int d = 0; d < 3; ++d) sum += level.conductance[d](pinned) + level.conductance[d](pinned + index.stride(d));
        own(pinned) = sum;
      });
}

/// Sum of the conductances along d over owned cells: how strongly that direction couples.
inline double sum_conductances(const MultigridLevel& level, int d) {
  const IndexSpace index = level.index;
  const auto g = level.conductance[d];
  return sum_owned(
      "corpuscle::multigrid::strength", index, KOKKOS_LAMBDA(int i, int j, int k) { return g(index.cell(i, j, k)); });
}

// What follows also runs for cells of the halo, behind each line (for_box_rounded) and where other ranks do the same: beyond a physical
// side inverse is zero, which leaves their x at zero; beyond another rank's side what is not known of x is exchanged before it is read.

/// previous, x = the first and the second Chebyshev iterate from zero.
template <class Field>
struct SmoothFromZero {
  LevelOperator<CycleReal> level;
  CycleReal of_first, of_others, of_own;
  Field b, previous, x;

  KOKKOS_INLINE_FUNCTION SmoothFromZero(const LevelOperator<CycleReal>& a, const ChebyshevSteps::Step& first,
                                        const ChebyshevSteps::Step& second, const Field& right, const Field& before, const Field& result)
      : level(a), b(right), previous(before), x(result) {
    const double w0 = first.weight, w1 = second.weight, m1 = second.momentum;
    of_first = w0, of_others = w1 * w0, of_own = w0 + m1 * w0 + w1 - w1 * w0;
  }
  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    const int s1 = level.index.stride(1), s2 = level.index.stride(2), c = level.index.cell(i, j, k);
    const auto &inverse = level.inverse, &g0 = level.conductance[0], &g1 = level.conductance[1], &g2 = level.conductance[2];
    const auto scaled = inverse(c) * value_at(b, c);
    const auto around = g0(c) * inverse(c - 1) * value_at(b, c - 1) + g0(c + 1) * inverse(c + 1) * value_at(b, c + 1) +
                        g1(c) * inverse(c - s1) * value_at(b, c - s1) + g1(c + s1) * inverse(c + s1) * value_at(b, c + s1) +
                        g2(c) * inverse(c - s2) * value_at(b, c - s2) + g2(c + s2) * inverse(c + s2) * value_at(b, c + s2);
    set_value(previous, c, of_first * scaled);
    // D^-1 A x1 = w0 (scaled - inverse * around), since D^-1 D = 1 where there is an unknown and scaled = 0 elsewhere
    set_value(x, c, of_own * scaled + of_others * inverse(c) * around);
  }
};

/// previous = x + momentum (x - previous) + weight D^-1 (b - A x): the next iterate takes the place of the one before.
template <class Field>
struct Smooth {
  LevelOperator<CycleReal> level;
  CycleReal momentum, weight;
  Field b, x, previous;

  KOKKOS_INLINE_FUNCTION Smooth(const LevelOperator<CycleReal>& a, const ChebyshevSteps::Step& step, const Field& right, const Field& now,
                                const Field& before)
      : level(a), momentum(step.momentum), weight(step.weight), b(right), x(now), previous(before) {}
  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    const int c = level.index.cell(i, j, k);
    const auto here = value_at(x, c);
    set_value(previous, c,
              here + momentum * (here - value_at(previous, c)) + weight * level.inverse(c) * (value_at(b, c) - level.apply(x, c)));
  }
};

/// residual = b - A x where there is an unknown, zero elsewhere.
template <class Field>
struct LevelResidual {
  LevelOperator<CycleReal> level;
  Field b, x, residual;

  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    const int c = level.index.cell(i, j, k);
    const CycleReal unknown = level.inverse(c) > 0 ? CycleReal(1) : CycleReal(0);
    set_value(residual, c, unknown * (value_at(b, c) - level.apply(x, c)));
  }
};

/// x += what the coarse level found, the same for all cells joined in one.
template <class Field>
struct AddCorrection {
  IndexSpace index, coarse;
  Array<CycleReal> inverse;
  // Factors are 1 or 2: shifts of bits for divisions, which would keep the loop from vectorising.
  int b0, b1, b2, o0, o1, o2, t0, t1, t2;
  Field correction, x;

  KOKKOS_INLINE_FUNCTION AddCorrection(const MultigridLevel& level, const IndexSpace& coarser, const Field& found, const Field& result)
      : index(level.index), coarse(coarser), inverse(level.inverse), correction(found), x(result) {
    b0 = level.factor[0] - 1, b1 = level.factor[1] - 1, b2 = level.factor[2] - 1;
    o0 = level.factor[0] - level.shift[0], o1 = level.factor[1] - level.shift[1], o2 = level.factor[2] - level.shift[2];
    t0 = level.begin[0] - 1, t1 = level.begin[1] - 1, t2 = level.begin[2] - 1;
  }
  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    const int c = index.cell(i, j, k);
    const int from = coarse.cell(((i + o0) >> b0) + t0, ((j + o1) >> b1) + t1, ((k + o2) >> b2) + t2);
    const CycleReal unknown = inverse(c) > 0 ? CycleReal(1) : CycleReal(0);
    set_value(x, c, value_at(x, c) + unknown * value_at(correction, from));
  }
};

/// A pass over cells that leaves the layer of `field` beyond periodic sides of this rank's own valid as far as an operator reaches it.
template <class Body, class Field>
struct WithImages {
  Body body;
  IndexSpace index;
  bool wraps[3];
  int lower, upper;  // of the cells i of each line
  Field field;

  KOKKOS_FORCEINLINE_FUNCTION void operator()(int i, int j, int k) const {
    body(i, j, k);
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
    const int at[3] = {i, j, k}, c = index.cell(i, j, k);
    for (int d = 0; d < 3; ++d)
      if (wraps[d]) copy_to_image(d, at[d], c);
#endif
  }
  KOKKOS_FORCEINLINE_FUNCTION void copy_to_image(int d, int at, int c) const {
    const int around = index.n[d] * index.stride(d);
    if (at == 0) set_value(field, c + around, value_at(field, c));
    if (at == index.n[d] - 1) set_value(field, c - around, value_at(field, c));
  }
  /// On the host lines are vectorised: their images are made afterwards.
  KOKKOS_FORCEINLINE_FUNCTION void end_line(int j, int k) const {
    const int first = index.cell(0, j, k);
    if (wraps[0])
      for (int i = 0; i<index.n[0]; i += index.n[0]> 1 ? index.n[0] - 1 : 1) copy_to_image(0, i, first + i);
    const int at[3] = {0, j, k};
    for (int d = 1; d < 3; ++d)
      if (wraps[d] && (at[d] == 0 || at[d] == index.n[d] - 1))
        for (int i = lower; i < upper; ++i) copy_to_image(d, at[d], first + i);
  }
};

inline void compact_scalar(const IndexSpace& index, const Array<CycleReal>& field, const Array<double>& vector) {
  for_owned(
      "corpuscle::multigrid::to_vector", index,
      KOKKOS_LAMBDA(int i, int j, int k) { vector(index.compact(i, j, k)) = field(index.cell(i, j, k)); });
}

/// field = scale vector.
inline void spread_scalar(const IndexSpace& index, double scale, const Array<double>& vector, const Array<CycleReal>& field) {
  for_owned(
      "corpuscle::multigrid::from_vector", index,
      KOKKOS_LAMBDA(int i, int j, int k) { field(index.cell(i, j, k)) = scale * vector(index.compact(i, j, k)); });
}

/// Matrix rows for hypre, 7 entries each in the order of RowPattern; cells without an unknown get a unit diagonal.
inline void level_rows(const MultigridLevel& level, const Table<double>& value) {
  const IndexSpace index = level.index;
  for_owned(
      "corpuscle::multigrid::rows", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), r = index.compact(i, j, k);
        value(r, 0) = level.inverse(c) > 0 ? level.diagonal(c) : CycleReal(1);
        for (int d = 0; d < 3; ++d) {
          value(r, 3 - d) = -level.conductance[d](c);
          value(r, 4 + d) = -level.conductance[d](c + index.stride(d));
        }
      });
}

template <class Real>
double owned_dot(const IndexSpace& index, const Array<double>& a, const Array<Real>& b) {
  return sum_owned(
      "corpuscle::multigrid::dot", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        return a(c) * b(c);
      });
}

}  // namespace corpuscle
