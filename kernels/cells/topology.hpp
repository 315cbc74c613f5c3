// Where the cells that a rank holds have their connectivity: in the tables of their types.
#pragma once

#include <utility>

#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Says of the bodies first <= body < last of `set`, whose first_vertex and first_triangle are given, which they are and where what is
/// alike has its places.
/// @param types   in whose tables, its bodies being the types, the places are
/// @param type    [body] of set
/// @param behind  so many vertices and triangles stand before those in the tables of set
inline void place_bodies(const SurfaceSet& types, const Array<int>& type, const SurfaceSet& set, int first, int last,
                         std::pair<int, int> behind = {0, 0}) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const SurfaceSet from = types, to = set;
  const int before_vertices = behind.first, before_triangles = behind.second;
  Kokkos::parallel_for(
      "corpuscle::cells::place_bodies", Kokkos::TeamPolicy<Exec>(last - first, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = first + team.league_rank(), v0 = to.first_vertex(body), t0 = to.first_triangle(body);
        const int vertices = to.first_vertex(body + 1) - v0, triangles = to.first_triangle(body + 1) - t0;
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, vertices), [&](int i) { to.vertex_body(v0 + i) = body; });
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, triangles), [&](int t) { to.triangle_body(t0 + t) = body; });
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          to.to_place(body, 0) = before_vertices + from.first_vertex(type(body)) - v0;
          to.to_place(body, 1) = before_triangles + from.first_triangle(type(body)) - t0;
          if (body + 1 < to.bodies) return;
          // Behind the last, whose place is the first of all, where rings start at zero.
          to.vertex_body(v0 + vertices) = body + 1;
          to.to_place(body + 1, 0) = -(v0 + vertices);
          to.to_place(body + 1, 1) = -(t0 + triangles);
        });
      });
}

/// Copies the tables of `from`, whose numbers are its places, into those of `to`, behind so many vertices and triangles.
inline void append_tables(const SurfaceSet& of, int before_vertices, int before_triangles, const SurfaceSet& into) {
  const SurfaceSet from = of, to = into;
  Kokkos::parallel_for(
      "corpuscle::cells::append_triangles", Policy(0, from.triangles), KOKKOS_LAMBDA(int t) {
        for (int k = 0; k < 3; ++k) {
          to.place_triangle(before_triangles + t, k) = before_vertices + from.place_triangle(t, k);
          to.place_neighbour(before_triangles + t, k) = before_triangles + from.place_neighbour(t, k);
          to.place_ring_triangle(3 * (before_triangles + t) + k) = before_triangles + from.place_ring_triangle(3 * t + k);
          to.place_ring_corner(3 * (before_triangles + t) + k) = from.place_ring_corner(3 * t + k);
        }
      });
  Kokkos::parallel_for(
      "corpuscle::cells::append_rings", Policy(0, from.vertices + 1),
      KOKKOS_LAMBDA(int i) { to.place_ring_start(before_vertices + i) = 3 * before_triangles + from.place_ring_start(i); });
}

}  // namespace corpuscle
