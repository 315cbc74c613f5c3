// Packed cells in a flow: they touch, travel, change ranks, and go on from checkpoints.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "coupling/restart.hpp"
#include "populations/populations.hpp"
#include "scenes.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

using Type = BoundarySettings::Type;

CellTypeSettings capsule(const char* name, int type, double radius_um, int vertices) {
  CellTypeSettings one;
  one.name = name;
  one.cell.type = type;
  one.cell.shape = CellSettings::Shape::sphere;
  one.cell.radius_um = radius_um;
  one.cell.vertices = vertices;
  one.cell.law = CellSettings::Law::neo_hookean;
  one.cell.area_modulus_uN_per_m = one.cell.local_area_modulus_uN_per_m = 0;
  one.cell.shear_modulus_uN_per_m = 5;
  return one;
}

/// Two kinds of capsules, 30 % of a box that is periodic along x and z, between walls of which one slides; a gradient drives
/// them through both.
Case crowd(double end_us) {
  Case scene = aslant_flow(6, end_us);
  scene.cell_types = {capsule("large", 0, 0.8, 60), capsule("small", 1, 0.7, 50)};
  scene.populations.resize(2);
  scene.populations[0].hematocrit = 0.2;
  scene.populations[1].type = 1;
  scene.populations[1].hematocrit = 0.1;
  scene.contact = ContactSettings{};
  return scene;
}

/// A red cell, of half the common width, in a tube that is narrower than it.
Case squeezed(double end_us) {
  Case scene;
  scene.time = {5, end_us};
  GridSettings grid;
  grid.generator = GridSettings::Generator::straight_tube;
  grid.nodes = {13, 13, 17};
  grid.diameter_um = 3.5;
  grid.length_um = 5;
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -4};
  scene.boundaries = sides(Type::wall);
  scene.boundaries[4].type = scene.boundaries[5].type = Type::periodic;
  CellTypeSettings type;
  type.name = "rbc";
  type.cell.type = 0;
  type.cell.diameter_um = 3.91;
  type.cell.vertices = 200;
  scene.cell_types = {type};
  scene.populations.resize(1);
  scene.populations[0].count = 1;
  scene.populations[0].gap_um = 0.05;
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.contact = ContactSettings{};
  scene.contact->range_um = 0.12;
  return scene;
}

struct Outcome {
  std::vector<double> x;
  long moves = 0, cells = 0, total = 0;
  ContactReport contact;
};

Outcome finish(FlowSimulation& simulation) {
  while (!simulation.done()) simulation.step();
  const Comm& comm = simulation.grid().comm();
  Outcome result;
  result.x = positions(simulation);
  result.moves = comm.sum(simulation.shared_cells()->moves());
  result.cells = comm.sum(static_cast<long>(simulation.shared_cells()->own().size()));
  result.total = simulation.cells();
  result.contact = *simulation.coupling()->contact_report();
  return result;
}

Outcome run(const Comm& comm, const Case& scene) {
  Timers timers;
  FlowSimulation simulation(comm, scene, timers);
  return finish(simulation);
}

}  // namespace

TEST_CASE("packed cells cross ranks and periodic sides, touch, and none is lost", "[coupling][cells][populations][ranks]") {
  const Case scene = crowd(1500);
  const Outcome shared = run(Comm(), scene);
  CHECK(shared.cells == shared.total);
  CHECK(shared.total > 20);  // 0.2 and 0.1 of 144 um3, of less than 2.2 and 1.5 um3 each
  CHECK(shared.contact.crossings == 0);
  CHECK(shared.contact.smallest_gap < scene.contact->range_um);
  CHECK(shared.contact.smallest_gap > 0);
  CHECK(shared.moves > 2 * Comm().size());
  if (Comm().size() == 1 || !Comm().root()) return;
  const Outcome one = run(Comm::alone(), scene);
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("differ by {:.2e} um, smallest gap {}", largest_difference(one.x, shared.x), shared.contact.smallest_gap));
  CHECK(largest_difference(one.x, shared.x) < 1e-8);  // um; round-off, and residuals of the solvers at 1e-13
}

TEST_CASE("a cell that has no room at rest grows to its size as a membrane", "[coupling][populations]") {
  const Case scene = squeezed(5);
  Timers timers;
  FlowSimulation simulation(Comm::alone(), scene, timers);
  const PackingReport& packing = *simulation.coupling()->packing();
  CHECK(simulation.coupling()->packed()->size < 0.95);  // it is wider than the tube
  CHECK(packing.smallest_wall_gap_um > 0);
  CHECK(packing.smallest_wall_gap_um < 1);
  const CellDiagnostics cell = simulation.membranes()->diagnostics()[0];
  CHECK(cell.volume_um3 == Approx(cell.rest_volume_um3).epsilon(1e-9));
  CHECK(cell.area_um2 == Approx(cell.rest_area_um2).epsilon(0.03));
  const Triple extent = cell.extent_um();
  CHECK(std::max(extent[0], extent[1]) < 3.5);
  // In the tube without contact nothing would bend it.
  Case bare = scene;
  bare.contact.reset();
  CHECK_THROWS_WITH(FlowSimulation(Comm::alone(), bare, timers), Catch::Contains("add [contact], with which they bend"));
}

TEST_CASE("the gap of packed cells is not asked of the scene's own", "[coupling][populations]") {
  Case scene = crowd(15);
  scene.populations.resize(1);
  scene.populations[0].hematocrit = 0;
  scene.populations[0].count = 3;
  scene.populations[0].gap_um = 0.1;
  for (int n = 0; n < 2; ++n) {
    scene.cells.push_back(scene.cell_types[0].cell);
    scene.cells[n].center_um = {1.5 + 1.64 * n, 2, 1.5};
  }
  Timers timers;
  FlowSimulation simulation(Comm::alone(), scene, timers);
  CHECK(simulation.coupling()->packing()->smallest_gap_um >= 0.1);  // of the own two: 0.04
}

#ifdef CORPUSCLE_HDF5
TEST_CASE("a restart does not pack again", "[coupling][populations][ranks]") {
  const bool tight = GENERATE(false, true);
  Case scene = tight ? squeezed(60) : crowd(120);
  if (tight) scene.cell_types[0].cell.membrane_viscosity_N_s_per_m = 1e-7;  // what resists it goes by the size of cells
  const SharedFile file("populations");
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  const long half = simulation.steps_left() / 2;
  while (simulation.steps() < half) simulation.step();
  write_checkpoint(file.path(), simulation, {"", "", "", ""});
  const Outcome whole = finish(simulation);
  PackedCells packed = read_packed_cells(file.path(), Comm(), scene, "");
  CHECK(packed.cells.size() == static_cast<std::size_t>(whole.cells));
  CHECK((packed.size < 1) == tight);
  FlowSimulation next(Comm(), scene, timers, &packed);
  read_checkpoint(file.path(), next, "", "");
  CHECK(largest_difference(finish(next).x, whole.x) == 0);
  if (tight) {  // stiffer membranes need shorter steps, viscous ones once they are stiff indeed, also of cells that are small until the
                // checkpoint is read
    Case stiff = scene;
    stiff.cell_types[0].cell.shear_modulus_uN_per_m *= 20000;
    FlowSimulation refused(Comm(), stiff, timers, &packed);
    CHECK_THROWS_WITH(read_checkpoint(file.path(), refused, "", ""), Catch::Contains("time.step_us"));
  }
  // The cells are those that it was given.
  for (CellPlace& cell : packed.cells) cell.center_um[2] += 0.01;
  FlowSimulation first(Comm(), scene, timers, &packed);
  for (CellPlace& cell : packed.cells) cell.center_um[2] += 0.01;
  FlowSimulation moved(Comm(), scene, timers, &packed);
  CHECK(largest_difference(positions(moved), positions(first), {0, 0, -0.01}) < 1e-12);
}

TEST_CASE("cells that packing has grown go on from a checkpoint on any number of ranks", "[coupling][populations][ranks]") {
  Case scene = squeezed(50);
  for (auto& tolerance : {&scene.fluid->momentum_tolerance, &scene.fluid->divergence_tolerance}) *tolerance = 1e-12;
  const SharedFile file("grown");
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  CHECK(simulation.coupling()->packed()->size < 0.95);
  while (simulation.steps() < 5) simulation.step();
  write_checkpoint(file.path(), simulation, {"", "", "", ""});
  const Outcome whole = finish(simulation);
  for (int readers : {1, 2, 4}) {
    if (readers > Comm().size()) continue;
    INFO("written by " << Comm().size() << " ranks, read by " << readers);
    on_first_ranks(readers, [&](const Comm& comm) {
      PackedCells packed = read_packed_cells(file.path(), comm, scene, "");
      FlowSimulation next(comm, scene, timers, &packed);
      read_checkpoint(file.path(), next, "", "");
      const Outcome end = finish(next);
      CHECK(end.cells == 1);
      if (!comm.root()) return;
      const double difference = largest_difference(whole.x, end.x);
      if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{} to {} ranks: {:.2e} um", Comm().size(), readers, difference));
      CHECK(difference <= (readers == Comm().size() ? 0 : 1e-8));
    });
  }
}

#endif
