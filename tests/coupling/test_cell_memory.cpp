// What a rank takes for cells: its share and a surface term, nothing that grows with all cells.
#include <fmt/format.h>
#include <malloc.h>

#include <catch2/catch.hpp>

#include "cells/shared_cells.hpp"
#include "core/log.hpp"
#include "scenes.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

using Type = BoundarySettings::Type;

constexpr double mb = 1024 * 1024;

/// All that this process holds on the heap, MB.
double held_mb() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / mb;
}

/// Not what a device or a sanitizer allocates.
bool counted() {
  const bool yes = std::is_same_v<Memory, Kokkos::HostSpace> && held_mb() > 0;
  if (!yes) WARN("skipped: memory is not on this process's heap");
  return yes;
}

/// A channel along z, periodic there, with a place for a red cell of 500 vertices every 6 um; spacing 1 um.
/// @param cells  at which places
Case channel(int places, const std::vector<int>& cells) {
  Case scene;
  scene.time = {10, 30};
  GridSettings grid;
  grid.nodes = {11, 11, 6 * places + 1};
  grid.upper_um = {10, 10, 6.0 * places};
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.boundaries = sides(Type::wall);
  scene.boundaries[4].type = scene.boundaries[5].type = Type::periodic;
  for (int place : cells) {
    CellSettings cell;
    cell.center_um = {5, 5, 6.0 * place + 3};
    scene.cells.push_back(cell);
  }
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  return scene;
}

/// The same with all that a red cell has: its own fluid, a viscous membrane, and others that it may touch.
Case of_blood(Case scene, bool touching) {
  for (CellSettings& cell : scene.cells) cell.viscosity_ratio = 5, cell.membrane_viscosity_N_s_per_m = 5e-7;
  if (touching) scene.contact = ContactSettings{};
  return scene;
}

std::vector<int> every_place(int count) {
  std::vector<int> places(count);
  for (int n = 0; n < count; ++n) places[n] = n;
  return places;
}

struct Held {
  double mb = 0;
  int own = 0, copies = 0;
};

/// What a run of three steps holds at its end, on this rank.
Held held_by(const Case& scene) {
  Timers timers;
  const double before = held_mb();
  FlowSimulation simulation(Comm(), scene, timers);
  while (!simulation.done()) simulation.step();
  Held held;
  held.mb = held_mb() - before;
  if (const SharedCells* cells = simulation.shared_cells()) {
    held.own = static_cast<int>(cells->own().size());
    held.copies = cells->copies();
  }
  return held;
}

}  // namespace

TEST_CASE("memory grows with a rank's own cells alone", "[coupling][cells][memory][ranks]") {
  if (!counted()) return;
  const int places = 64;
  Case empty = channel(places, {});
  empty.coupling.reset();
  held_by(empty);  // what libraries keep once they have been used
  const Comm comm;
  const double grid = held_by(empty).mb;
  std::vector<double> cells, own_mb;
  for (int count : {4, 16, 64}) {
    const Held held = held_by(channel(places, every_place(count)));
    CHECK(comm.sum(static_cast<double>(held.own)) == count);
    cells.push_back(comm.sum(static_cast<double>(held.own + held.copies)));
    own_mb.push_back(comm.sum(held.mb - grid));
    if (std::getenv("CORPUSCLE_SHOW"))
      WARN(fmt::format("rank {} of {}: {} cells, {} copies: {:.3f} MB beside the grid's {:.3f}", comm.rank(), comm.size(), held.own,
                       held.copies, held.mb - grid, grid));
    // A rank's share, and what does not grow with it: copies are of a block's surface.
    CHECK(held.mb - grid < 0.3 * held.own + 20);
  }
  // A copy takes less than a cell.
  const double first_slope = (own_mb[1] - own_mb[0]) / (cells[1] - cells[0]);
  const double slope = (own_mb[2] - own_mb[1]) / (cells[2] - cells[1]);
  INFO(first_slope << " and " << slope << " MB a cell");
  CHECK(slope < 0.2);
  CHECK(slope < 1.1 * first_slope);  // linear, up to the room that arrays have to spare; what few cells hold at once many hold in parts
}

TEST_CASE("cytosol, membrane viscosity and slip leave a cell's memory below its bound", "[coupling][cells][memory]") {
  if (!counted()) return;
  const int places = 64;
  for (bool touching : {false, true}) {
    held_by(of_blood(channel(places, every_place(4)), touching));  // what libraries keep once they have been used
    const Held few = held_by(of_blood(channel(places, every_place(16)), touching));
    const Held many = held_by(of_blood(channel(places, every_place(64)), touching));
    const double slope = (many.mb - few.mb) / (many.own + many.copies - few.own - few.copies);
    INFO(slope << " MB a cell" << (touching ? " with contact" : ""));
    if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{:.4f} MB a cell{}", slope, touching ? " with contact" : ""));
    CHECK(slope < (touching ? 0.18 : 0.155));  // with what contact knows of a vertex, and no lists: these are too far from each other
  }
}

TEST_CASE("a rank does not see how many cells others have", "[coupling][cells][memory][ranks]") {
  const Comm comm;
  if (comm.size() == 1 || !counted()) return;
  const int places = 64, block = places / comm.size();
  // The first rank has four in the middle of its block, the others as many or three times as many.
  const auto held_with = [&](int others) {
    std::vector<int> cells;
    for (int rank = 0; rank < comm.size(); ++rank) {
      const int count = rank == 0 ? 4 : others, first = rank * block + (block - count) / 2;
      for (int n = 0; n < count; ++n) cells.push_back(first + n);
    }
    return held_by(channel(places, cells));
  };
  held_with(4);  // what libraries keep once they have been used
  // The least of three: queues of messages that come early are MPI's, and seldom grow twice.
  Held few = held_with(4), many = held_with(12);
  for (int again = 0; again < 2; ++again) {
    few.mb = std::min(few.mb, held_with(4).mb);
    many.mb = std::min(many.mb, held_with(12).mb);
  }
  if (comm.root()) {
    CHECK(few.own == 4);
    CHECK(many.own == 4);
    INFO(few.mb << " MB, and " << many.mb << " MB with more elsewhere");
    CHECK(std::abs(many.mb - few.mb) < 0.05);
  } else {
    CHECK(many.mb - few.mb > 1);  // which shows that they would be seen
  }
}
