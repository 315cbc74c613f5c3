// Motion of massless membranes, which have the velocity of the fluid around them, with the volume held.
#pragma once

#include "common/extremes.hpp"
#include "membrane/motion.hpp"

namespace corpuscle {

/// Sums of v . dV/dx and of direction . dV/dx over each cell, with the directions that a pressure inside would give: the same
/// for all vertices along the normal. The triangle geometry must be that at x.
inline void measure_drift(const MembraneViews& m, const MotionViews& w) {
  const auto v = m.surface.v;
  for_sections(
      "corpuscle::membrane::measure_drift", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        Sums<2> total;
        Kokkos::parallel_reduce(
            section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
            [&](int i, Sums<2>& sum) {
              double area;
              const Vec3 gradient = gather_area(m, i, area), direction = (1 / area) * gradient;
              store(w.direction, i, direction);
              sum[0] += dot(load(v, i), gradient);
              sum[1] += dot(direction, gradient);
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          w.sums(cell * sections + section, 0) = total[0];
          w.sums(cell * sections + section, 1) = total[1];
        });
      });
}

/// Project v so that it changes no volume at x, and move: x = x0 + dt v. After measure_drift().
inline void project_and_drift(const MembraneViews& m, const MotionViews& w, const Components<double>& x0, double dt) {
  const auto x = m.surface.x, v = m.surface.v;
  for_sections(
      "corpuscle::membrane::project_and_drift", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double factor = -section_total(w.sums, cell, 0) / section_total(w.sums, cell, 1);
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section), [&](int i) {
          const Vec3 velocity = load(v, i) + factor * load(w.direction, i);
          store(v, i, velocity);
          store(x, i, load(x0, i) + dt * velocity);
        });
      });
}

/// Take the volume back to V0, by at most the share `most` of it, which matters only where a cell starts away from V0, and keep in
/// w.volume what it is then. After measure_membranes() and measure_drift() at x.
inline void restore_volume(const MembraneViews& m, const MotionViews& w, double most) {
  const auto x = m.surface.x;
  for_sections(
      "corpuscle::membrane::restore_volume", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double rest = m.law(m.type(cell)).rest_volume, limit = most * rest, volume = section_total(m.totals, cell, 1);
        const double wanted = rest - volume;
        const double change = wanted > limit ? limit : (wanted < -limit ? -limit : wanted);
        const double distance = change / section_total(w.sums, cell, 1);
        if (section == 0) Kokkos::single(Kokkos::PerTeam(team), [&]() { w.volume(cell) = change == wanted ? rest : volume + change; });
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section), [&](int i) {
          const Vec3 position = load(x, i) + distance * load(w.direction, i);
          store(x, i, position);
          if (!(dot(position, position) < 1e300)) Kokkos::atomic_fetch_max(&m.status(0), cell + 1);
        });
      });
}

/// The largest share of its volume that a cell has lost or gained since restore_volume(). After measure_membranes() at x.
inline double largest_volume_change(const MembraneViews& m, const MotionViews& w) {
  double most = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::volume_change", Policy(0, m.cells),
      KOKKOS_LAMBDA(int cell, double& sum) { sum = larger(sum, std::fabs(section_total(m.totals, cell, 1) / w.volume(cell) - 1)); },
      Largest(most));
  return most;
}

/// The volumes as restore_volume() left them. After measure_membranes() and measure_drift() at x.
inline void give_volume_back(const MembraneViews& m, const MotionViews& w) {
  const auto x = m.surface.x;
  for_sections(
      "corpuscle::membrane::give_volume_back", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double distance = (w.volume(cell) - section_total(m.totals, cell, 1)) / section_total(w.sums, cell, 1);
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
                             [&](int i) { store(x, i, load(x, i) + distance * load(w.direction, i)); });
      });
}

}  // namespace corpuscle
