// A multigrid level of few cells, solved directly by one team: L D L^T of a band matrix.
#pragma once

#include "fluid/multigrid.hpp"

namespace corpuscle {

/// Rows are the level's owned cells in an order in which neighbours are at most `width` apart.
struct BandSystem {
  int rows = 0, width = 0;
  Array<int> cell;        // [row] of the level
  Table<int> neighbour;   // [row, 6] row beyond the low and the high face of each direction, -1 for none
  Table<double> lower;    // [rows + width, width + 1] (j, d): row j + d of column j of L; before factorising, of the matrix
  Table<double> upper;    // [rows, width + 1] (j, d): column j - d of row j of L
  Array<double> inverse;  // [rows] of D; before factorising, the matrix's diagonal
  Array<double> x;        // [rows + 2 width], row r at width + r, zero beyond the rows
};

/// The level's matrix; cells without an unknown get a unit diagonal.
inline void assemble_band(const MultigridLevel& level, const BandSystem& band) {
  const BandSystem out = band;
  Kokkos::parallel_for(
      "corpuscle::multigrid::assemble_band", Policy(0, out.rows + out.width), KOKKOS_LAMBDA(int r) {
        for (int d = 0; d <= out.width; ++d) out.lower(r, d) = 0;
        if (r >= out.rows) return;
        const int c = out.cell(r);
        double diagonal = level.inverse(c) > 0 ? level.diagonal(c) : CycleReal(1);
        for (int side = 0; side < 6; ++side) {
          const int d = side / 2, beyond = out.neighbour(r, side);
          if (beyond < r) continue;
          const double g = level.conductance[d](side % 2 == 0 ? c : c + level.index.stride(d));
          if (beyond == r)
            diagonal -= g;
          else
            out.lower(r, beyond - r) -= g;
        }
        out.lower(r, 0) = out.inverse(r) = diagonal;
      });
}

/// The pivot of row j, or the whole diagonal where nothing but round-off is left of it: what is joined to nothing whose value
/// is given has no solution, and any will do.
KOKKOS_INLINE_FUNCTION double band_pivot(const BandSystem& band, int j) {
  constexpr double least = 1e-5;  // conductances are of single precision
  return band.lower(j, 0) > least * band.inverse(j) ? band.lower(j, 0) : band.inverse(j);
}

constexpr int band_lanes = 32;  // of a warp; processors take their vectors' length

inline void factorise_band(const BandSystem& band) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const BandSystem a = band;
  Kokkos::parallel_for(
      "corpuscle::multigrid::factorise_band", Team(1, Kokkos::AUTO, band_lanes), KOKKOS_LAMBDA(const Team::member_type& team) {
        for (int j = 0; j < a.rows; ++j) {
          const double pivot = band_pivot(a, j);
          Kokkos::parallel_for(Kokkos::TeamThreadRange(team, a.width), [&](int n) {
            const double factor = a.lower(j, n + 1) / pivot;
            if (factor == 0) return;
            double* column = &a.lower(j + n + 1, 0);
            const double* from = &a.lower(j, n + 1);
            Kokkos::parallel_for(Kokkos::ThreadVectorRange(team, a.width - n), [&](int d) { column[d] -= factor * from[d]; });
          });
          team.team_barrier();
        }
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, a.rows), [&](int j) {
          const double inverse = 1 / band_pivot(a, j);
          Kokkos::parallel_for(Kokkos::ThreadVectorRange(team, a.width), [&](int d) { a.lower(j, d + 1) *= inverse; });
          Kokkos::single(Kokkos::PerThread(team), [&]() { a.inverse(j) = inverse; });
        });
        team.team_barrier();
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, a.rows), [&](int j) {
          Kokkos::parallel_for(Kokkos::ThreadVectorRange(team, a.width),
                               [&](int d) { a.upper(j, d + 1) = j > d ? a.lower(j - d - 1, d + 1) : 0.0; });
        });
      });
}

/// The lanes of a team of one thread.
struct TeamLanes {
  const Kokkos::TeamPolicy<Exec>::member_type& team;

  template <class Body>
  KOKKOS_INLINE_FUNCTION void run(int n, const Body& body) const {
    Kokkos::parallel_for(Kokkos::ThreadVectorRange(team, n), body);
  }
  KOKKOS_INLINE_FUNCTION void wait() const { team.team_barrier(); }
};

/// Those of the processor that calls.
struct OwnLanes {
  template <class Body>
  void run(int n, const Body& body) const {
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
    for (int i = 0; i < n; ++i) body(i);
  }
  void wait() const {}
};

/// Both sweeps through the factors, and what is between them, over y, [row] and `width` more on either side that are zero. They
/// add multiples of columns: their order is fixed, so the answer is the same on any number of lanes.
template <class Lanes>
KOKKOS_INLINE_FUNCTION void sweep_band(const Lanes& lanes, const BandSystem& a, double* y) {
  for (int j = 0; j < a.rows; ++j) {
    const double known = y[j];
    const double* column = &a.lower(j, 1);
    double* next = y + j + 1;
    lanes.run(a.width, [&](int d) { next[d] -= known * column[d]; });
    lanes.wait();
  }
  lanes.run(a.rows, [&](int r) { y[r] *= a.inverse(r); });
  lanes.wait();
  for (int j = a.rows - 1; j > 0; --j) {
    const double known = y[j];
    const double* row = &a.upper(j, 1);
    double* before = y + j - 1;
    lanes.run(a.width, [&](int d) { before[-d] -= known * row[d]; });
    lanes.wait();
  }
}

/// x = the solution for b, both [cell] of the level, by a processor.
template <class Lanes>
void solve_band(const Lanes& lanes, const BandSystem& a, const Array<CycleReal>& b, const Array<CycleReal>& x) {
  double* y = &a.x(a.width);
  lanes.run(a.rows, [&](int r) { y[r] = b(a.cell(r)); });
  sweep_band(lanes, a, y);
  lanes.run(a.rows, [&](int r) { x(a.cell(r)) = y[r]; });
}

/// The inverse of a factorised system, [row, width + row], with `width` zeros on either side of each row: as many sweeps as
/// there are rows, all at once.
inline void invert_band(const BandSystem& band, const Table<double>& inverse) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const BandSystem a = band;
  Kokkos::parallel_for(
      "corpuscle::multigrid::invert_band", Team(a.rows, 1, band_lanes), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int row = team.league_rank();
        double* y = &inverse(row, a.width);
        Kokkos::parallel_for(Kokkos::ThreadVectorRange(team, a.rows), [&](int r) { y[r] = r == row ? 1 : 0; });
        team.team_barrier();
        sweep_band(TeamLanes{team}, a, y);
      });
}

/// The row of x = the inverse times b, both [cell] of the level. The inverse is symmetric: threads with rows side by side read side by
/// side.
KOKKOS_INLINE_FUNCTION void apply_inverse(const BandSystem& a, const Table<double>& inverse, const Array<CycleReal>& b,
                                          const Array<CycleReal>& x, int row) {
  double sum = 0;
  for (int r = 0; r < a.rows; ++r) sum += inverse(r, a.width + row) * b(a.cell(r));
  x(a.cell(row)) = sum;
}

}  // namespace corpuscle
