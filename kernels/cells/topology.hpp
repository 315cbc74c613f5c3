// The connectivity of the cells that a rank holds, from one template for each type.
#pragma once

#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Fills the numbering of vertices and triangles of the bodies first <= body < last of `set`, whose first_vertex and first_triangle are
/// given. @param types  its bodies are the types
/// @param type   [body] of set
inline void fill_topology(const SurfaceSet& types, const Array<int>& type, const SurfaceSet& set, int first, int last) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const SurfaceSet from = types, to = set;
  Kokkos::parallel_for(
      "corpuscle::cells::fill_topology", Kokkos::TeamPolicy<Exec>(last - first, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = first + team.league_rank(), v0 = to.first_vertex(body), t0 = to.first_triangle(body);
        const int from_v0 = from.first_vertex(type(body)), from_t0 = from.first_triangle(type(body));
        const int vertices = to.first_vertex(body + 1) - v0, triangles = to.first_triangle(body + 1) - t0;
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, vertices), [&](int i) {
          to.vertex_body(v0 + i) = body;
          to.ring_start(v0 + i) = from.ring_start(from_v0 + i) + 3 * (t0 - from_t0);
        });
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, triangles), [&](int t) {
          to.triangle_body(t0 + t) = body;
          for (int k = 0; k < 3; ++k) {
            to.triangle(t0 + t, k) = from.triangle(from_t0 + t, k) + v0 - from_v0;
            to.neighbour(t0 + t, k) = from.neighbour(from_t0 + t, k) + t0 - from_t0;
            to.ring_triangle(3 * (t0 + t) + k) = from.ring_triangle(3 * (from_t0 + t) + k) + t0 - from_t0;
            to.ring_corner(3 * (t0 + t) + k) = from.ring_corner(3 * (from_t0 + t) + k);
          }
        });
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          if (body + 1 == to.bodies) to.ring_start(v0 + vertices) = 3 * (t0 + triangles);
        });
      });
}

/// For the bodies of the vertices first <= i < last of `set`: shift [body] from their numbers to those of their templates, which begin at
/// `offset`, and the area [vertex] that they have there.
inline void fill_rest(const SurfaceSet& types, const Array<int>& type, const SurfaceSet& set, int first, int last, int offset,
                      const Array<int>& shift, const Array<double>& area) {
  const SurfaceSet from = types, to = set;
  Kokkos::parallel_for(
      "corpuscle::cells::fill_rest", Policy(first, last), KOKKOS_LAMBDA(int i) {
        const int body = to.vertex_body(i), by = from.first_vertex(type(body)) - to.first_vertex(body);
        if (i == to.first_vertex(body)) shift(body) = by + offset;
        area(i) = from.area(i + by);
      });
}

}  // namespace corpuscle
