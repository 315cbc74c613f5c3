// Membrane viscosity of cells that are forces: a stretched red cell let go.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "scenes.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

/// A red cell drawn out along x by 8 % in a fluid at rest.
Case stretched_cell(double step_us, double end_us, double viscosity) {
  Case scene;
  scene.time = {step_us, end_us};
  scene.grid = cube(14, 20);
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.boundaries = sides(BoundarySettings::Type::periodic);
  CellSettings cell;
  cell.vertices = 300;
  cell.membrane_viscosity_N_s_per_m = viscosity;
  cell.start_stretch = {1.08, 0.96, 0.96};
  cell.center_um = {0.1, 0.2, 0.3};
  scene.cells = {cell};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.coupling->slip = false;
  return scene;
}

/// Its length along x at times a tenth of the end apart.
std::vector<double> lengths(const Case& scene) {
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  const auto length = [&] { return simulation.membranes()->diagnostics()[0].extent_um()[0]; };
  std::vector<double> all{length()};
  while (!simulation.done()) {
    simulation.step();
    if (simulation.time() > all.size() * 0.1 * scene.time.end_us - 1e-6) all.push_back(length());
  }
  return all;
}

}  // namespace

TEST_CASE("a stretched cell of measured membrane viscosity goes back as slowly with long steps as with short ones",
          "[coupling][force]") {
  const double end = 2000, rest = lengths(stretched_cell(100, 100, 0)).front() / 1.08;
  std::vector<double> rate, lost;
  double reference = 0;
  for (double step : {4.0, 10.0, 20.0}) {
    const auto length = lengths(stretched_cell(step, end, 5e-7));
    rate.push_back(std::log((length[5] - rest) / (length[10] - rest)) / (0.5 * end));
    if (step == 4) reference = length[10];
    lost.push_back((length[10] - reference) / (rate[0] * (reference - rest)) / step);
  }
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("time constants {:.4f} {:.4f} {:.4f} s; {:.1f} and {:.1f} steps behind", 1e-6 / rate[0],
                     1e-6 / rate[1], 1e-6 / rate[2], lost[1], lost[2]));
  CHECK(rate[0] > 0);
  CHECK(rate[1] == Approx(rate[0]).epsilon(0.01));
  CHECK(rate[2] == Approx(rate[0]).epsilon(0.01));
  // The fluid takes over what the membrane asks of it within so many steps.
  CHECK(lost[1] < 15);
  CHECK(lost[2] < 15);
}
