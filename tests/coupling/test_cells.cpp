// A red cell in flow: conservation, the agreement of coupling schemes, and the stability estimate.
#include <catch2/catch.hpp>

#include "scenes.hpp"

#include "common/extremes.hpp"
#include "core/error.hpp"
#include "membrane/mesh.hpp"

namespace corpuscle {
namespace {

using Scheme = CouplingSettings::Scheme;

struct Outcome {
  TriangleMesh mesh;
  CellDiagnostics cell;
  double divergence = 0;  // largest, over U h^2
};

Outcome run(const Case& scene) {
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  Outcome outcome;
  const double spacing = simulation.grid().mean_spacing();
  while (!simulation.done()) {
    simulation.step();
    const auto& s = simulation.fluid().statistics();
    outcome.divergence = larger(outcome.divergence, s.divergence / (s.reference_speed * spacing * spacing));
  }
  outcome.mesh = body_mesh(*simulation.surfaces(), 0);
  outcome.cell = simulation.membranes()->diagnostics()[0];
  return outcome;
}

double rms_distance(const TriangleMesh& a, const TriangleMesh& b) {
  double sum = 0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v)
    for (int m = 0; m < 3; ++m) sum += std::pow(a.vertices[v][m] - b.vertices[v][m], 2);
  return std::sqrt(sum / a.vertices.size());
}

}  // namespace

TEST_CASE("a cell in the tube keeps its volume and the fluid its divergence", "[coupling]") {
  const auto outcome = run(scenes::tube_with_cell(25, 41, 100, Scheme::robin, 60));
  CHECK(outcome.divergence < 1e-10);  // the bound on face fluxes after every step
  CHECK(std::abs(outcome.cell.volume_um3 / outcome.cell.rest_volume_um3 - 1) < 1e-4);
  CHECK(std::abs(outcome.cell.area_um2 / outcome.cell.rest_area_um2 - 1) < 0.015);
  // Faster than the mean flow of 2 mm/s, slower than the 4 mm/s on the axis.
  CHECK(outcome.cell.velocity_um_per_us[2] > 2e-3);
  CHECK(outcome.cell.velocity_um_per_us[2] < 4e-3);
  // The tube is symmetric; what is left is the mesh's own irregularity.
  CHECK(std::hypot(outcome.cell.velocity_um_per_us[0], outcome.cell.velocity_um_per_us[1]) < 0.01 * outcome.cell.velocity_um_per_us[2]);
}

TEST_CASE("a cell takes the same shape at both ends of a long tube, where the level of the pressure differs", "[coupling]") {
  auto scene = scenes::tube_with_cell(13, 76, 100, Scheme::robin, 16);
  scene.time.step_us = 4;
  scene.grid->length_um = 100;
  scene.boundaries[4].profile = BoundarySettings::Profile::parabolic;
  scene.boundaries[4].ramp_us = 0;
  scene.cells[0].vertices = 300;
  const double apart = 52 * scene.grid->length_um / 75;  // whole spacings: the grid looks the same to both
  scene.cells[0].center_um[2] = -apart / 2;
  const auto upstream = run(scene);
  scene.cells[0].center_um[2] = apart / 2;
  auto downstream = run(scene).mesh;
  for (auto& x : downstream.vertices) x[2] -= apart;
  const double distance = rms_distance(upstream.mesh, downstream);
  INFO("rms distance " << distance << " um; the cell has moved " << upstream.cell.centroid_um[2] + apart / 2 << " um");
  // 49 Pa apart, pressures that push along the vertex normals leave the shapes 0.002 um apart. What may remain is the
  // solvers' tolerance, 1e-6 of the velocity, and the ends' own flow, exp(-2.4 z / R) at 15 um.
  CHECK(distance < 1e-4);
}

TEST_CASE("the staggered scheme follows the iterated one", "[coupling]") {
  auto tight = scenes::tube_with_cell(17, 25, 100, Scheme::iterated, 12);
  const auto reference = run(tight);
  const auto robin = run(scenes::tube_with_cell(17, 25, 100, Scheme::robin, 12));
  const double distance = rms_distance(robin.mesh, reference.mesh);
  INFO("rms distance " << distance << " um");
  CHECK(distance < 0.02);  // the bound at 0.3 ms
}

TEST_CASE("the fixed point of the iterated coupling does not depend on the Robin term", "[coupling]") {
  auto scene = scenes::tube_with_cell(17, 25, 7200, Scheme::iterated, 8);
  const auto with_robin = run(scene);
  scene.coupling->robin_in_iterated = false;
  const double path = with_robin.cell.centroid_um[2];
  // Both stop when the velocity changes by 1e-3 of itself, which leaves up to 1 / (1 - 0.9) times as much to go.
  CHECK(rms_distance(run(scene).mesh, with_robin.mesh) < 0.02 * std::abs(path));
}

TEST_CASE("a coupling that cannot be stable is refused with the reason", "[coupling]") {
  Timers timers;
  const auto light = scenes::tube_with_cell(21, 31, 100, Scheme::loose, 10);
  CHECK_THROWS_WITH(FlowSimulation(Comm(), light, timers), Catch::Contains("coupling.scheme") && Catch::Contains("cells.0.mass_pg"));
  CHECK_THROWS_AS(FlowSimulation(Comm(), light, timers), InputError);
  const auto heavy = scenes::tube_with_cell(21, 31, 7200, Scheme::loose, 10);
  CHECK(FlowSimulation(Comm(), heavy, timers).coupling()->stability(1)->margin() > 1);
}

TEST_CASE("a cell through the wall or outside the grid is refused", "[coupling]") {
  Timers timers;
  auto scene = scenes::tube_with_cell(21, 31, 100, Scheme::robin, 10);
  scene.cells[0].center_um = {1.6, 0, 0};
  CHECK_THROWS_WITH(FlowSimulation(Comm(), scene, timers), Catch::Contains("wall"));
  scene.cells[0].center_um = {0, 0, 60};
  CHECK_THROWS_AS(FlowSimulation(Comm(), scene, timers), InputError);
}

}  // namespace corpuscle
