// The energy balance closes where it should, and each of its terms is the exact one where that is known.
#include <catch2/catch.hpp>

#include "coupling/energy_balance.hpp"
#include "immersed/surface_motion.hpp"
#include "immersed/surface_work.hpp"
#include "scenes.hpp"

#include <fmt/format.h>

namespace corpuscle {
namespace {

const double pi = std::acos(-1.0);

struct Outcome {
  EnergyTotals totals;
  double imbalance = 0, coupling = 0, driving_pressure_kPa = 0;
  double last_dissipation_nW = 0;  // mean over the last step
  double torque_z = 0;             // on the first rigid body in the end, nN um
};

/// Sampled after every step from `from_us` on.
Outcome run(const Case& scene, double from_us = 0) {
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  EnergyBalance balance(simulation);
  const auto elastic = [&] {
    double energy = 0;
    if (auto* membranes = simulation.membranes())
      for (const auto& cell : membranes->diagnostics()) energy += cell.energy_fJ();
    return energy;
  };
  Outcome outcome;
  while (simulation.time() < from_us) simulation.step();
  balance.sample(elastic());
  while (!simulation.done()) {
    const double before = balance.totals().dissipation;
    simulation.step();
    if (simulation.immersed() && !simulation.membranes()) simulation.immersed()->tractions();
    balance.sample(elastic());
    outcome.last_dissipation_nW = (balance.totals().dissipation - before) / simulation.last_step_us();
  }
  if (auto* bodies = simulation.rigid_bodies()) outcome.torque_z = simulation.immersed()->loads({bodies->centre(0)})[0][1][2];
  outcome.totals = balance.totals();
  outcome.imbalance = balance.imbalance().value();
  outcome.coupling = balance.coupling_imbalance().value();
  outcome.driving_pressure_kPa = balance.driving_pressure_kPa();
  return outcome;
}

Case tube(int n, int nk, FluidSettings::Convection convection) {
  Case scene = scenes::tube_with_cell(n, nk, 100, CouplingSettings::Scheme::robin, 60);
  scene.cells.clear();
  scene.coupling.reset();
  scene.fluid->convection = convection;
  return scene;
}

/// A sphere in a cubic box of side 16 um, resting or moving.
Case box_with_sphere(int cells) {
  Case scene;
  scene.grid = scenes::cube(16, cells);
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.bodies = {scenes::sphere(5)};
  return scene;
}

}  // namespace

TEST_CASE("at rest there is no energy to balance, and no imbalance of rounding over rounding", "[coupling][energy]") {
  Case scene = scenes::aslant_flow(4, 45);
  scene.fluid->pressure_gradient_Pa_per_um = {};
  scene.boundaries[3].type = BoundarySettings::Type::wall;
  scene.boundaries[3].velocity.reset();
  CellSettings cell;
  cell.shape = CellSettings::Shape::sphere;
  cell.radius_um = 1.1;
  cell.vertices = 120;
  cell.law = CellSettings::Law::neo_hookean;
  cell.center_um = {2.03, 2.01, 1.98};
  scene.cells = {cell};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  EnergyBalance balance(simulation);
  while (true) {
    balance.sample(simulation.membranes()->diagnostics()[0].energy_fJ());
    if (simulation.done()) break;
    simulation.step();
  }
  INFO(balance.largest_fJ());
  CHECK_FALSE(balance.imbalance().has_value());
  CHECK_FALSE(balance.coupling_imbalance().has_value());
}

TEST_CASE("the energy of a tube's flow balances, with convection and without", "[coupling][energy]") {
  for (const auto convection : {FluidSettings::Convection::none, FluidSettings::Convection::extrapolated}) {
    const Outcome coarse = run(tube(11, 17, convection)), fine = run(tube(21, 33, convection));
    INFO(fmt::format("imbalance {:.5f} at 11 nodes across, {:.5f} at 21", coarse.imbalance, fine.imbalance));
    // Not smaller on the finer grid: a plug that meets a wall dissipates without bound at its rim. That this is the cause
    // the next test shows, whose inflow has no rim. Measured: 0.24 and 0.46 %, the same from 10 us on and with shorter steps.
    CHECK(coarse.imbalance < 0.006);
    CHECK(fine.imbalance < 0.006);
    // Developed flow needs 8 mu L U / R^2 = 31.68 Pa of pressure, and the inlet of a plug some more.
    CHECK(fine.driving_pressure_kPa > 31.68e-3);
    CHECK(fine.driving_pressure_kPa < 1.1 * 31.68e-3);
  }
}

TEST_CASE("the energy of a tube's flow balances to a thousandth where the inflow is zero at the wall", "[coupling][energy]") {
  for (const int n : {11, 21}) {
    Case scene = tube(n, 3 * n / 2 + 1, FluidSettings::Convection::extrapolated);
    scene.boundaries[4].profile = BoundarySettings::Profile::parabolic;
    const Outcome outcome = run(scene);
    INFO(fmt::format("imbalance {:.5f} at {} nodes across", outcome.imbalance, n));
    // 0.05 %: at the end of the ramp the pressure jumps, and the trapezoidal rule takes a part of a step's power for it.
    CHECK(outcome.imbalance < 0.001);
  }
}

TEST_CASE("the work of a moving wall is dissipated or stored", "[coupling][energy]") {
  Case scene;
  scene.time = {0.1, 50};
  scene.grid = scenes::cube(8, 16);
  scene.fluid = FluidSettings{};
  scene.boundaries = scenes::sides(BoundarySettings::Type::periodic);
  scene.boundaries[4].type = BoundarySettings::Type::wall;
  scene.boundaries[5].type = BoundarySettings::Type::moving_wall;
  scene.boundaries[5].velocity = Triple{2e-3, 0, 0};
  scene.boundaries[5].ramp_us = 10;
  const Outcome outcome = run(scene);
  INFO("imbalance " << outcome.imbalance);
  CHECK(outcome.imbalance < 0.002);
  // u = U (z / H + 1/2): rho A U^2 H / 6.
  CHECK(outcome.totals.kinetic == Approx(4e-6 * 64 * 8 / 6).epsilon(0.005));
}

TEST_CASE("the work of a pressure gradient on an array of spheres is dissipated around them", "[coupling][energy]") {
  std::vector<double> imbalance;
  for (const int cells : {19, 38}) {
    Case scene = box_with_sphere(cells);
    scene.time = {5, 150};
    scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -1};
    scene.boundaries = scenes::sides(BoundarySettings::Type::periodic);
    imbalance.push_back(run(scene).imbalance);
  }
  INFO(fmt::format("imbalance {:.4f} at 12 nodes a diameter, {:.4f} at 24", imbalance[0], imbalance[1]));
  CHECK(imbalance[0] < 0.1);
  CHECK(imbalance[1] < 0.35 * imbalance[0]);  // order 1.5
}

TEST_CASE("the work of a sphere that moves in a box is dissipated around it", "[coupling][energy]") {
  std::vector<double> imbalance, dissipation;
  for (const int cells : {19, 38}) {
    Case scene = box_with_sphere(cells);
    scene.time = {1, 30};
    scene.boundaries = scenes::sides(BoundarySettings::Type::wall);
    scene.bodies[0].velocity_um_per_us = {2e-3, 0, 0};
    const Outcome outcome = run(scene, 1);  // after the blow with which it starts, whose power no sample sees
    imbalance.push_back(outcome.imbalance);
    dissipation.push_back(outcome.totals.dissipation);
    CHECK(outcome.totals.on_bodies < 0);  // it drives the flow
  }
  INFO(fmt::format("imbalance {:.4f} at 12 nodes a diameter, {:.4f} at 24", imbalance[0], imbalance[1]));
  // Tractions are 10 and 2.5 % low there, and dissipation misses about as much in the cells that the surface cuts: what is
  // left is their difference.
  CHECK(imbalance[0] < 0.07);
  CHECK(imbalance[1] < 0.01);
  CHECK(dissipation[0] == Approx(dissipation[1]).epsilon(0.17));
}

TEST_CASE("the work of an array of spheres that turn is dissipated around them, and their torque is the exact one", "[coupling][energy]") {
  // Spheres of a simple cubic array that turn alike, with no mean vorticity: 8 pi mu a^3 Omega / (1 - phi) at the solid
  // fraction phi, up to the power 10/3 of phi (Zuzovsky, Adler and Brenner, Phys. Fluids 26, 1983), which is 0.1 % here.
  constexpr double rate = 1e-3, radius = 5, side = 16;
  const double phi = 4 * pi / 3 * std::pow(radius / side, 3), exact = 8 * pi * 1.1 * std::pow(radius, 3) * rate / (1 - phi);
  std::vector<double> imbalance, torque, dissipation;
  for (const int cells : {19, 38}) {
    Case scene = box_with_sphere(cells);
    scene.time = {1, 25};
    scene.boundaries = scenes::sides(BoundarySettings::Type::periodic);
    scene.bodies[0].angular_velocity_rad_per_us = {0, 0, rate};
    const Outcome outcome = run(scene);
    imbalance.push_back(outcome.imbalance);
    torque.push_back(-outcome.torque_z / exact);
    dissipation.push_back(outcome.last_dissipation_nW / (exact * rate));
    CHECK(outcome.totals.on_bodies < 0);
  }
  INFO(fmt::format(
      "at 12 and 24 nodes a diameter: imbalance {:.4f}, {:.4f}; torque {:.4f}, {:.4f} and dissipation {:.4f}, {:.4f} of the exact ones",
      imbalance[0], imbalance[1], torque[0], torque[1], dissipation[0], dissipation[1]));
  CHECK(torque[0] == Approx(1).margin(0.14));  // second order: measured 13 and 7.5 % low at 12 and 16 nodes a diameter
  CHECK(torque[1] == Approx(1).margin(0.05));
  CHECK(dissipation[0] == Approx(1).margin(0.04));  // 2.8 and 2.3 % low
  CHECK(dissipation[1] == Approx(1).margin(0.03));
  CHECK(imbalance[0] < 0.13);  // the torque's error, nearly
  CHECK(imbalance[1] < 0.35 * imbalance[0]);
}

TEST_CASE("the surface part of the dissipation of a turning sphere is exact", "[coupling][energy]") {
  constexpr double radius = 3, rate = 0.2;
  BodySettings body = scenes::sphere(radius);
  body.vertices = 4000;
  body.angular_velocity_rad_per_us = {0, 0, rate};
  const SurfaceSet surface = make_surface_set({make_body_mesh(body, 0.5)});
  RigidBodies bodies({body}, surface, 0);
  bodies.move_to(0);
  // (u . grad) u . n = -rate^2 s^2 / radius at distance s from the axis.
  CHECK(surface_gradient_work(surface) == Approx(-8 * pi / 3 * std::pow(radius, 3) * rate * rate).epsilon(0.01));
  CHECK(enclosed_volume(surface) == Approx(4 * pi / 3 * std::pow(radius, 3)).epsilon(0.01));
}

TEST_CASE("the energy of a cell in a tube balances, the better the shorter the step", "[coupling][energy]") {
  std::vector<Outcome> outcomes;
  for (const double step : {1.0, 0.5}) {
    Case scene = scenes::tube_with_cell(17, 25, 100, CouplingSettings::Scheme::robin, 40);
    scene.time.step_us = step;
    scene.cells[0].membrane_viscosity_N_s_per_m = 5.8e-9;
    outcomes.push_back(run(scene));
  }
  INFO(fmt::format("imbalance {:.4f} at 1 us, {:.4f} at 0.5 us; between fluid and cell {:.4f} and {:.4f}", outcomes[0].imbalance,
                   outcomes[1].imbalance, outcomes[0].coupling, outcomes[1].coupling));
  // Of it 2.7 and 1.3 % are between fluid and cell; the rest is friction that the fluid misses in the cells that the surface
  // cuts, 1 % on this grid with 1.7 spacings beside the cell.
  CHECK(outcomes[0].imbalance < 0.045);
  CHECK(outcomes[1].imbalance < 0.03);
  for (const Outcome& outcome : outcomes) CHECK(std::abs(outcome.imbalance - outcome.coupling) < 0.02);
  // Between fluid and cell the balance is first order in the step. What is left at no step at all is below each of the
  // membrane's own terms, of 0.0015 to 0.002.
  CHECK(outcomes[1].coupling < 0.6 * outcomes[0].coupling);
  CHECK(std::abs(2 * outcomes[1].coupling - outcomes[0].coupling) < 0.001);
  CHECK(outcomes[0].totals.membrane_dissipation > 0);
}

TEST_CASE("the work of a wall that slides past a cell as near as its kernel reaches is accounted for", "[coupling][energy][force]") {
  Case scene;
  scene.time = {5, 100};
  scene.grid = GridSettings();
  scene.grid->nodes = {21, 13, 21};
  scene.grid->upper_um = {10, 6, 10};
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.boundaries = scenes::sides(BoundarySettings::Type::periodic);
  scene.boundaries[2].type = BoundarySettings::Type::wall;
  scene.boundaries[3].type = BoundarySettings::Type::moving_wall;
  scene.boundaries[3].velocity = Triple{5e-3, 0, 0};
  CellSettings cell;
  cell.vertices = 500;
  cell.center_um = {5, 4.4, 5};  // half a spacing below the wall
  cell.axis = {0, 1, 0};
  scene.cells = {cell};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.coupling->slip = false;
  const Outcome outcome = run(scene, 30);  // after the blow with which the wall starts, whose power no sample sees
  INFO(fmt::format("imbalance {:.4f}", outcome.imbalance));
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("imbalance {:.4f}", outcome.imbalance));
  CHECK(outcome.imbalance < 5e-4);  // 1.9e-3 without the wall's work on the cell itself, less than 5e-5 with it
}

}  // namespace corpuscle
