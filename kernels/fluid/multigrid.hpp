// Geometric multigrid for the pressure equation of an orthogonal grid: cells are joined in pairs along the directions
// that couple most strongly, and conductances of coarse faces are those of the fine faces on them, in parallel. A cycle
// works in single precision, half the memory and twice the lanes of double: what that leaves, the conjugate gradients
// around it, in double, take out with the rest.
#pragma once

#include "common/chebyshev.hpp"
#include "fluid/masked_gradient.hpp"
#include "grid/halo_copy.hpp"

namespace corpuscle {

using CycleReal = float;

/// One level. A x at cell c is diagonal(c) x(c) minus the sum over its faces of conductance times x beyond the face;
/// x is zero beyond physical boundaries. Cells without an unknown have no conductances, and inverse = 0.
template <class Real>
struct LevelOperator {
  IndexSpace index;
  Array<Real> conductance[3];  // [cell] of the face between cell - stride(d) and cell
  Array<Real> diagonal, inverse;

  KOKKOS_INLINE_FUNCTION Real apply(const Array<Real>& x, int c) const {
    const int s1 = index.stride(1), s2 = index.stride(2);
    return diagonal(c) * x(c) - conductance[0](c) * x(c - 1) - conductance[0](c + 1) * x(c + 1) -
           conductance[1](c) * x(c - s1) - conductance[1](c + s1) * x(c + s1) - conductance[2](c) * x(c - s2) -
           conductance[2](c + s2) * x(c + s2);
  }
};

/// The same for the cycle, and how it is coarsened.
struct MultigridLevel : LevelOperator<CycleReal> {
  int factor[3] = {1, 1, 1};     // cells of this level in one of the next coarser, along each direction
  bool open[3][2] = {};          // whether another rank's or a periodic image's cells lie beyond a side
};

/// Conductances of the finest level: those of faces whose both nodes have a pressure.
inline void mask_conductances(const Array<double> (&coefficient)[3], const PressureMask& mask,
                              const LevelOperator<double>& level) {
  const IndexSpace index = level.index;
  for (int d = 0; d < 3; ++d) {
    const auto g = level.conductance[d], from = coefficient[d];
    const int stride = index.stride(d);
    std::array<int, 3> upper{index.n[0], index.n[1], index.n[2]};
    upper[d] += 1;
    for_box("corpuscle::multigrid::conductance", {0, 0, 0}, upper, KOKKOS_LAMBDA(int i, int j, int k) {
      const int c = index.cell(i, j, k);
      g(c) = mask(c) && mask(c - stride) ? from(c) : 0.0;
    });
  }
}

/// The finest level of the cycle.
inline void round_operator(const LevelOperator<double>& from, const MultigridLevel& to) {
  const auto f0 = from.conductance[0], f1 = from.conductance[1], f2 = from.conductance[2];
  const auto t0 = to.conductance[0], t1 = to.conductance[1], t2 = to.conductance[2];
  Kokkos::parallel_for("corpuscle::multigrid::round", Policy(0, from.index.size()), KOKKOS_LAMBDA(int c) {
    t0(c) = f0(c), t1(c) = f1(c), t2(c) = f2(c);
    to.diagonal(c) = from.diagonal(c);
    to.inverse(c) = from.inverse(c);
  });
}

/// Cells of the finer level in coarse cell C along d.
KOKKOS_INLINE_FUNCTION int children(const MultigridLevel& fine, int d, int coarse) {
  const int first = fine.factor[d] * coarse, rest = fine.index.n[d] - first;
  return rest < fine.factor[d] ? rest : fine.factor[d];
}

/// Conductances of the next coarser level. The distance between cell centres along a joined direction grows, so a
/// conductance is divided by the mean number of cells joined on its two sides; the cells beyond an open side count as
/// two, so that both sides' owners agree.
inline void coarsen_conductances(const MultigridLevel& fine, const MultigridLevel& coarse) {
  const IndexSpace index = coarse.index, fine_index = fine.index;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    const auto g = coarse.conductance[d];
    std::array<int, 3> upper{index.n[0], index.n[1], index.n[2]};
    upper[d] += 1;
    for_box("corpuscle::multigrid::coarsen", {0, 0, 0}, upper, KOKKOS_LAMBDA(int i, int j, int k) {
      const int at[3] = {i, j, k};
      int first[3];
      for (int m = 0; m < 3; ++m) first[m] = fine.factor[m] * at[m];
      const bool low = at[d] == 0, high = at[d] == index.n[d];
      if (high) first[d] = fine_index.n[d];
      CycleReal cells = 1;
      if (fine.factor[d] > 1) {
        const int above = high ? 0 : children(fine, d, at[d]), below = low ? 0 : children(fine, d, at[d] - 1);
        if (low)
          cells = fine.open[d][0] ? 2 : above;
        else if (high)
          cells = fine.open[d][1] ? 2 : below;
        else
          cells = CycleReal(0.5) * (above + below);
      }
      const int c = fine_index.cell(first[0], first[1], first[2]);
      CycleReal sum = 0;
      for (int b = 0; b < children(fine, f, at[f]); ++b)
        for (int a = 0; a < children(fine, e, at[e]); ++a)
          sum += fine.conductance[d](c + a * fine_index.stride(e) + b * fine_index.stride(f));
      g(index.cell(i, j, k)) = sum / cells;
    });
  }
}

/// Diagonals. `pinned` (padded cell number, -1 for none) gets `extra` on top, which fixes the level of an all-Neumann
/// problem.
template <class Real>
void level_diagonals(const LevelOperator<Real>& level, int pinned, Real extra) {
  const IndexSpace index = level.index;
  for_owned("corpuscle::multigrid::diagonal", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    Real sum = 0;
    for (int d = 0; d < 3; ++d) sum += level.conductance[d](c) + level.conductance[d](c + index.stride(d));
    if (c == pinned) sum += extra;
    level.diagonal(c) = sum;
    level.inverse(c) = sum > 0 ? 1 / sum : Real(0);
  });
}

/// Sum of the conductances along d over owned cells: how strongly that direction couples.
inline double sum_conductances(const MultigridLevel& level, int d) {
  const IndexSpace index = level.index;
  const auto g = level.conductance[d];
  return sum_owned("corpuscle::multigrid::strength", index,
                   KOKKOS_LAMBDA(int i, int j, int k) { return g(index.cell(i, j, k)); });
}

/// previous, x = the first and the second Chebyshev iterate from zero.
inline void smooth_from_zero(const MultigridLevel& level, const ChebyshevSteps::Step& first,
                             const ChebyshevSteps::Step& second, const Array<CycleReal>& b,
                             const Array<CycleReal>& previous, const Array<CycleReal>& x) {
  const IndexSpace index = level.index;
  const double w0 = first.weight, w1 = second.weight, m1 = second.momentum;
  const CycleReal of_first = w0, of_own = w0 + m1 * w0 + w1 - w1 * w0, of_others = w1 * w0;
  const auto inverse = level.inverse;
  const auto g0 = level.conductance[0], g1 = level.conductance[1], g2 = level.conductance[2];
  const int s1 = index.stride(1), s2 = index.stride(2);
  for_owned("corpuscle::multigrid::smooth_from_zero", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const CycleReal scaled = inverse(c) * b(c);
    const CycleReal around = g0(c) * inverse(c - 1) * b(c - 1) + g0(c + 1) * inverse(c + 1) * b(c + 1) +
                          g1(c) * inverse(c - s1) * b(c - s1) + g1(c + s1) * inverse(c + s1) * b(c + s1) +
                          g2(c) * inverse(c - s2) * b(c - s2) + g2(c + s2) * inverse(c + s2) * b(c + s2);
    previous(c) = of_first * scaled;
    // D^-1 A x1 = w0 (scaled - inverse * around), since D^-1 D = 1 where there is an unknown and scaled = 0 elsewhere
    x(c) = of_own * scaled + of_others * inverse(c) * around;
  });
}

/// previous = x + momentum (x - previous) + weight D^-1 (b - A x): the next iterate takes the place of the one before.
inline void smooth(const MultigridLevel& level, const ChebyshevSteps::Step& step, const Array<CycleReal>& b,
                   const Array<CycleReal>& x, const Array<CycleReal>& previous) {
  const IndexSpace index = level.index;
  const CycleReal momentum = step.momentum, weight = step.weight;
  for_owned("corpuscle::multigrid::smooth", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    previous(c) = x(c) + momentum * (x(c) - previous(c)) + weight * level.inverse(c) * (b(c) - level.apply(x, c));
  });
}

/// residual = b - A x where there is an unknown, zero elsewhere; then coarse_b = its sums over the joined cells.
inline void restrict_residual(const MultigridLevel& level, const IndexSpace& coarse, const Array<CycleReal>& b,
                              const Array<CycleReal>& x, const Array<CycleReal>& residual,
                              const Array<CycleReal>& coarse_b) {
  const IndexSpace index = level.index;
  for_owned("corpuscle::multigrid::residual", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const CycleReal left = b(c) - level.apply(x, c);
    residual(c) = level.inverse(c) > 0 ? left : CycleReal(0);
  });
  for_owned("corpuscle::multigrid::restrict", coarse, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(level.factor[0] * i, level.factor[1] * j, level.factor[2] * k);
    CycleReal sum = 0;
    for (int n2 = 0; n2 < children(level, 2, k); ++n2)
      for (int n1 = 0; n1 < children(level, 1, j); ++n1)
        for (int n0 = 0; n0 < children(level, 0, i); ++n0)
          sum += residual(c + n0 + n1 * index.stride(1) + n2 * index.stride(2));
    coarse_b(coarse.cell(i, j, k)) = sum;
  });
}

/// x += what the coarse level found, the same for all cells joined in one.
inline void add_correction(const MultigridLevel& level, const IndexSpace& coarse, const Array<CycleReal>& correction,
                           const Array<CycleReal>& x) {
  const IndexSpace index = level.index;
  for_owned("corpuscle::multigrid::prolong", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const CycleReal found = correction(coarse.cell(i / level.factor[0], j / level.factor[1], k / level.factor[2]));
    x(c) += level.inverse(c) > 0 ? found : CycleReal(0);
  });
}

inline void compact_scalar(const IndexSpace& index, const Array<CycleReal>& field, const Array<double>& vector) {
  for_owned("corpuscle::multigrid::to_vector", index, KOKKOS_LAMBDA(int i, int j, int k) {
    vector(index.compact(i, j, k)) = field(index.cell(i, j, k));
  });
}

/// field = scale vector.
inline void spread_scalar(const IndexSpace& index, double scale, const Array<double>& vector,
                          const Array<CycleReal>& field) {
  for_owned("corpuscle::multigrid::from_vector", index, KOKKOS_LAMBDA(int i, int j, int k) {
    field(index.cell(i, j, k)) = scale * vector(index.compact(i, j, k));
  });
}

/// Matrix rows for hypre, 7 entries each in the order of RowPattern; cells without an unknown get a unit diagonal.
inline void level_rows(const MultigridLevel& level, const Table<double>& value) {
  const IndexSpace index = level.index;
  for_owned("corpuscle::multigrid::rows", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k), r = index.compact(i, j, k);
    value(r, 0) = level.inverse(c) > 0 ? level.diagonal(c) : CycleReal(1);
    for (int d = 0; d < 3; ++d) {
      value(r, 3 - d) = -level.conductance[d](c);
      value(r, 4 + d) = -level.conductance[d](c + index.stride(d));
    }
  });
}

/// out = A p; returns this rank's p . A p.
inline double apply_and_dot(const LevelOperator<double>& level, const Array<double>& p, const Array<double>& out) {
  const IndexSpace index = level.index;
  return sum_owned("corpuscle::multigrid::operator", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const double value = level.apply(p, c);
    out(c) = value;
    return p(c) * value;
  });
}

/// x += alpha p, r -= alpha q, both in double; returns this rank's r . r. `rounded` = `scale` r, for the cycle.
inline double advance_and_norm(const IndexSpace& index, double alpha, double scale, const Array<double>& p,
                               const Array<double>& q, const Array<double>& x, const Array<double>& r,
                               const Array<CycleReal>& rounded) {
  return sum_owned("corpuscle::multigrid::advance", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    x(c) += alpha * p(c);
    const double value = r(c) - alpha * q(c);
    r(c) = value;
    rounded(c) = scale * value;
    return value * value;
  });
}

template <class Real>
double owned_dot(const IndexSpace& index, const Array<double>& a, const Array<Real>& b) {
  return sum_owned("corpuscle::multigrid::dot", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    return a(c) * b(c);
  });
}

/// p = scale z + beta p on owned cells.
inline void new_direction(const IndexSpace& index, double beta, double scale, const Array<CycleReal>& z,
                          const Array<double>& p) {
  for_owned("corpuscle::multigrid::direction", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    p(c) = scale * z(c) + beta * p(c);
  });
}

}  // namespace corpuscle
