// Rigid spheres: the drag of a periodic array against Zick and Homsy (J. Fluid Mech. 115, 1982), and the noise of the
// force on a sphere carried through the grid.
#include <catch2/catch.hpp>

#include "scenes.hpp"

#include <fmt/format.h>

namespace corpuscle {
namespace {

struct ArrayDrag {
  double by_balance = 0, by_tractions = 0;  // F / (6 pi mu a U)
};

/// Simple cubic array at the solid fraction, driven by a pressure gradient until steady.
ArrayDrag array_drag(double fraction, int nodes_per_diameter) {
  const double radius = 5, pi = std::acos(-1.0), side = std::cbrt(4 * pi * radius * radius * radius / (3 * fraction));
  Case scene;
  scene.time = {10, 250};
  scene.grid = scenes::cube(side, static_cast<int>(std::lround(side / (2 * radius) * nodes_per_diameter)));
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -1};
  scene.boundaries = scenes::sides(BoundarySettings::Type::periodic);
  scene.bodies = {scenes::sphere(radius)};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  while (!simulation.done()) simulation.step();
  simulation.immersed()->tractions();
  const double force = simulation.immersed()->loads({simulation.rigid_bodies()->centre(0)})[0][0][2];
  const double drive = 1e-3 * side * side * side;  // the mean gradient pushes on the whole volume
  const double stokes = 6 * pi * simulation.fluid().viscosity() * radius * mean_velocity(simulation.fluid())[2];
  return {drive / stokes, force / stokes};
}

}  // namespace

TEST_CASE("the drag of an array of spheres converges to Zick and Homsy's", "[coupling]") {
  const double exact = 7.442;  // solid fraction 0.216
  std::vector<double> balance, tractions;
  for (int nodes : {12, 17, 24}) {
    const ArrayDrag drag = array_drag(0.216, nodes);
    balance.push_back(std::abs(drag.by_balance / exact - 1));
    tractions.push_back(std::abs(drag.by_tractions / exact - 1));
    UNSCOPED_INFO(fmt::format("{} nodes a diameter: balance {:.4f}, tractions {:.4f} of the exact drag", nodes,
                              drag.by_balance / exact, drag.by_tractions / exact));
  }
  CHECK(balance.back() < 0.02);   // the bounds at 24 nodes a diameter
  CHECK(tractions.back() < 0.03);
  CHECK(std::log(tractions.front() / tractions.back()) / std::log(24.0 / 12.0) > 1.5);
}

TEST_CASE("a sphere carried through the grid feels a smooth force", "[coupling]") {
  const double side = 16.12;
  const int cells = 19;  // 12 nodes a diameter
  const double spacing = side / cells;
  Case scene;
  const int warm = 15, steps = 45;
  scene.time = {1, double(warm + steps)};
  scene.grid = scenes::cube(side, cells);
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.boundaries = scenes::sides(BoundarySettings::Type::wall);
  scene.boundaries[5].type = BoundarySettings::Type::outflow;
  auto body = scenes::sphere(5);
  body.center_um[2] = -1.5 * spacing;
  body.velocity_um_per_us = {0, 0, 3 * spacing / steps};
  scene.bodies = {body};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  std::vector<double> force;
  while (!simulation.done()) {
    simulation.step();
    simulation.immersed()->tractions();
    if (simulation.steps() > warm)
      force.push_back(simulation.immersed()->loads({simulation.rigid_bodies()->centre(0)})[0][0][2]);
  }
  double mean = 0, square = 0;
  for (double f : force) mean += f / force.size();
  // Third differences take out the smooth change on the way between the walls and leave white noise 20-fold in square.
  for (std::size_t i = 3; i < force.size(); ++i) {
    const double d = force[i] - 3 * force[i - 1] + 3 * force[i - 2] - force[i - 3];
    square += d * d / 20 / (force.size() - 3);
  }
  INFO("mean " << mean << " nN, jitter " << std::sqrt(square) / std::abs(mean));
  CHECK(mean < 0);
  CHECK(std::sqrt(square) < 0.05 * std::abs(mean));  // the bound of 5 %
}

}  // namespace corpuscle
