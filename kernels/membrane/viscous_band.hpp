// The matrix of a viscous membrane, factorised cell by cell. It is all but singular in all that bends a membrane without stretching it,
// which takes conjugate gradients as many iterations as there are vertices; in an order in which neighbours stand close to each
// other its band is narrow.
#pragma once

#include "membrane/viscosity.hpp"

namespace corpuscle {

/// Matrices of `teams` cells at a time, each team's in its own row. Blocks of 3 x 3, the lower half: column 3 p + a of the vertex in place
/// p begins at its own row and has stride() rows, of which the last are beyond the band where a > 0.
struct ViscousBand {
  int teams = 0;
  int width = 0;             // of the band: largest distance of neighbours' places, of all types
  Array<int> first_place;    // [type] into `place`
  Array<int> place;          // [type vertex]
  Table<double> column;      // [team, columns x stride()]
  Table<double> right_side;  // [team, 2 x columns] of the forces and of dV/dx, then the answers to them

  KOKKOS_INLINE_FUNCTION int stride() const { return 3 * width + 3; }
};

/// Solves for m.surface.v as HeldViscousSolve does; w.right_side, w.diagonal and the edges as assemble_viscous() leaves them.
template <class Damping>
struct BandedViscousSolve {
  MembraneViews m;
  ViscosityViews w;
  ViscousBand band;

  struct Cell {
    int number, first, vertices, place;
    double *column, *forces, *gradient;
  };

  KOKKOS_INLINE_FUNCTION int place_of(const Cell& cell, int vertex) const { return band.place(cell.place + vertex - cell.first); }

  /// Column a, row c of the block by which the damping of an edge couples its ends.
  KOKKOS_INLINE_FUNCTION static double coupling(const CellLaw& law, const Vec3& along, int a, int c) {
    Vec3 unit;
    unit[a] = 1;
    return Damping::force(law, unit, along)[c];
  }

  KOKKOS_INLINE_FUNCTION void assemble(const SectionTeam& team, const Cell& cell) const {
    const SurfaceSet& s = m.surface;
    const CellLaw law = m.law(m.type(cell.number));
    const int stride = band.stride();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, cell.vertices), [&](int n) {
      const int i = cell.first + n, p = place_of(cell, i);
      double* column[3];
      for (int a = 0; a < 3; ++a) {
        column[a] = cell.column + (3 * p + a) * stride;
        for (int k = 0; k < stride; ++k) column[a][k] = 0;
        column[a][0] = w.diagonal(i);
        cell.forces[3 * p + a] = w.right_side(i, a);
        cell.gradient[3 * p + a] = w.gradient(i, a);
      }
      const Vec3 here = load(s.x, i);
      for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
        const int j = w.neighbour(r), q = place_of(cell, j);
        const Vec3 along = w.inverse_length(r) * (load(s.x, j) - here);
        for (int a = 0; a < 3; ++a)
          for (int c = 0; c < 3; ++c) {
            const double value = w.times * coupling(law, along, a, c);
            if (c >= a) column[a][c - a] += value;
            if (q > p) column[a][3 * (q - p) + c - a] = -value;
          }
      }
    });
    team.team_barrier();
  }

  /// Cholesky's, three columns at a time. @returns whether the matrix is positive definite
  KOKKOS_INLINE_FUNCTION bool factorise(const SectionTeam& team, const Cell& cell) const {
    const int stride = band.stride();
    bool definite = true;
    for (int p = 0; p < cell.vertices; ++p) {
      const int left = 3 * (cell.vertices - p), rows = left < stride ? left : stride;  // from row 3 p on
      double* const a = cell.column + 3 * p * stride;
      double* const b = a + stride - 1;  // so that b[i] and c[i] are in row 3 p + i, as a[i] is
      double* const c = b + stride - 1;
      double* const of[3] = {a, b, c};
      for (int d = 0; d < 3; ++d) {
        double* const own = of[d];
        definite = definite && own[d] > 0;
        const double inverse = 1 / std::sqrt(own[d]);
        team.team_barrier();
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, d, rows), [&](int i) { own[i] *= inverse; });
        team.team_barrier();
        for (int e = d + 1; e < 3; ++e) {
          double* const next = of[e];
          const double factor = own[e];
          Kokkos::parallel_for(Kokkos::TeamThreadRange(team, e, rows), [&](int i) { next[i] -= factor * own[i]; });
        }
        team.team_barrier();
      }
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
      const int side = rows - 3;  // threads beside each other have neighbouring rows of a column
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, side * side), [&](int n) {
        const int i = 3 + n / side, k = 3 + n % side;
        if (k >= i) cell.column[(3 * p + i) * stride + k - i] -= a[i] * a[k] + b[i] * b[k] + c[i] * c[k];
      });
#else
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, 3, rows), [&](int i) {
        double* const trailing = cell.column + (3 * p + i) * stride - i;
        const double of_a = a[i], of_b = b[i], of_c = c[i];
        const auto subtract = [=](int k) { trailing[k] -= of_a * a[k] + of_b * b[k] + of_c * c[k]; };
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
        for (int k = i; k < rows; ++k) subtract(k);
      });
#endif
      team.team_barrier();
    }
    return definite;
  }

  /// Both answers at once.
  KOKKOS_INLINE_FUNCTION void substitute(const SectionTeam& team, const Cell& cell) const {
    const int stride = band.stride(), columns = 3 * cell.vertices;
    double *const f = cell.forces, *const g = cell.gradient;
    for (int j = 0; j < columns; ++j) {
      const double* const own = cell.column + j * stride;
      const int end = 3 * (j / 3) + stride, rows = (end < columns ? end : columns) - j;
      const double y = f[j] / own[0], z = g[j] / own[0];
      team.team_barrier();
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, rows), [&](int k) {
        f[j + k] = k == 0 ? y : f[j + k] - own[k] * y;
        g[j + k] = k == 0 ? z : g[j + k] - own[k] * z;
      });
      team.team_barrier();
    }
    for (int j = columns - 1; j >= 0; --j) {
      const double* const own = cell.column + j * stride;
      const int end = 3 * (j / 3) + stride, rows = (end < columns ? end : columns) - j;
      Sums<2> known;
      Kokkos::parallel_reduce(
          Kokkos::TeamThreadRange(team, 1, rows),
          [&](int k, Sums<2>& part) {
            part[0] += own[k] * f[j + k];
            part[1] += own[k] * g[j + k];
          },
          known);
      team.team_barrier();
      Kokkos::single(Kokkos::PerTeam(team), [&]() {
        f[j] = (f[j] - known[0]) / own[0];
        g[j] = (g[j] - known[1]) / own[0];
      });
      team.team_barrier();
    }
  }

  KOKKOS_INLINE_FUNCTION void solve(const SectionTeam& team, const Cell& cell) const {
    assemble(team, cell);
    const bool definite = factorise(team, cell);
    substitute(team, cell);
    Sums<2> through;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, cell.vertices),
        [&](int n, Sums<2>& part) {
          const int i = cell.first + n, p = 3 * place_of(cell, i);
          for (int a = 0; a < 3; ++a) {
            part[0] += w.gradient(i, a) * cell.forces[p + a];
            part[1] += w.gradient(i, a) * cell.gradient[p + a];
          }
        },
        through);
    const double pressure = through[0] / through[1];
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, cell.vertices), [&](int n) {
      const int i = cell.first + n, p = 3 * place_of(cell, i);
      for (int a = 0; a < 3; ++a) m.surface.v(i, a) = cell.forces[p + a] - pressure * cell.gradient[p + a];
    });
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      w.iterations(cell.number) = 1;
      if (!definite) Kokkos::atomic_fetch_max(&m.status(0), cell.number + 1);
    });
    team.team_barrier();
  }

  KOKKOS_INLINE_FUNCTION void operator()(const SectionTeam& team) const {
    const int t = team.league_rank();
    for (int number = m.first_cell + t; number < m.first_cell + m.cells; number += band.teams) {
      const int first = m.surface.first_vertex(number), vertices = m.surface.first_vertex(number + 1) - first;
      solve(team, {number, first, vertices, band.first_place(m.type(number)), &band.column(t, 0), &band.right_side(t, 0),
                   &band.right_side(t, 3 * vertices)});
    }
  }
};

/// As solve_held().
template <class Damping>
void solve_held(const MembraneViews& m, const ViscosityViews& w, const ViscousBand& band) {
  const BandedViscousSolve<Damping> solve{m, w, band};
  Kokkos::parallel_for("corpuscle::membrane::viscous_solve", large_teams(band.teams, solve), solve);
}

}  // namespace corpuscle
