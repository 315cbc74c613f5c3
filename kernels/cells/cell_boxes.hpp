// Where whole cells are.
#pragma once

#include "common/extremes.hpp"
#include "common/sums.hpp"
#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

/// Columns of the table of boxes.
struct BoxColumn {
  static constexpr int lower = 0, upper = 3, mean = 6, count = 9;  // um; the mean is of the vertices, at present
};

/// Boxes around the first cells of a set, each at present and where its velocity brings it in `ahead_us`.
inline void measure_boxes(const SurfaceSet& set, int cells, double ahead_us, const Table<double>& boxes) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const auto x = set.x, v = set.v;
  const auto first_vertex = set.first_vertex;
  Kokkos::parallel_for(
      "corpuscle::cells::measure_boxes", Kokkos::TeamPolicy<Exec>(cells, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int cell = team.league_rank(), begin = first_vertex(cell), end = first_vertex(cell + 1);
        Sums<3> sum;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, begin, end),
            [&](int i, Sums<3>& part) {
              for (int d = 0; d < 3; ++d) part[d] += x(i, d);
            },
            sum);
        for (int d = 0; d < 3; ++d) {
          double low = 0, high = 0;
          Kokkos::parallel_reduce(
              Kokkos::TeamThreadRange(team, begin, end),
              [&](int i, double& least) { least = smaller(least, smaller(x(i, d), x(i, d) + ahead_us * v(i, d))); }, Smallest(low));
          Kokkos::parallel_reduce(
              Kokkos::TeamThreadRange(team, begin, end),
              [&](int i, double& most) { most = larger(most, larger(x(i, d), x(i, d) + ahead_us * v(i, d))); }, Largest(high));
          Kokkos::single(Kokkos::PerTeam(team), [&]() {
            boxes(cell, BoxColumn::lower + d) = low;
            boxes(cell, BoxColumn::upper + d) = high;
            boxes(cell, BoxColumn::mean + d) = sum[d] / (end - begin);
          });
        }
      });
}

/// Whether any cell's box reaches further than `skin` beyond what it was, and whether any cell's mean is further beyond a periodic
/// side than a share of the period.
struct Departures {
  bool box = false, mean = false;
};

/// Along a period: how far a place is from the frame's origin, in periods.
KOKKOS_INLINE_FUNCTION double periods_from_origin(const PeriodicFrame& frame, const Vec3& place, int d) {
  return dot(place - frame.origin, frame.dual[d]);
}

inline Departures find_departures(int cells, const Table<double>& now, const Table<double>& before, double skin, const PeriodicFrame& frame,
                                  double share) {
  Sums<2> left;
  Kokkos::parallel_reduce(
      "corpuscle::cells::find_departures", Policy(0, cells),
      KOKKOS_LAMBDA(int cell, Sums<2>& sum) {
        bool within = true;  // false for what is not a number
        Vec3 mean;
        for (int d = 0; d < 3; ++d) {
          within = within && now(cell, BoxColumn::lower + d) >= before(cell, BoxColumn::lower + d) - skin &&
                   now(cell, BoxColumn::upper + d) <= before(cell, BoxColumn::upper + d) + skin;
          mean[d] = now(cell, BoxColumn::mean + d);
        }
        sum[0] += within ? 0 : 1;
        for (int d = 0; d < 3; ++d) {
          const double along = periods_from_origin(frame, mean, d);
          if (frame.periodic[d] && (along < -share || along >= 1 + share)) sum[1] += 1;
        }
      },
      left);
  return {left[0] > 0, left[1] > 0};
}

/// Moves the first cells of a set. @param shift  [cell, 3] um
inline void shift_cells(const SurfaceSet& set, int vertices, const Table<double>& shift) {
  const auto x = set.x;
  const auto body = set.vertex_body;
  Kokkos::parallel_for(
      "corpuscle::cells::shift_cells", Policy(0, vertices), KOKKOS_LAMBDA(int i) {
        for (int d = 0; d < 3; ++d) {
          if (shift(body(i), d) != 0) x(i, d) -= shift(body(i), d);
        }
      });
}

}  // namespace corpuscle
