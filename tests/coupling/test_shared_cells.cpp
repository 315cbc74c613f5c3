// Cells that are shared out over ranks.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "cells/shared_cells.hpp"
#include "coupling/restart.hpp"
#include "scenes.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

using Type = BoundarySettings::Type;

/// Small capsules of two kinds in a box that is periodic along x and z, where a gradient drives the fluid aslant and walls
/// slide: 60 vertices each, 1.6 um wide, spacing 0.5 um. In 200 steps of 15 us they pass planes between ranks and both
/// periodic sides. `viscous`: what is inside and their membranes are, of each kind another.
Case carried_capsules(double end_us, bool viscous = false) {
  Case scene = aslant_flow(8, end_us);
  for (int n = 0; n < 6; ++n) {
    CellSettings cell;
    cell.shape = CellSettings::Shape::sphere;
    cell.radius_um = n % 2 == 0 ? 0.8 : 0.7;
    cell.vertices = n % 2 == 0 ? 60 : 50;
    cell.law = CellSettings::Law::neo_hookean;
    cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
    cell.shear_modulus_uN_per_m = 5;
    if (viscous) {
      cell.viscosity_ratio = n % 2 == 0 ? 5 : 0.5;
      cell.membrane_viscosity_N_s_per_m = n % 2 == 0 ? 1e-8 : 0;
    }
    cell.center_um = {1.3 + 2.6 * (n % 3), n < 3 ? 1.3 : 2.7, n < 3 ? 2.1 : 6.9};
    scene.cells.push_back(cell);
  }
  return scene;
}

/// Capsules that touch each other in two rows, each closed through a periodic side; one row lies along a wall, that it touches,
/// and on a plane between ranks, the other on a periodic side.
Case touching_capsules(double end_us) {
  Case scene = carried_capsules(end_us);
  CellSettings cell = scene.cells[0];
  cell.shear_modulus_uN_per_m = 4;  // for steps of 15 us
  scene.cells.clear();
  for (int n = 0; n < 10; ++n) {
    scene.cells.push_back(cell);
    scene.cells[n].radius_um = 0.75;  // 1.6 um from one to the next
    const double along = 0.8 + 1.6 * (n % 5);
    scene.cells[n].center_um = n < 5 ? Triple{4, 0.95, along} : Triple{along - 0.8, 2.6, 0.1};
  }
  scene.contact = ContactSettings{};
  return scene;
}

struct Outcome {
  std::vector<double> x;
  std::vector<Triple> laps;  // [cell]
  long moves = 0;            // of cells between ranks, or through sides; of all ranks
  std::vector<int> own;      // numbers of this rank's cells where the run was stopped
};

std::vector<int> own_numbers(FlowSimulation& simulation) {
  std::vector<int> numbers;
  for (const CellRecord& cell : simulation.shared_cells()->own()) numbers.push_back(cell.number);
  return numbers;
}

Outcome outcome(FlowSimulation& simulation) {
  Outcome result;
  result.x = positions(simulation);
  const SharedCells& cells = *simulation.shared_cells();
  std::vector<double> laps(3 * cells.total(), 0.0);
  for (const CellRecord& cell : cells.own())
    for (int d = 0; d < 3; ++d) laps[3 * cell.number + d] = cell.laps[d];
  simulation.grid().comm().sum(laps.data(), static_cast<int>(laps.size()));
  for (int c = 0; c < cells.total(); ++c) result.laps.push_back({laps[3 * c], laps[3 * c + 1], laps[3 * c + 2]});
  result.moves = simulation.grid().comm().sum(cells.moves());
  return result;
}

Outcome run(const Comm& comm, const Case& scene) {
  Timers timers;
  FlowSimulation simulation(comm, scene, timers);
  while (!simulation.done()) simulation.step();
  return outcome(simulation);
}

}  // namespace

TEST_CASE("that a mesh is too coarse for the grid is told once for its type, the same on all ranks", "[coupling][cells][ranks]") {
  Case scene = carried_capsules(15);
  scene.cells.resize(4);
  for (CellSettings& cell : scene.cells) cell.radius_um = 0.8, cell.vertices = 60, cell.shear_modulus_uN_per_m = 0.5;
  const auto told = [&] {
    Timers timers;
    FlowSimulation simulation(Comm(), scene, timers);
    return simulation.coupling()->coarse();
  };
  CHECK(told().find("its mesh is too coarse") == std::string::npos);  // edges of 0.8 spacings
  for (CellSettings& cell : scene.cells) cell.radius_um = 1.6, cell.vertices = 42;
  for (int n = 0; n < 4; ++n) scene.cells[n].center_um = {2.1 + 4 * (n % 2), 2, 2.1 + 4.0 * (n / 2)};
  const std::string text = told();
  INFO(text);
  const auto first = text.find("its mesh is too coarse for the grid: edges are");
  CHECK(first != std::string::npos);
  CHECK(text.find("vertices = ") != std::string::npos);
  CHECK(text.find("its mesh is too coarse", first + 1) == std::string::npos);
  std::string of_root = text;
  Comm().broadcast(of_root);
  CHECK(text == of_root);
}

#ifdef CORPUSCLE_HDF5
TEST_CASE("membrane viscosity may come and go at restarts", "[coupling][cells][ranks]") {
  const bool before = GENERATE(false, true);
  const auto scene_with = [](bool viscous) {
    Case scene = carried_capsules(60);
    for (CellSettings& cell : scene.cells) cell.membrane_viscosity_N_s_per_m = viscous ? 1e-8 : 0;
    return scene;
  };
  const SharedFile file("viscosity");
  Timers timers;
  FlowSimulation simulation(Comm(), scene_with(before), timers);
  for (int n = 0; n < 2; ++n) simulation.step();
  write_checkpoint(file.path(), simulation, {"", "", "", ""});
  FlowSimulation next(Comm(), scene_with(!before), timers);
  read_checkpoint(file.path(), next, "", "");
  CHECK(largest_difference(positions(next), positions(simulation)) == 0);
  next.step();
  CHECK(largest_difference(positions(next), positions(simulation)) < 0.5);
  CHECK(largest_difference(positions(next), positions(simulation)) > 0);
}
#endif

TEST_CASE("cells cross ranks and periodic sides, and nothing shows that they do", "[coupling][cells][ranks]") {
  using Pressure = CouplingSettings::Pressure;
  const auto [viscous, pressure] =
      GENERATE(std::pair{false, Pressure::spread}, std::pair{true, Pressure::spread}, std::pair{true, Pressure::sharp});
  Case scene = carried_capsules(viscous ? 1500 : 3000, viscous);
  scene.coupling->pressure = pressure;
  const Outcome shared = run(Comm(), scene);
  double along_x = 0, along_z = 0;
  for (const Triple& laps : shared.laps) along_x += laps[0], along_z += laps[2];
  CHECK(along_x >= (viscous ? 1 : 2));  // they have been through both pairs of sides
  CHECK(along_z >= (viscous ? 0 : 1));
  CHECK(shared.moves > 2 * Comm().size());
  if (Comm().size() == 1 || !Comm().root()) return;
  const Outcome one = run(Comm::alone(), scene);
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("differ by {:.2e} um, {} moves", largest_difference(one.x, shared.x), shared.moves));
  CHECK(one.laps == shared.laps);
  CHECK(largest_difference(one.x, shared.x) < 1e-8);  // um; round-off, and residuals of the solvers at 1e-13
}

TEST_CASE("cells of other viscosities beside each other move the same on any number of ranks", "[coupling][cells][ranks]") {
  // As near as they are their kinks are left, by half: a cell's copies elsewhere must know so too.
  if (Comm().size() == 1) return;
  Case scene = touching_capsules(60);
  for (std::size_t n = 0; n < scene.cells.size(); ++n) scene.cells[n].viscosity_ratio = n % 2 == 0 ? 5 : 0.5;
  for (std::size_t n = 5; n < scene.cells.size(); ++n) scene.cells[n].radius_um = 0.6;
  const Outcome shared = run(Comm(), scene);
  if (!Comm().root()) return;
  const double off = largest_difference(run(Comm::alone(), scene).x, shared.x);
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("differ by {:.2e} um", off));
  CHECK(off < 1e-8);  // um; round-off, and residuals of the solvers at 1e-13
}

TEST_CASE("what comes up behind a cell takes slip from it on the ranks that have only its copy", "[coupling][cells][ranks]") {
  // Two capsules pressed against one at a side between ranks, with the wider kernel and spacings as large as gaps.
  if (Comm().size() == 1) return;
  Case scene = carried_capsules(90);
  scene.grid->nodes = {25, 13, 13};
  scene.grid->lower_um = {0, 0, 0}, scene.grid->upper_um = {24, 12, 12};
  CellSettings cell = scene.cells[0];
  cell.vertices = 400;
  cell.law = CellSettings::Law::skalak;
  cell.shear_modulus_uN_per_m = 30;
  cell.viscosity_ratio = 5;
  scene.cells.clear();
  const double places[3] = {11.7, 6.2, 20}, sizes[3] = {1.6, 2, 2}, pushes[3] = {-0.55, 1.5, -0.95};
  for (int n = 0; n < 3; ++n) {
    cell.center_um = {places[n], 6, 6}, cell.radius_um = sizes[n], cell.push_nN = {pushes[n], 0, 0};
    scene.cells.push_back(cell);
  }
  scene.contact = ContactSettings{};
  scene.coupling->kernel = CouplingSettings::Kernel::four_point;
  scene.time = {1, 90};
  const Outcome shared = run(Comm(), scene);
  if (!Comm().root()) return;
  const double off = largest_difference(run(Comm::alone(), scene).x, shared.x);
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("differ by {:.2e} um", off));
  CHECK(off < 1e-8);  // um; 1e-5 with copies that reach no farther than contact, 1e-13 with these
}

TEST_CASE("in a tube slip is held where strain stiffens, on any number of ranks alike", "[coupling][cells][ranks]") {
  // Two kinds of capsules drawn out to 1.3 times their length, in steps that leave no room for stiffer ones than at rest.
  Case scene;
  GridSettings grid;
  grid.generator = GridSettings::Generator::straight_tube;
  grid.nodes = {13, 13, 17};
  grid.diameter_um = 6;
  grid.length_um = 8;
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-13;
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -4};
  scene.boundaries = sides(Type::wall);
  scene.boundaries[4].type = scene.boundaries[5].type = Type::periodic;
  for (int n = 0; n < 2; ++n) {
    CellSettings cell;
    cell.shape = CellSettings::Shape::sphere;
    cell.radius_um = n == 0 ? 1.3 : 1;
    cell.vertices = 80;
    cell.law = CellSettings::Law::neo_hookean;
    cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
    cell.shear_modulus_uN_per_m = n == 0 ? 5 : 3;
    cell.start_stretch = {1.3, 1, 1};
    cell.center_um = {0.3 - 0.5 * n, 0.2, n == 0 ? 0.1 : -3.8};  // both on planes between ranks
    scene.cells.push_back(cell);
  }
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.time = {35, 1050};
  const Outcome shared = run(Comm(), scene);
  if (!Comm().root()) return;
  Timers timers;
  FlowSimulation simulation(Comm::alone(), scene, timers);
  const double margin = simulation.coupling()->report(scene.time.step_us).at("margin");
  CHECK(margin >= 1);
  CHECK(margin < 1.5);
  while (!simulation.done()) simulation.step();
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("margin {:.3f}, differ by {:.2e} um", margin, largest_difference(outcome(simulation).x, shared.x)));
  CHECK(largest_difference(outcome(simulation).x, shared.x) < 1e-8);  // um; round-off, and residuals of the solvers at 1e-13
}

#ifdef CORPUSCLE_HDF5
TEST_CASE("cells go on from a checkpoint on any number of ranks, on as many with the same bits", "[coupling][cells][ranks]") {
  // Stopped where cells have just left a block or the domain and not been passed on yet: at the last step before a review.
  const auto [touching, viscous] = GENERATE(std::pair{false, false}, std::pair{true, false}, std::pair{false, true});
  Case scene = touching ? touching_capsules(720) : carried_capsules(viscous ? 1350 : 1500, viscous);
  const long stop = touching ? 31 : 79;
  for (auto& tolerance : {&scene.fluid->momentum_tolerance, &scene.fluid->divergence_tolerance}) *tolerance = 1e-11;
  const SharedFile file("shared_cells");
  Timers timers;
  const auto finish = [](FlowSimulation& simulation) {
    const auto mine = own_numbers(simulation);
    while (!simulation.done()) simulation.step();
    Outcome result = outcome(simulation);
    result.own = mine;
    return result;
  };
  for (int writers : {1, 2, 4}) {
    if (writers > Comm().size()) continue;
    Outcome whole;
    on_first_ranks(writers, [&](const Comm& comm) {
      FlowSimulation simulation(comm, scene, timers);
      while (simulation.steps() < stop) simulation.step();
      const long before = simulation.shared_cells()->moves();
      write_checkpoint(file.path(), simulation, {"", "", "", ""});
      whole = finish(simulation);
      CHECK(comm.sum(simulation.shared_cells()->moves()) > comm.sum(before));
      if (!touching) return;
      CHECK(simulation.coupling()->contact_report()->smallest_gap < scene.contact->range_um);
      CHECK(simulation.coupling()->contact_report()->crossings == 0);
    });
    for (int readers : {1, 2, 4}) {
      if (readers > Comm().size()) continue;
      INFO("written by " << writers << " ranks, read by " << readers << (touching ? ", touching" : ""));
      on_first_ranks(readers, [&](const Comm& comm) {
        FlowSimulation simulation(comm, scene, timers);
        read_checkpoint(file.path(), simulation, "", "");
        const Outcome next = finish(simulation);
        if (readers == writers) CHECK(whole.own == next.own);
        if (!comm.root()) return;
        const double difference = largest_difference(whole.x, next.x);
        if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{} to {} ranks: {:.2e} um", writers, readers, difference));
        CHECK(difference <= (readers == writers ? 0 : 1e-8));
        CHECK(whole.laps == next.laps);
      });
    }
  }
}
#endif

namespace {

/// Vertices that lie in this rank's block and so many layers around it, of own cells and copies, less those that should: all under all
/// shifts by periods.
long surplus(const SharedCells& cells, const Case& scene, const IndexSpace& index, int layers) {
  const Comm& comm = cells.comm();
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().x);
  const auto lattice = [&](double place, int d) { return (place - scene.grid->lower_um[d]) / 0.5; };
  const auto times = [&](double xi, int d) {  // over all turns
    long count = 0;
    for (int t = -9; t <= 9; ++t) {
      const double at = xi + t * index.global[d];
      count += at >= index.first[d] - layers && at < index.first[d] + index.n[d] + layers;
    }
    return count;
  };
  std::vector<double> all(3 * cells.total_vertices(), 0.0);
  int vertex = 0;
  for (const CellRecord& cell : cells.own())
    for (int v = 0; v < static_cast<int>(cells.membranes().types()[cell.type].mesh.vertices.size()); ++v, ++vertex)
      for (int d = 0; d < 3; ++d) all[3 * (cell.first_vertex + v) + d] = x(vertex, d);
  comm.sum(all.data(), static_cast<int>(all.size()));
  long missing = 0;
  for (std::size_t v = 0; v < all.size(); v += 3)
    missing -= times(lattice(all[v], 0), 0) * times(lattice(all[v + 1], 1), 1) * times(lattice(all[v + 2], 2), 2);
  for (int i = 0; i < cells.surfaces().vertices; ++i) {
    bool inside = true;
    for (int d = 0; d < 3; ++d) {
      const double xi = lattice(x(i, d), d);
      inside = inside && xi >= index.first[d] - layers && xi < index.first[d] + index.n[d] + layers;
    }
    missing += inside ? 1 : 0;
  }
  return missing;
}

/// One step of cells that all move alike.
void carry(SharedCells& cells, const Triple& by) {
  const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().v);
  for (int i = 0; i < cells.surfaces().own_vertices; ++i)
    for (int d = 0; d < 3; ++d) v(i, d) = by[d];
  Kokkos::deep_copy(cells.surfaces().v, v);
  cells.begin_step(1);
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().x);
  for (int i = 0; i < cells.surfaces().own_vertices; ++i)
    for (int d = 0; d < 3; ++d) x(i, d) += by[d];
  Kokkos::deep_copy(cells.surfaces().x, x);
  cells.to_copies(cells.surfaces().x, true);
}

}  // namespace

TEST_CASE("every block has the cells that reach into it, however they travel", "[coupling][cells][ranks]") {
  // Moved by hand, aslant through a periodic box, a third of a spacing a step, or so fast that a cell goes through nearly a period
  // between two reviews: in every step each vertex is in one block, as itself or as a copy, and in the layers around blocks too.
  const bool fast = GENERATE(false, true);
  const Case scene = carried_capsules(15);
  const Comm comm;
  Grid grid(comm, make_node_source(*scene.grid), {true, true, true});
  SharedCells cells(places_of(scene.cells), grid, IndexSpace::halo, 0.0);
  const Triple velocity = fast ? Triple{0.47, -0.24, 0.11} : Triple{0.15, -0.06, 0.11};  // um a step
  for (int step = 0; step < 100; ++step) {
    carry(cells, velocity);
    INFO("step " << step << (fast ? ", fast" : ""));
    REQUIRE(comm.max(std::abs(surplus(cells, scene, grid.index(), 0))) == 0);
    REQUIRE(comm.max(std::abs(surplus(cells, scene, grid.index(), 1))) == 0);
  }
  if (!fast) CHECK(cells.renewals() < 70);  // seldom: the skin is a spacing
  Triple laps{};
  for (const CellRecord& cell : cells.own())
    for (int d = 0; d < 3; ++d) laps[d] += cell.laps[d];
  comm.sum(laps.data(), 3);
  for (int d = 0; d < 3; ++d) CHECK(std::abs(laps[d]) >= 6);
  // What goes on by periods in one step is stopped, not lost.
  CHECK_THROWS_WITH([&] { carry(cells, {20, 0, 0}); }(), Catch::Contains("too many periods") && Catch::Contains("time.step_us"));
}

TEST_CASE("a cell may start any number of periods beyond a side", "[coupling][cells][ranks]") {
  Case scene = carried_capsules(15);
  for (CellSettings& cell : scene.cells) cell.center_um[0] += 3 * 8, cell.center_um[2] -= 8;
  Grid grid(Comm(), make_node_source(*scene.grid), {true, true, true});
  SharedCells cells(places_of(scene.cells), grid, IndexSpace::halo, 0.0);
  cells.to_copies(cells.surfaces().x, true);
  CHECK(cells.membranes().cells() == static_cast<int>(cells.own().size()));
  for (const CellRecord& cell : cells.own()) {
    CHECK(cell.laps[0] == 3);
    CHECK(cell.laps[2] == -1);
    CHECK(cells.wrapped_by(cell)[0] == Approx(24));
  }
  CHECK(Comm().max(std::abs(surplus(cells, scene, grid.index(), 0))) == 0);
}

#ifdef CORPUSCLE_HDF5
TEST_CASE("a restart tells types apart that were equal, and makes equal what was not", "[coupling][cells][restart][ranks]") {
  const bool differ = GENERATE(false, true);  // before
  const auto scene_with = [](bool other) {
    Case scene = carried_capsules(15);
    for (CellSettings& cell : scene.cells) cell.radius_um = 0.8, cell.vertices = 60;
    if (other)
      for (int n : {1, 4}) scene.cells[n].shear_modulus_uN_per_m = 1;
    return scene;
  };
  const SharedFile file("types");
  Timers timers;
  FlowSimulation before(Comm(), scene_with(differ), timers);
  write_checkpoint(file.path(), before, {"", "", "", ""});
  const Case scene = scene_with(!differ);
  FlowSimulation next(Comm(), scene, timers);
  read_checkpoint(file.path(), next, "", "");
  const SharedCells& cells = *next.shared_cells();
  CHECK(Comm().sum(static_cast<double>(cells.own().size())) == 6);
  for (const CellRecord& cell : cells.own()) {
    const auto& law = std::get<NeoHookean>(cells.membranes().types()[cell.type].in_plane);
    CHECK(law.material.shear_modulus * 1e3 == Approx(scene.cells[cell.number].shear_modulus_uN_per_m));
  }
}
#endif

TEST_CASE("parts found by copies add up to what the cell has, in the same order everywhere", "[coupling][cells][ranks]") {
  const Case scene = carried_capsules(15);
  Grid grid(Comm(), make_node_source(*scene.grid), {true, false, true});
  SharedCells cells(places_of(scene.cells), grid, IndexSpace::halo, 0.0);
  const SurfaceSet& set = cells.surfaces();
  // Every vertex has one, copies too: a cell's then has as many as there are of it.
  const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.v);
  for (int i = 0; i < set.vertices; ++i)
    for (int d = 0; d < 3; ++d) v(i, d) = 1 + d;
  Kokkos::deep_copy(set.v, v);
  cells.add_copies(set.v);
  Kokkos::deep_copy(v, set.v);
  double found = 0, own = 0;
  for (int i = 0; i < set.own_vertices; ++i) {
    own += 1;
    found += v(i, 0);
    for (int d = 1; d < 3; ++d) CHECK(v(i, d) == (1 + d) * v(i, 0));
  }
  const double present = Comm().sum(static_cast<double>(set.vertices));
  CHECK(Comm().sum(found) == present);
  CHECK(present > Comm().sum(own));
}
