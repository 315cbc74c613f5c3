// The largest eigenvalue of each membrane's Hessian, by power iteration on finite differences of the forces.
#pragma once

#include "membrane/elasticity.hpp"

namespace corpuscle {

struct StiffnessViews {
  Components<double> mode;          // [vertex, 3] current estimate of the stiffest mode
  Components<double> probe;         // [vertex, 3] displaced positions, um
  Components<double> force_ahead;   // [vertex, 3] nN
  Components<double> force_behind;  // [vertex, 3] nN
  Table<double> sums;               // [cell * sections, 1] squared norm of the mode
};

/// A fixed, rough vector that no symmetry of the mesh keeps free of the stiffest mode.
inline void start_mode(const MembraneViews& m, const StiffnessViews& w) {
  for_sections(
      "corpuscle::membrane::start_mode", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const int first = m.surface.first_vertex(cell);
        double total = 0;
        Kokkos::parallel_reduce(
            section_range(team, first, m.surface.first_vertex(cell + 1), section),
            [&](int i, double& sum) {
              const double n = i - first;
              const Vec3 u{std::sin(12.9898 * n + 1), std::sin(78.233 * n + 2), std::sin(37.719 * n + 3)};
              store(w.mode, i, u);
              sum += dot(u, u);
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { w.sums(cell * sections + section, 0) = total; });
      });
}

/// probe = x + distance mode / |mode|
inline void displace(const MembraneViews& m, const StiffnessViews& w, double distance) {
  const auto x = m.surface.x;
  for_sections(
      "corpuscle::membrane::displace", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double square = section_total(w.sums, cell, 0), factor = square > 0 ? distance / std::sqrt(square) : 0;
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
                             [&](int i) { store(w.probe, i, load(x, i) + factor * load(w.mode, i)); });
      });
}

/// mode = Hessian times the unit mode that was probed; its norm goes to the sums.
inline void difference_forces(const MembraneViews& m, const StiffnessViews& w, double distance) {
  for_sections(
      "corpuscle::membrane::difference_forces", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        double total = 0;
        Kokkos::parallel_reduce(
            section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
            [&](int i, double& sum) {
              const Vec3 h = (0.5 / distance) * (load(w.force_behind, i) - load(w.force_ahead, i));
              store(w.mode, i, h);
              sum += dot(h, h);
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { w.sums(cell * sections + section, 0) = total; });
      });
}

/// Largest eigenvalue for each cell. @param eigenvalue  [cells] nN/um  @param parts  as Elasticity::membrane_forces()
inline void largest_stiffness(const MembraneViews& m, const Elasticity& elasticity, const StiffnessViews& w, int iterations,
                              const Array<double>& eigenvalue, const std::vector<CellPart>& parts = {}) {
  // Small against an edge, large against the rounding of positions: the difference is good to about 1e-6.
  constexpr double distance = 1e-4;
  start_mode(m, w);
  for (int i = 0; i < iterations; ++i) {
    displace(m, w, distance);
    elasticity.membrane_forces(m, w.probe, w.force_ahead, parts);
    displace(m, w, -distance);
    elasticity.membrane_forces(m, w.probe, w.force_behind, parts);
    difference_forces(m, w, distance);
  }
  Kokkos::parallel_for(
      "corpuscle::membrane::eigenvalue", Policy(0, m.cells),
      KOKKOS_LAMBDA(int cell) { eigenvalue(cell) = std::sqrt(section_total(w.sums, cell, 0)); });
}

}  // namespace corpuscle
