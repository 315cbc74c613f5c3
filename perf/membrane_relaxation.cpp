// A membrane alone, pushed and left to itself, for perf/error_vs_time: the cell starts at rest in shape with velocities
// that stretch it along x, and vibrates or creeps back.
//   membrane_relaxation VERTICES MASS_PG MEMBRANE_VISCOSITY_N_S_PER_M MEMBRANE_STEP_US END_US
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "membrane/membranes.hpp"
#include "program.hpp"

using namespace corpuscle;

namespace {

/// v = rate (x, -y/2, -z/2), which keeps the volume.
void push(Membranes& membranes, double rate) {
  const auto x = membranes.surfaces().x, v = membranes.surfaces().v;
  Kokkos::parallel_for(
      "corpuscle::perf::push", Policy(0, membranes.vertices()), KOKKOS_LAMBDA(int i) {
        v(i, 0) = rate * x(i, 0);
        v(i, 1) = -0.5 * rate * x(i, 1);
        v(i, 2) = -0.5 * rate * x(i, 2);
      });
}

void relax(char** argv) {
  CellSettings cell;
  cell.vertices = std::atoi(argv[1]);
  cell.mass_pg = std::atof(argv[2]);
  cell.membrane_viscosity_N_s_per_m = std::atof(argv[3]);
  const double step = std::atof(argv[4]), end = std::atof(argv[5]);
  const long steps = std::lround(end / step);
  Membranes membranes({cell});
  push(membranes, 5e-3);
  const auto start = std::chrono::steady_clock::now();
  for (long n = 0; n < steps; ++n) membranes.advance(step);
  Kokkos::fence();
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto d = membranes.diagnostics().front();
  const auto extent = d.extent_um();
  std::printf("{\"extent_um\": [%.9g, %.9g, %.9g], \"elastic_energy_fJ\": %.9g, \"wall_s\": %.4f}\n", extent[0], extent[1], extent[2],
              d.energy_fJ(), wall);
}

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, 5, "VERTICES MASS_PG MEMBRANE_VISCOSITY_N_S_PER_M MEMBRANE_STEP_US END_US",
                     [](int, char** words) { relax(words); });
}
