// Levels of few cells, on which one team does all that a cycle has to do there in one launch: a launch takes as long as a pass over
// some thousand cells.
#pragma once

#include "fluid/band_solver.hpp"

namespace corpuscle {

/// What solves a coarsest level directly: by its factors, or by its inverse (on devices, where one sweep after the other through a band,
/// row by row, waits for memory all the time).
struct DirectLevel {
  BandSystem band;
  Table<double> inverse;  // without values: by the factors
};

template <class Field>
struct SmallLevel {
  MultigridLevel views;
  Field b, x, y;
};

/// Of one rank alone, whole, one coarser than the other. Vectors as in MultigridCycle.
template <class Field>
struct SmallLevels {
  static constexpr int most = 6, most_cells = 8192, most_steps = 4;

  int count = 0;  // how many the cycle uses
  SmallLevel<Field> level[most];
  int steps = 0;
  ChebyshevSteps::Step step[most_steps];
  bool direct = false;  // whether the last of them is solved by `coarsest`
  DirectLevel coarsest;
};

/// What runs over the cells of a level one after the other, as one team.
template <class Member>
struct TeamCells {
  const Member& team;

  template <class Body>
  KOKKOS_INLINE_FUNCTION void run(int n, const Body& body) const {
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, n), body);
    team.team_barrier();
  }
  template <class Body>
  KOKKOS_INLINE_FUNCTION void owned(const IndexSpace& index, const Body& body) const {
    run(index.owned(), [&](int e) { index.visit_compact(e, body); });
  }
  template <class Body>
  KOKKOS_INLINE_FUNCTION void rounded(const IndexSpace& index, const Body& body) const {
    owned(index, body);
  }
  KOKKOS_INLINE_FUNCTION void solve(const DirectLevel& a, const Array<CycleReal>& b, const Array<CycleReal>& x) const {
    run(a.band.rows, [&](int row) { apply_inverse(a.band, a.inverse, b, x, row); });
  }
};

#if !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)
/// The same by the thread that calls.
struct OwnCells {
  template <class Body>
  void run(int n, const Body& body) const {
    for (int e = 0; e < n; ++e) body(e);
  }
  template <class Body>
  void owned(const IndexSpace& index, const Body& body) const {
    run_lines({0, 0, 0}, {index.n[0], index.n[1], index.n[2]}, 0, 1, body);
  }
  template <class Body>
  void rounded(const IndexSpace& index, const Body& body) const {
    run_lines({0, 0, 0}, {(index.n[0] + 3) / 4 * 4, index.n[1], index.n[2]}, 0, 1, body);
  }
  void solve(const DirectLevel& a, const Array<CycleReal>& b, const Array<CycleReal>& x) const {
    if (!a.inverse.data()) return solve_band(OwnLanes(), a.band, b, x);
    run(a.band.rows, [&](int row) { apply_inverse(a.band, a.inverse, b, x, row); });
  }
};
#endif

/// The layer of x beyond periodic sides, as far as an operator reaches it.
template <class Cells, class Field>
KOKKOS_INLINE_FUNCTION void wrap_level(const Cells& cells, const IndexSpace& index, const Field& x) {
  for (int d = 0; d < 3; ++d) {
    if (!index.periodic[d]) continue;
    const int e = d == 0 ? 1 : 0, f = d == 2 ? 1 : 2;
    const int stride = index.stride(d), n = index.n[d], wide = index.n[e], along = index.stride(e), across = index.stride(f);
    const int first = index.cell(0, 0, 0);
    cells.run(wide * index.n[f], [&](int q) {
      const int c = first + q % wide * along + q / wide * across;
      set_value(x, c - stride, value_at(x, c + (n - 1) * stride));
      set_value(x, c + n * stride, value_at(x, c));
    });
  }
}

/// Steps number `from` to `to` of the smoothing. @returns whether x and y have changed places
template <class Cells, class Field>
KOKKOS_INLINE_FUNCTION bool smooth_level(const Cells& cells, const SmallLevels<Field>& s, const SmallLevel<Field>& level, int from, int to,
                                         bool changed) {
  for (int n = from; n < to; ++n, changed = !changed) {
    const Field &x = changed ? level.y : level.x, &y = changed ? level.x : level.y;
    wrap_level(cells, level.views.index, x);
    cells.rounded(level.views.index, Smooth<Field>(level.views, s.step[n], level.b, x, y));
  }
  return changed;
}

/// x of the first level = one cycle for its b.
template <class Cells, class Field>
KOKKOS_INLINE_FUNCTION void cycle_small_levels(const Cells& cells, const SmallLevels<Field>& s) {
  const int last = s.count - 1;
  const auto solved = [&](int l) { return l == last && s.direct; };
  for (int l = 0; l <= last; ++l) {
    const SmallLevel<Field>& level = s.level[l];
    if (solved(l)) {
      if constexpr (static_cast<int>(Field::rank) == 1) cells.solve(s.coarsest, level.b, level.x);
      break;
    }
    wrap_level(cells, level.views.index, level.b);
    cells.rounded(level.views.index, SmoothFromZero<Field>(level.views, s.step[0], s.step[1], level.b, level.y, level.x));
    const bool changed = smooth_level(cells, s, level, 2, s.steps, false);
    if (l == last) break;
    const Field &x = changed ? level.y : level.x, &y = changed ? level.x : level.y;
    wrap_level(cells, level.views.index, x);
    cells.rounded(level.views.index, LevelResidual<Field>{level.views, level.b, x, y});
    cells.owned(level.views.part, RestrictSums<Field>{level.views, s.level[l + 1].views.index, y, s.level[l + 1].b});
  }
  for (int l = last; l >= 0; --l) {
    if (solved(l)) continue;
    const SmallLevel<Field>& level = s.level[l];
    const bool changed = s.steps % 2 != 0;
    if (l < last)
      cells.rounded(level.views.index,
                    AddCorrection<Field>(level.views, s.level[l + 1].views.index, s.level[l + 1].x, changed ? level.y : level.x));
    smooth_level(cells, s, level, 0, s.steps, changed);
  }
  wrap_level(cells, s.level[0].views.index, s.level[0].x);
}

template <class Field>
void run_small_levels(const SmallLevels<Field>& levels) {
  const SmallLevels<Field> s = levels;
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  using Team = Kokkos::TeamPolicy<Exec, WithLaunch>;
  Kokkos::parallel_for(
      cycle_label<Field>("small_levels"), Team(1, Kokkos::AUTO),
      KOKKOS_LAMBDA(const typename Team::member_type& team) { cycle_small_levels(TeamCells<typename Team::member_type>{team}, s); });
#else
  Kokkos::parallel_for(cycle_label<Field>("small_levels"), Kokkos::RangePolicy<CallingThread>(0, 1),
                       [=](int) CORPUSCLE_INLINE_ALL { cycle_small_levels(OwnCells(), s); });
#endif
}

}  // namespace corpuscle
