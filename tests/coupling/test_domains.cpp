// Cells and bodies in domains of every kind: closed, periodic, at rest, cut over ranks. Where they are in the domain, and who
// computes them, must not matter.
#include <catch2/catch.hpp>

#include "scenes.hpp"

#include "fluid/integrals.hpp"
#include "membrane/mesh.hpp"
#include "membrane/shape_measures.hpp"

namespace corpuscle {
namespace {

using Scheme = CouplingSettings::Scheme;
using Type = BoundarySettings::Type;

/// A small cell: the same mesh, a grid of few nodes.
CellSettings cell_at(const Triple& centre, const Triple& axis = {0, 0, 1}) {
  CellSettings cell;
  cell.vertices = 300;
  cell.center_um = centre;
  cell.axis = axis;
  return cell;
}

Case boxed(const std::array<int, 3>& cells, const Triple& half, double step, double end) {
  Case scene;
  scene.time = {step, end};
  GridSettings grid;
  for (int d = 0; d < 3; ++d) grid.nodes[d] = cells[d] + 1, grid.lower_um[d] = -half[d], grid.upper_um[d] = half[d];
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.boundaries = scenes::sides(Type::wall);
  scene.coupling = CouplingSettings{};
  return scene;
}

void make_periodic(Case& scene, std::initializer_list<int> directions) {
  for (int d : directions) scene.boundaries[2 * d].type = scene.boundaries[2 * d + 1].type = Type::periodic;
}

/// Driven through a short periodic tube by a pressure gradient.
Case periodic_tube(double z, double step, double end) {
  Case scene = scenes::tube_with_cell(17, 15, 100, Scheme::robin, end);
  scene.time = {step, end, 1};
  scene.grid->length_um = 10;
  make_periodic(scene, {2});
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -2};
  scene.cells = {cell_at({0, 0, z})};
  return scene;
}

double largest_difference(const Components<double>& a, const Components<double>& b, const Vec3& shift) {
  const auto p = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a);
  const auto q = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), b);
  double largest = 0;
  for (std::size_t i = 0; i < p.extent(0); ++i)
    for (int m = 0; m < 3; ++m) largest = std::max(largest, std::abs(p(i, m) + shift[m] - q(i, m)));
  return largest;
}

}  // namespace

TEST_CASE("a cell at rest in fluid at rest stays", "[coupling]") {
  Case scene = boxed({16, 16, 10}, {5.5, 5.5, 3}, 4, 4000);
  SECTION("in a closed box") {}
  SECTION("in a periodic box, astride a side") {
    make_periodic(scene, {0, 1, 2});
    scene.cells = {cell_at({5.3, 0.1, 0})};
  }
  SECTION("in an open tube without flow") {
    scene = scenes::tube_with_cell(17, 15, 100, Scheme::robin, 4000);
    scene.time.step_us = 4;
    scene.grid->length_um = 12;
    scene.boundaries[4].speed = 0;
  }
  SECTION("in a closed box, iterated") {
    scene.coupling->scheme = Scheme::iterated;
    scene.time.end_us = 400;
  }
  if (scene.cells.empty() || scene.boundaries[5].type == Type::outflow) scene.cells = {cell_at({0.1, 0.2, 0.05})};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  double fastest = 0;
  while (!simulation.done()) {
    simulation.step();
    if (simulation.steps() % 50 != 0 && !simulation.done()) continue;
    for (double v : simulation.membranes()->diagnostics()[0].velocity_um_per_us) fastest = std::max(fastest, std::abs(v));
    const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), simulation.surfaces()->v);
    for (std::size_t e = 0; e < v.size(); ++e) fastest = std::max(fastest, std::abs(v.data()[e]));
    fastest = std::max(fastest, largest_speed(simulation.grid().index(), simulation.fluid().kind(), simulation.fluid().velocity()));
  }
  CHECK(fastest < 1e-9);  // um/us; a cell in flow moves at 1e-3
}

TEST_CASE("a cell travels a periodic tube again and again, from wherever it starts", "[coupling]") {
  constexpr double length = 10, step = 8;
  const auto settle = [](double z) {
    Timers timers;
    FlowSimulation simulation(Comm(), periodic_tube(z, step, 3200), timers);
    while (!simulation.done()) simulation.step();
    const auto cell = simulation.membranes()->diagnostics()[0];
    const double travelled = cell.centroid_um[2] + simulation.immersed()->wrapped_by()[0][2] - z;
    const auto shape = parachute_measures(body_mesh(*simulation.surfaces(), 0), cell.centroid_um, {0, 0, 1});
    CHECK(travelled > 2 * length);
    CHECK(std::abs(cell.centroid_um[2]) < 0.5 * length + step * 2e-2);  // in the domain, but for the last step
    CHECK(std::abs(cell.volume_um3 / cell.rest_volume_um3 - 1) < 1e-4);
    return std::array<double, 4>{travelled, shape.rear_hollow_um, shape.front_dimple_um, shape.length_um};
  };
  const auto middle = settle(0), astride = settle(5);
  // Eight spacings apart: the same flow, but for what the solvers leave, which 400 steps carry on.
  for (int n = 0; n < 4; ++n) CHECK(astride[n] == Approx(middle[n]).margin(0.002));
}

TEST_CASE("where a body is in a periodic domain changes no force on it", "[coupling]") {
  const auto force = [](double x) {
    Case scene = boxed({12, 12, 12}, {3, 3, 3}, 4, 40);
    scene.coupling.reset();
    make_periodic(scene, {0, 1, 2});
    scene.fluid->convection = FluidSettings::Convection::none;
    scene.fluid->pressure_gradient_Pa_per_um = {-1, 0.3, 0};
    scene.bodies = {scenes::sphere(1.4)};
    scene.bodies[0].center_um = {x, 0.021, 0.017};
    Timers timers;
    FlowSimulation simulation(Comm(), scene, timers);
    while (!simulation.done()) simulation.step();
    simulation.coupling()->tractions_for_output();
    const auto load = simulation.immersed()->loads({scene.bodies[0].center_um})[0];
    const Triple balance = simulation.immersed()->balance_forces()[0];
    return std::array<double, 6>{balance[0], balance[1], load[0][0], load[0][1], load[1][2], load[1][1]};
  };
  // Shifts by whole spacings and whole periods; the imposed pressure alone puts 2.7e-3 um3 kPa/um x 11.5 um3 on the sphere.
  const auto centred = force(0.013), astride = force(3.013), far_away = force(3.013 + 12);
  for (int n = 0; n < 6; ++n) {
    CHECK(astride[n] == Approx(centred[n]).margin(1e-6 * std::abs(centred[0])));  // solver tolerances: 1e-6 of the velocity
    CHECK(far_away[n] == Approx(centred[n]).margin(1e-6 * std::abs(centred[0])));
  }
}

#ifdef CORPUSCLE_MPI
TEST_CASE("a cell's motion does not depend on how the domain is cut over ranks", "[coupling][ranks]") {
  if (Comm().size() == 1) return;
  Case scene;
  SECTION("sheared between walls, across a periodic side and the planes between ranks") {
    scene = boxed({16, 16, 16}, {5.5, 5.5, 5.5}, 4, 200);
    make_periodic(scene, {0, 2});
    for (int end = 0; end < 2; ++end) {
      scene.boundaries[2 + end].type = Type::moving_wall;
      scene.boundaries[2 + end].velocity = Triple{end ? 1e-2 : -1e-2, 0, 0};
    }
    scene.cells = {cell_at({5.3, 0.2, 0.1}, {1, 1, 0})};
  }
  SECTION("in a periodic tube, across the periodic side") { scene = periodic_tube(4.6, 4, 200); }
  SECTION("a sphere carried across the periodic side and the planes between ranks, driven by a gradient") {
    scene = boxed({16, 14, 12}, {4, 3.5, 3}, 4, 200);
    scene.coupling.reset();
    make_periodic(scene, {0, 1, 2});
    scene.fluid->pressure_gradient_Pa_per_um = {-1, 0, 0};
    scene.bodies = {scenes::sphere(1.4)};
    scene.bodies[0].velocity_um_per_us = {0.03, 0.01, 0};
  }
  scene.fluid->momentum_tolerance = 1e-12;
  scene.fluid->divergence_tolerance = 1e-12;
  Timers timers;
  FlowSimulation alone(Comm(MPI_COMM_SELF), scene, timers), shared(Comm(), scene, timers);
  while (!alone.done()) alone.step(), shared.step();
  const Vec3 none;
  const double speed = alone.fluid().statistics().reference_speed;
  // Relative to the domain of about 10 um and the fastest flow. Left are round-off and the solvers' last residuals.
  CHECK(largest_difference(alone.surfaces()->x, shared.surfaces()->x, none) / 10 < 1e-10);
  CHECK(largest_difference(alone.surfaces()->v, shared.surfaces()->v, none) / speed < 1e-10);
  alone.coupling()->tractions_for_output();
  const auto& traction = alone.immersed()->last_tractions();
  shared.coupling()->tractions_for_output();
  // 2 mu speed / h is the scale of the stress: h = 0.7 um.
  CHECK(largest_difference(traction, shared.immersed()->last_tractions(), none) / (3 * speed) < 1e-9);
  if (alone.membranes()) CHECK(alone.coupling()->stability(4)->beta == Approx(shared.coupling()->stability(4)->beta).epsilon(1e-14));
  const Triple a = alone.immersed()->balance_forces()[0], b = shared.immersed()->balance_forces()[0];
  for (int m = 0; m < 3; ++m) CHECK(a[m] == Approx(b[m]).margin(1e-10));
}
#endif

TEST_CASE("triangles of two and three spacings reach over periodic sides, whatever is asked of them", "[coupling][force]") {
  // Their corners lie beyond the nodes that a block knows of what is on the other side.
  const bool sharp = GENERATE(false, true);
  const int cells = sharp ? 30 : 42;
  Case scene = boxed({cells, cells, cells}, {6, 6, 6}, 20, 40);
  make_periodic(scene, {0, 1, 2});
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.coupling->scheme = Scheme::force;
  if (sharp) scene.coupling->pressure = CouplingSettings::Pressure::sharp;
  scene.cells = {cell_at({5, 5, 5})};
  scene.cells[0].vertices = 200;
  scene.cells[0].viscosity_ratio = sharp ? 1 : 5;
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  CHECK_NOTHROW([&] {
    while (!simulation.done()) simulation.step();
  }());
  CHECK(simulation.steps() == 2);
}

}  // namespace corpuscle
