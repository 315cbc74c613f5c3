// One sub-step of symplectic Euler (Equation 18) with the volume held by projection.
#pragma once

#include "immersed/surface_stress.hpp"
#include "membrane/forces.hpp"

namespace corpuscle {

/// What acts on a membrane from outside. A choice made once, at compile time of the kernels. force() is that on vertex i,
/// nN, which stands for `area`; triangle geometry must be current.
struct NoLoad {
  static constexpr double beta = 0;
  KOKKOS_INLINE_FUNCTION Vec3 force(const MembraneViews&, int, double) const { return {}; }
};

/// The fluid's stress.
struct FluidLoad {
  static constexpr double beta = 0;
  SurfaceStress stress;
  KOKKOS_INLINE_FUNCTION Vec3 force(const MembraneViews& m, int i, double area) const {
    const auto& geometry = m.triangle_geometry;
    return area * stress.viscous(i) + pressure_force(m.surface, stress, i, [&](int t) { return geometry(t, 3) * load(geometry, t); });
  }
};

/// The same with the fluid's reaction anticipated: - beta (v - v_star) on the vertex's area.
struct RobinLoad {
  FluidLoad fluid;
  Components<double> v_star;  // [vertex, 3] um/us
  double beta;                // pg/um2/us
  KOKKOS_INLINE_FUNCTION Vec3 force(const MembraneViews& m, int i, double area) const {
    return fluid.force(m, i, area) + (area * beta) * load(v_star, i);
  }
};

/// Work arrays of the motion.
struct MotionViews {
  Components<double> direction;  // [vertex, 3] velocity per pressure: inverse of the left-hand side times dV/dx
  Table<double> sums;            // [cell * sections, 2] v . dV/dx um3/us, and direction . dV/dx
  Array<double> volume;          // [cell] um3, at the end of a drift
};

/// (M/dt + beta A) v = M v/dt + F + F_fluid + beta A v_star at each vertex, and what the projection needs.
/// The corner forces and triangle geometry must be current.
template <class Load>
void predict_velocity(const MembraneViews& m, const MotionViews& w, const Load& outside, double dt) {
  const auto v = m.surface.v;
  for_sections(
      "corpuscle::membrane::predict_velocity", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double inertia = m.law(m.type(cell)).vertex_mass / dt;
        Sums<2> total;
        Kokkos::parallel_reduce(
            section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
            [&](int i, Sums<2>& sum) {
              double area;
              const Vec3 gradient = gather_area(m, i, area);
              const double inverse = 1 / (inertia + outside.beta * area);
              const Vec3 velocity = inverse * (inertia * load(v, i) + gather_force(m, i) + outside.force(m, i, area));
              store(v, i, velocity);
              store(w.direction, i, inverse * gradient);
              sum[0] += dot(velocity, gradient);
              sum[1] += dot(gradient, gradient) * inverse;
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          w.sums(cell * sections + section, 0) = total[0];
          w.sums(cell * sections + section, 1) = total[1];
        });
      });
}

/// Project v so that the volume returns to V0 (at most `volume_rate` of it per us, which matters only where a cell
/// starts away from V0), in the metric of the left-hand side, and move: x += dt v. A uniform pressure has no effect.
/// The volume after the step is V0 up to the second order of the step's displacement.
inline void project_and_move(const MembraneViews& m, const MotionViews& w, double dt, double volume_rate) {
  const auto x = m.surface.x, v = m.surface.v;
  for_sections(
      "corpuscle::membrane::project_and_move", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double rest = m.law(m.type(cell)).rest_volume, limit = volume_rate * rest;
        const double wanted = (rest - section_total(m.totals, cell, 1)) / dt;
        const double rate = wanted > limit ? limit : (wanted < -limit ? -limit : wanted);
        const double factor = (rate - section_total(w.sums, cell, 0)) / section_total(w.sums, cell, 1);
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section), [&](int i) {
          const Vec3 velocity = load(v, i) + factor * load(w.direction, i);
          const Vec3 position = load(x, i) + dt * velocity;
          store(v, i, velocity);
          store(x, i, position);
          const double size = dot(position, position);
          if (!(size < 1e300)) Kokkos::atomic_fetch_max(&m.status(0), cell + 1);
        });
      });
}

}  // namespace corpuscle
