// How far contact must look: as far as the next step may be long, and over ranks as far as both cells may come.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "balls.hpp"
#include "core/error.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

TEST_CASE("contact looks as far ahead as the next step is long, where steps grow", "[coupling][force][bodies][contact]") {
  // A ball goes by at 0.08 um/us, far from a small capsule. Of that contact follows steps of 2.5 us, but not of 5 us: they are refused
  // where they would begin, before one has been taken.
  Case scene = past_a_ball(300);
  scene.time.step_us = 5;
  scene.time.first_step_us = 2.5;
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-6;
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, 0};
  for (int side = 2; side < 6; ++side) scene.boundaries[side].type = BoundarySettings::Type::wall;  // they hold the fluid back
  scene.bodies = {ball(1.9, {3, -2.5, 2.5})};
  scene.bodies[0].velocity_um_per_us = {-0.08, 0, 0};
  scene.cells = {capsule(0.8, {-3, 3, -3})};
  scene.cells[0].vertices = 42;
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  std::string text = "none";
  try {
    while (!simulation.done()) simulation.step();
  } catch (const ComputationError& error) {
    text = error.what();
  }
  INFO(text);
  const double next = simulation.time() + 2.5;  // the last step was not completed
  CHECK(simulation.next_step_us() == 2.5);
  CHECK(text.find(fmt::format("and {:.6g} us, goes", next)) != std::string::npos);
  CHECK(text.find("in a step of 5 us") != std::string::npos);
}

namespace {

struct Extent {
  Vec3 lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};
};

/// Of a body in this rank's set.
Extent extent_of(const SurfaceSet& set, int body) {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.x);
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.first_vertex);
  Extent extent;
  for (int v = first(body); v < first(body + 1); ++v)
    for (int d = 0; d < 3; ++d) {
      extent.lower[d] = std::min(extent.lower[d], x(v, d));
      extent.upper[d] = std::max(extent.upper[d], x(v, d));
    }
  return extent;
}

/// Moves the own cells along x, those of number n by by[n], as in one step of 1 us.
void move(SharedCells& cells, const std::array<double, 2>& by) {
  const SurfaceSet& set = cells.surfaces();
  const auto each = [&](const Components<double>& field, bool add) {
    const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.first_vertex);
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    for (std::size_t c = 0; c < cells.own().size(); ++c)
      for (int i = first(c); i < first(c + 1); ++i) host(i, 0) = (add ? host(i, 0) : 0) + by[cells.own()[c].number];
    Kokkos::deep_copy(field, host);
  };
  each(set.v, false);
  cells.begin_step(1);
  each(set.x, true);
  cells.to_copies(set.x, true);
}

}  // namespace

TEST_CASE("a rank has the cells that its own come to touch, as far as both may move before copies are made anew",
          "[coupling][cells][contact][ranks]") {
  // The large one reaches from one block far into the next, where the small one is, out of reach of the first block. Each moves by less
  // than the skin, a spacing; both together by more.
  constexpr double contact = 0.5;
  const Comm comm;
  Case scene = past_a_ball(15);
  scene.grid->nodes = {49, 17, 17};
  scene.grid->lower_um = {-12, -4, -4};
  scene.grid->upper_um = {12, 4, 4};
  scene.cells = {capsule(3, {-0.3, 2, 2}), capsule(1, {5.05, 2, 2})};
  Grid grid(comm, make_node_source(*scene.grid), {false, false, false});
  SharedCells cells(places_of(scene.cells), grid, IndexSpace::halo, contact);
  const long renewals = cells.renewals();
  move(cells, {0.45, -0.45});
  REQUIRE(cells.renewals() == renewals);
  std::array<double, 2> ends{};  // of the large one's upper, of the small one's lower
  for (std::size_t c = 0; c < cells.own().size(); ++c) {
    const Extent extent = extent_of(cells.surfaces(), static_cast<int>(c));
    cells.own()[c].number == 0 ? ends[0] = extent.upper.x : ends[1] = extent.lower.x;
  }
  comm.sum(ends.data(), 2);
  INFO("gap " << ends[1] - ends[0] << " um");
  REQUIRE(ends[1] - ends[0] < contact);
  if (!cells.own().empty()) CHECK(cells.surfaces().bodies == 2);
}
