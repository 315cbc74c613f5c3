// One run of the manufactured flow on the skewed cube, for perf/error_vs_time:
//   manufactured_flow CELLS STEP_US STEPS MOMENTUM_TOLERANCE
#include <chrono>
#include <cstdlib>

#include "manufactured.hpp"
#include "program.hpp"

using namespace corpuscle;

namespace {

void solve(char** argv) {
  FluidSettings settings;
  settings.momentum_tolerance = std::atof(argv[4]);
  const auto start = std::chrono::steady_clock::now();
  const auto errors =
      manufactured::run(Comm(), manufactured::skewed_cube(std::atoi(argv[1])), std::atof(argv[2]), std::atoi(argv[3]), settings);
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("{\"velocity_error\": %.6e, \"pressure_error\": %.6e, \"wall_s\": %.4f}\n", errors.velocity, errors.pressure, wall);
}

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, 4, "CELLS STEP_US STEPS MOMENTUM_TOLERANCE", [](int, char** words) { solve(words); });
}
