// Bodies that have left a periodic domain come back at its other end.
#pragma once

#include "common/sums.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// The periodic directions of a domain. A point's coordinate along direction d, dot(x - origin, dual[d]), is within
/// [0, 1) inside the domain (roughly, where the domain's ends are not planes) and grows by one a period.
struct PeriodicFrame {
  bool periodic[3] = {false, false, false};
  Vec3 origin;              // um
  Vec3 period[3], dual[3];  // um, 1/um; zero along other directions
};

/// Move bodies first <= b < last as a whole by periods, so that the mean of each one's vertices lies in the domain.
/// laps [body, 3] counts the periods taken off since the start. With `from_start` the positions given are without any
/// taken off, else with those that laps holds. The search of a body that moves begins anew.
inline void wrap_bodies(const SurfaceSet& set, int first, int last, const PeriodicFrame& frame, bool from_start, int images,
                        const Array<Located>& status, const Table<int>& laps) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const auto x = set.x;
  const auto first_vertex = set.first_vertex;
  const int vertices = set.vertices;
  Kokkos::parallel_for(
      "corpuscle::surface::wrap_bodies", Kokkos::TeamPolicy<Exec>(last - first, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = first + team.league_rank(), begin = first_vertex(body), end = first_vertex(body + 1);
        Sums<3> sum;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, begin, end),
            [&](int i, Sums<3>& part) {
              for (int m = 0; m < 3; ++m) part[m] += x(i, m);
            },
            sum);
        const Vec3 from_origin = (1.0 / (end - begin)) * Vec3{sum[0], sum[1], sum[2]} - frame.origin;
        int turns[3] = {0, 0, 0};
        bool moved = false;
        Vec3 shift;
        for (int d = 0; d < 3; ++d) {
          if (!frame.periodic[d]) continue;
          turns[d] = static_cast<int>(std::floor(dot(from_origin, frame.dual[d])));
          moved = moved || turns[d] != (from_start ? laps(body, d) : 0);
          shift += static_cast<double>(turns[d]) * frame.period[d];
        }
        team.team_barrier();
        if (moved) {
          Kokkos::single(Kokkos::PerTeam(team), [&]() {
            for (int d = 0; d < 3; ++d) laps(body, d) = turns[d] + (from_start ? 0 : laps(body, d));
          });
          Kokkos::parallel_for(Kokkos::TeamThreadRange(team, begin, end), [&](int i) {
            for (int m = 0; m < images; ++m) status(m * vertices + i) = Located::failed;
          });
        }
        if (!moved && !from_start) return;
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, begin, end), [&](int i) { store(x, i, load(x, i) - shift); });
      });
}

}  // namespace corpuscle
