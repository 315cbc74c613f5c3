// Relaxation of membranes to rest under given forces: the fast inertial relaxation engine (Bitzek, Koskinen, Gaehler,
// Moseler & Gumbsch 2006), with unit masses, all cells at once.
#pragma once

#include "common/extremes.hpp"
#include "membrane/elasticity.hpp"

namespace corpuscle {

struct RelaxationViews {
  Components<double> applied;  // [vertex, 3] nN
  Components<double> force;    // [vertex, 3] internal and applied, nN
  Table<double> sums;          // [cell * sections, 3] F.v, F.F, v.v
  // [2 cells, 3] step, mixing, and iterations since the power was last negative; even iterations read the first half
  // and write the second, odd ones the other way round.
  Table<double> engine;
};

struct RelaxationLimits {
  double first_step, largest_step;  // sqrt(um/nN), for unit masses
  double largest_move;              // um, of a vertex in one iteration
};

/// All at rest, the engine at its start.
inline void start_relaxation(const MembraneViews& m, const RelaxationViews& w, const RelaxationLimits& limits) {
  const auto v = m.surface.v;
  const auto engine = w.engine;
  const int cells = m.cells;
  Kokkos::parallel_for(
      "corpuscle::membrane::start_relaxation", Policy(0, m.vertices), KOKKOS_LAMBDA(int i) {
        store(v, i, Vec3{});
        if (i < 2 * cells) {
          engine(i, 0) = limits.first_step;
          engine(i, 1) = 0.1;
          engine(i, 2) = 0;
        }
      });
}

/// The force on each vertex and the sums that steer the engine.
inline void gather_relaxation(const MembraneViews& m, const RelaxationViews& w) {
  const auto v = m.surface.v;
  for_sections(
      "corpuscle::membrane::gather_relaxation", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        Sums<3> total;
        Kokkos::parallel_reduce(
            section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
            [&](int i, Sums<3>& sum) {
              const Vec3 f = gather_force(m, i) + load(w.applied, i), u = load(v, i);
              store(w.force, i, f);
              sum[0] += dot(f, u);
              sum[1] += dot(f, f);
              sum[2] += dot(u, u);
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          for (int k = 0; k < 3; ++k) w.sums(cell * sections + section, k) = total[k];
        });
      });
}

/// Steer and move: uphill, stop and shorten the step; downhill, turn the velocity towards the force and lengthen it.
inline void move_relaxation(const MembraneViews& m, const RelaxationViews& w, const RelaxationLimits& limits, int iteration) {
  const auto x = m.surface.x, v = m.surface.v;
  for_sections(
      "corpuscle::membrane::move_relaxation", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const int from = (iteration % 2) * m.cells + cell, to = ((iteration + 1) % 2) * m.cells + cell;
        const double power = section_total(w.sums, cell, 0), force2 = section_total(w.sums, cell, 1),
                     speed2 = section_total(w.sums, cell, 2);
        double step = w.engine(from, 0), mixing = w.engine(from, 1), since = w.engine(from, 2);
        double keep = 0, turn = 0;
        if (power >= 0) {
          keep = 1 - mixing;
          turn = force2 > 0 ? mixing * std::sqrt(speed2 / force2) : 0;
          since += 1;
          if (since > 5) {
            step = step * 1.1 < limits.largest_step ? step * 1.1 : limits.largest_step;
            mixing *= 0.99;
          }
        } else {
          step *= 0.5;
          mixing = 0.1;
          since = 0;
        }
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section), [&](int i) {
          const Vec3 f = load(w.force, i);
          const Vec3 u = keep * load(v, i) + (turn + step) * f;
          Vec3 move = step * u;
          const double size = norm(move);
          if (size > limits.largest_move) move *= limits.largest_move / size;
          store(v, i, u);
          store(x, i, load(x, i) + move);
        });
        if (section == 0) {
          Kokkos::single(Kokkos::PerTeam(team), [&]() {
            w.engine(to, 0) = step;
            w.engine(to, 1) = mixing;
            w.engine(to, 2) = since;
          });
        }
      });
}

/// Largest force on any vertex at the last gather, nN; not a number if any is not. Waits for the device.
inline double largest_force(const MembraneViews& m, const RelaxationViews& w) {
  double largest = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::largest_force", Policy(0, m.vertices),
      KOKKOS_LAMBDA(int i, double& high) {
        const Vec3 f = load(w.force, i);
        const double size = dot(f, f);
        high = larger(high, size);
      },
      Largest(largest));
  return std::sqrt(largest);
}

/// Run `count` iterations, numbered on from `first`.
inline void relax(const MembraneViews& m, const Elasticity& elasticity, const RelaxationViews& w, const RelaxationLimits& limits, int first,
                  int count) {
  for (int i = first; i < first + count; ++i) {
    measure_membranes(m, m.surface.x);
    elasticity.evaluate_triangles(m, m.surface.x);
    gather_relaxation(m, w);
    move_relaxation(m, w, limits, i);
  }
}

}  // namespace corpuscle
