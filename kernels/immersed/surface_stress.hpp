// Stress of the fluid at the vertices of the surfaces, and the forces that it exerts on them.
//
// The pressure is taken as linear over each triangle, and a vertex gets its share of virtual work: a uniform pressure
// then exerts p dV/dx, which no incompressible body can feel, and the sum over a body is the exact force and torque of
// that pressure on its polyhedron. Area times pressure along the vertex's normal would do work at any level of the
// pressure. The viscous part acts on a third of the areas around the vertex.
#pragma once

#include <string>

#include "common/summing.hpp"
#include "common/sums.hpp"
#include "immersed/surface_geometry.hpp"

namespace corpuscle {

/// Pressure and viscous traction mu (grad u + grad u^T) n at each vertex, side by side so that ranks add them up at once.
struct SurfaceStress {
  Components<double> values;  // [vertex, 4] kPa: pressure, viscous traction

  KOKKOS_FORCEINLINE_FUNCTION double pressure(int i) const { return values(i, 0); }
  KOKKOS_FORCEINLINE_FUNCTION Vec3 viscous(int i) const { return {values(i, 1), values(i, 2), values(i, 3)}; }
  KOKKOS_FORCEINLINE_FUNCTION void set(int i, double p, const Vec3& viscous) const {
    values(i, 0) = p;
    for (int d = 0; d < 3; ++d) values(i, 1 + d) = viscous[d];
  }
};

inline SurfaceStress make_surface_stress(const std::string& label, int vertices) { return {Components<double>(label, vertices, 4)}; }

/// Stands for the pressure of a vertex that no fluid node informs. Zero would be a pressure, at whose level the vertex
/// would be pushed or pulled.
constexpr double no_pressure = 1e300;
/// The same in a film, to another body, that has no fluid nodes.
constexpr double unseen_pressure = 2 * no_pressure;
KOKKOS_INLINE_FUNCTION bool has_pressure(double p) { return !(p >= 0.5 * no_pressure); }

/// Force of the pressure on vertex i, nN: minus its integral times the outward normal and the function that falls
/// linearly from one at i to zero at the neighbours. Only differences from the body's first vertex count: what is left out
/// has no force and torque on the body, and does no work while the volume stays.
/// @param area_vector  area_vector(t): of triangle t, um2
template <class AreaVector>
KOKKOS_INLINE_FUNCTION Vec3 pressure_force(const SurfaceSet& s, const SurfaceStress& stress, int i, const AreaVector& area_vector) {
  const double level = stress.pressure(s.first_vertex(s.vertex_body(i))), own = stress.pressure(i) - level;
  Vec3 force;
  for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
    const int t = s.ring_triangle(r);
    double sum = own;
    for (int k = 0; k < 3; ++k) sum += stress.pressure(s.triangle(t, k)) - level;
    force -= (sum / 12) * area_vector(t);
  }
  return force;
}

/// Force of the fluid on vertex i, nN. Areas as of the last update_surface_geometry().
KOKKOS_INLINE_FUNCTION Vec3 fluid_force(const SurfaceSet& s, const SurfaceStress& stress, int i) {
  return s.area(i) * stress.viscous(i) + pressure_force(s, stress, i, [&](int t) { return area_vector(s, t); });
}

/// Fills the pressures that are missing in `found` with the mean over the neighbours that have one, or else over the body:
/// the level enters as it does elsewhere. traction = -p n + viscous part, [vertex, 3] kPa.
/// @returns the lowest vertex of unseen_pressure without a neighbour that has one, or no_vertex: its load is a guess
inline int complete_stress(const SurfaceSet& surface, const SurfaceStress& found, const SurfaceStress& stress,
                           const Components<double>& traction) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const SurfaceSet s = surface;
  const SurfaceStress in = found, out = stress;
  const auto total = traction;
  int guessed = no_vertex;
  reduce_teams<int>(
      "corpuscle::immersed::complete_stress", s.bodies,
      KOKKOS_LAMBDA(const Team& team, int& lowest) {
        const int b = team.league_rank(), first = s.first_vertex(b), last = s.first_vertex(b + 1);
        Sums<2> known;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first, last),
            [&](int i, Sums<2>& sum) {
              if (has_pressure(in.pressure(i))) sum[0] += in.pressure(i), sum[1] += 1;
            },
            known);
        const double mean = known[1] > 0 ? known[0] / known[1] : 0;
        int here = no_vertex;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first, last),
            [&](int i, int& least) {
              double p = in.pressure(i);
              if (!has_pressure(p)) {
                double sum = 0;
                int neighbours = 0;
                for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
                  const double q = in.pressure(s.triangle(s.ring_triangle(r), (s.ring_corner(r) + 1) % 3));
                  if (has_pressure(q)) sum += q, ++neighbours;
                }
                p = neighbours > 0 ? sum / neighbours : mean;
                if (neighbours == 0 && in.pressure(i) > 1.5 * no_pressure && i < least) least = i;
              }
              out.set(i, p, in.viscous(i));
              store(total, i, in.viscous(i) - p * load(s.normal, i));
            },
            Kokkos::Min<int>(here));
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          if (here < lowest) lowest = here;
        });
      },
      Kokkos::Min<int>(guessed));
  return guessed < no_vertex ? guessed : no_vertex;
}

/// Force (0 to 2) and torque about `centre` (3 to 5) of each body: [body, 6], nN and nN um. The vertices of a body are
/// added up in a fixed order.
inline void body_loads(const SurfaceSet& surface, const SurfaceStress& stress, const Components<double>& centre,
                       const Components<double>& loads) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const SurfaceSet s = surface;
  const SurfaceStress t = stress;
  const auto about = centre, out = loads;
  Kokkos::parallel_for(
      "corpuscle::immersed::body_loads", Team(s.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int b = team.league_rank(), first = s.first_vertex(b), last = s.first_vertex(b + 1);
        Sums<6> total;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first, last),
            [&](int v, Sums<6>& sum) {
              const Vec3 force = fluid_force(s, t, v), torque = cross(load(s.x, v) - load(about, b), force);
              for (int d = 0; d < 3; ++d) sum[d] += force[d], sum[3 + d] += torque[d];
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          for (int d = 0; d < 6; ++d) out(b, d) = total[d];
        });
      });
}

}  // namespace corpuscle
