// A linear solver that fails names the cause that is there.
#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "fluid/projection_failure.hpp"
#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using Catch::Contains;

namespace {

/// A projection that has come to a halt, with figures of the tube's size.
ProjectionFailure halted() {
  ProjectionFailure f;
  f.divergence = 0.9e-5, f.before = 1e-5, f.target = 1e-13;
  f.face_flux = 1e-3;
  f.speed = 2e-3, f.earlier_speed = 2e-3;
  return f;
}

/// What an impulsive start in the tube stops with.
std::string failure_in_tube(const FluidSettings& settings) {
  const GridSettings shape = tube(10, 12);
  Grid grid(Comm(), make_node_source(shape), {});
  FluidSolver solver(grid, settings, tube_sides(0), &shape);
  solver.begin_step(1);
  try {
    solver.solve(1, nullptr);
  } catch (const ComputationError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("each cause of a failed projection is told from the others by its figures", "[fluid]") {
  CHECK_THAT(explain(halted()), Contains("come to a halt") && Contains("grid.nodes") && !Contains("skewed"));
  auto f = halted();
  f.skewed = true;
  CHECK_THAT(explain(f), Contains("skewed grid"));
  f = halted();
  f.divergence = 0.4e-5;
  CHECK_THAT(explain(f), Contains("still falling") && Contains("fluid.max_iterations"));
  f = halted();
  f.divergence = 2e-18, f.target = 1e-19;
  CHECK_THAT(explain(f), Contains("double precision") && Contains("fluid.divergence_tolerance"));
  f = halted();
  f.speed = 1;
  CHECK_THAT(explain(f), Contains("diverging") && Contains("time.step_us"));
  f = halted();
  f.divergence = std::nan("");
  CHECK_THAT(explain(f), Contains("not a number") && Contains("time.step_us"));
  f = halted();
  f.net_inflow = -0.25;
  CHECK_THAT(explain(f), Contains("do not conserve volume") && Contains("-0.25 um3/us") && Contains("outflow"));
}

TEST_CASE("a projection with too few iterations asks for more, one asked for too much accuracy for less", "[fluid]") {
  auto settings = FluidSettings{};
  settings.momentum_tolerance = 1e-2;
  settings.max_iterations = 3;
  CHECK_THAT(failure_in_tube(settings), Contains("pressure") && Contains("fluid.max_iterations"));
  settings = {};
  settings.max_iterations = 1;
  CHECK_THAT(failure_in_tube(settings), Contains("velocity") && Contains("fluid.max_iterations"));
  settings = {};
  settings.momentum_tolerance = 1e-18;
  CHECK_THAT(failure_in_tube(settings), Contains("velocity") && Contains("fluid.momentum_tolerance"));
}

TEST_CASE("a sink of volume in a closed box is named as the cause, and how large it is", "[fluid]") {
  const double speed = 1e-3, h = 0.5;
  Grid grid(Comm(), make_node_source(box({8, 8, 8}, {4, 4, 4})), {});
  FluidSolver solver(grid, {}, sides({Type::wall, Type::wall, Type::wall, Type::wall, Type::wall, Type::wall}));
  // Two neighbouring nodes of a body that shrinks: each moves towards the other.
  const int a = grid.index().cell(3, 4, 4), b = grid.index().cell(4, 4, 4);
  const auto kind = Kokkos::create_mirror(grid.views().base_kind);
  Kokkos::deep_copy(kind, grid.views().base_kind);
  kind(a) = kind(b) = NodeKind::immersed;
  Array<NodeKind> marked("corpuscle::test::kind", grid.index().size());
  Kokkos::deep_copy(marked, kind);
  solver.set_kinds(marked);
  auto state = solver.state();
  const auto u = on_host(state.u);
  u(a, 0) = speed, u(b, 0) = -speed;
  Kokkos::deep_copy(state.u, u);
  solver.restore(state);
  solver.begin_step(1);
  std::string message;
  try {
    solver.solve(1, nullptr);
  } catch (const ComputationError& error) {
    message = error.what();
  }
  const std::string before = "do not conserve volume: ";
  REQUIRE_THAT(message, Contains(before) && Contains("outflow"));
  // Each face takes the mean of the node's velocity and the fluid's beside it, which is dragged along: between half the
  // node's speed and all of it goes in through the two faces.
  const double inflow = std::stod(message.substr(message.find(before) + before.size()));
  CHECK(-inflow > 2 * 0.5 * speed * h * h);
  CHECK(-inflow < 2 * speed * h * h);
}
