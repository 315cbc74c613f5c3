// Flows whose exact solution is known, and what must hold in every step.
#include <catch2/catch.hpp>

#include "../verification/manufactured.hpp"
#include "core/error.hpp"
#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using Convection = FluidSettings::Convection;

namespace {

constexpr auto periodic_between_walls = std::array{Type::periodic, Type::periodic, Type::wall, Type::wall, Type::periodic, Type::periodic};

void run(FluidSolver& solver, double dt, int steps) {
  for (int n = 1; n <= steps; ++n) {
    solver.begin_step(dt);
    solver.solve(n * dt, nullptr);
  }
}

/// Largest difference of the velocity from exact(centre) over fluid nodes of this rank.
template <class Exact>
double largest_error(FluidSolver& solver, const Exact& exact) {
  const auto u = on_host(solver.velocity()), x = on_host(solver.grid().views().x);
  double worst = 0;
  visit_owned(solver.grid().index(), [&](int, int, int, int c) {
    const Triple e = exact({x(c, 0), x(c, 1), x(c, 2)});
    for (int m = 0; m < 3; ++m) worst = larger(worst, std::abs(u(c, m) - e[m]));
  });
  return solver.grid().comm().max(worst);
}

/// Uniform velocity everywhere, in the history (of a step of this length) and on the faces.
void set_uniform(FluidSolver& solver, const Vec3& speed, double step_us) {
  auto state = solver.state();
  const auto grid = solver.grid().views();
  for (const auto& field : {state.u, state.u_old})
    Kokkos::parallel_for(
        "corpuscle::test::uniform", Policy(0, grid.index.size()), KOKKOS_LAMBDA(int c) { store(field, c, speed); });
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    for (const auto& flux : {state.flux[d], state.flux_old[d]}) {
      if (!flux.data()) continue;
      Kokkos::parallel_for(
          "corpuscle::test::uniform_flux", Policy(0, grid.index.size()), KOKKOS_LAMBDA(int c) { flux(c) = dot(load(area, c), speed); });
    }
  }
  state.history_levels = 1;
  state.step_us = step_us;
  solver.restore(state);
}

}  // namespace

TEST_CASE("Couette flow becomes the linear profile", "[fluid][ranks]") {
  const auto convection = GENERATE(Convection::none, Convection::extrapolated, Convection::implicit);
  FluidSettings settings;
  settings.convection = convection;
  settings.momentum_tolerance = 1e-11;
  auto all = sides(periodic_between_walls);
  all[3].type = Type::moving_wall;
  all[3].velocity = Triple{2e-3, 0, -1e-3};
  const GridSettings shape = box({5, 12, 6}, {4, 10, 4});
  Grid grid(Comm(), make_node_source(shape), {true, false, true});
  FluidSolver solver(grid, settings, all, &shape);
  // The slowest mode decays as exp(-0.1086 t / us); backward differences with 20 us shrink it by 0.38 a step.
  run(solver, 20, 30);
  const double error = largest_error(solver, [](const Triple& x) { return Triple{2e-4 * x[1], 0, -1e-4 * x[1]}; });
  CHECK(error < 1e-8 * 2e-3);  // the profile is linear, so the differences are exact: what is left is convergence
}

TEST_CASE("plane Poiseuille flow converges at second order", "[fluid]") {
  FluidSettings settings;
  settings.pressure_gradient_Pa_per_um = {0, 0, -2};
  settings.momentum_tolerance = 1e-11;
  const double centre = 2e-3 * 100 / (8 * 1.1);  // -dp/dz H^2 / (8 mu)
  double error[3];
  for (int level = 0; level < 3; ++level) {
    const GridSettings shape = box({4, 8 << level, 4}, {4, 10, 4});
    Grid grid(Comm(), make_node_source(shape), {true, false, true});
    FluidSolver solver(grid, settings, sides(periodic_between_walls), &shape);
    run(solver, 50, 30);
    error[level] = largest_error(solver, [&](const Triple& x) { return Triple{0, 0, centre * 4 * x[1] / 10 * (1 - x[1] / 10)}; }) / centre;
    CHECK(error[level] < 1.01 / std::pow(8 << level, 2));  // half-cells at the walls shift the parabola by h^2 / (4 H^2) x 4
  }
  CHECK(std::log2(error[0] / error[1]) > 1.95);
  CHECK(std::log2(error[1] / error[2]) > 1.95);
}

TEST_CASE("a pressure gradient along two directions drives the flow against it", "[fluid]") {
  FluidSettings settings;
  settings.pressure_gradient_Pa_per_um = {3, 0, -4};
  const GridSettings shape = box({4, 6, 4}, {4, 10, 4});
  Grid grid(Comm(), make_node_source(shape), {true, false, true});
  FluidSolver solver(grid, settings, sides(periodic_between_walls), &shape);
  run(solver, 50, 20);
  const auto mean = mean_velocity(solver);
  CHECK(mean[0] / mean[2] == Approx(-0.75).epsilon(1e-6));  // the momentum tolerance of 1e-8
  CHECK(mean[2] > 0);
  CHECK(std::abs(mean[1]) < 1e-12);
}

TEST_CASE("a loose momentum tolerance does not add up over a slow start", "[fluid]") {
  // The flow needs some 10 us x 10^2 / (pi^2 1.1) to start: many steps, each of which changes it by little.
  const auto speed = [](double tolerance) {
    FluidSettings settings;
    settings.pressure_gradient_Pa_per_um = {-1, 0, 0};
    settings.momentum_tolerance = tolerance;
    const GridSettings shape = box({4, 16, 4}, {4, 10, 4});
    Grid grid(Comm(), make_node_source(shape), {true, false, true});
    FluidSolver solver(grid, settings, sides(periodic_between_walls), &shape);
    run(solver, 1, 40);
    return mean_velocity(solver)[0];
  };
  const double right = speed(1e-6);
  // A hundredth of each step's change is left over at most.
  for (double tolerance : {1e-4, 1e-3, 1e-2, 3e-2, 0.1}) {
    INFO(tolerance);
    CHECK(speed(tolerance) == Approx(right).epsilon(0.01));
  }
}

TEST_CASE("the divergence vanishes after every step", "[fluid]") {
  using Map = GridSettings::CrossSection;
  const auto map = GENERATE(Map::conformal, Map::elliptical);
  FluidSettings settings;
  const GridSettings shape = tube(12, 20, map);
  Grid grid(Comm(), make_node_source(shape), {false, false, false});
  FluidSolver solver(grid, settings, tube_sides(20), &shape);
  for (int n = 1; n <= 8; ++n) {
    solver.begin_step(1);
    solver.solve(n, nullptr);
    CHECK(divergence_over_uh2(solver) < 1e-10);  // the bound that every run must keep
  }
}

TEST_CASE("an impulsive start reaches the same divergence", "[fluid]") {
  // The first potential is as large as speed times length, and its round-off above the tolerance of one solve.
  GridSettings shape = tube(40, 12);
  Grid grid(Comm(), make_node_source(shape), {false, false, false});
  FluidSolver solver(grid, FluidSettings(), tube_sides(0), &shape);
  for (int n = 1; n <= 2; ++n) {
    solver.begin_step(1);
    solver.solve(n, nullptr);
    CHECK(divergence_over_uh2(solver) < 1e-10);
  }
}

TEST_CASE("a periodic box without any pressure level is solved", "[fluid]") {
  // Decaying Taylor-Green vortices: no side prescribes anything, so the pressure is free up to a constant.
  FluidSettings settings;
  settings.kinematic_viscosity_um2_per_us = 0.05;
  const double pi = std::acos(-1.0), dt = 0.02;
  constexpr int steps = 10;
  const auto all = sides({Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic});
  double error[3];
  for (int level = 0; level < 3; ++level) {
    const int n = 10 << level;
    const GridSettings shape = box({n, n, 4}, {2 * pi, 2 * pi, 1});
    Grid grid(Comm(), make_node_source(shape), {true, true, true});
    FluidSolver solver(grid, settings, all, &shape);
    auto state = solver.state();
    const auto views = grid.views();
    const auto flow = KOKKOS_LAMBDA(const Vec3& x) { return Vec3{std::sin(x.x) * std::cos(x.y), -std::cos(x.x) * std::sin(x.y), 0}; };
    const auto x = views.x;
    Kokkos::parallel_for(
        "corpuscle::test::vortices", Policy(0, views.index.size()), KOKKOS_LAMBDA(int c) { store(state.u, c, flow(load(x, c))); });
    for (int d = 0; d < 3; ++d) {
      const auto area = views.face_area[d];
      const auto flux = state.flux[d];
      const int stride = views.index.stride(d);
      Kokkos::parallel_for(
          "corpuscle::test::vortex_flux", Policy(stride, views.index.size()),
          KOKKOS_LAMBDA(int c) { flux(c) = dot(load(area, c), flow(0.5 * (load(x, c) + load(x, c - stride)))); });
    }
    solver.restore(state);
    solver.raise_reference_speed(1);
    run(solver, dt, steps);
    CHECK(divergence_over_uh2(solver) < 1e-10);
    const double decay = std::exp(-2 * 0.05 * steps * dt);
    error[level] = largest_error(solver, [&](const Triple& at) {
      return Triple{decay * std::sin(at[0]) * std::cos(at[1]), -decay * std::cos(at[0]) * std::sin(at[1]), 0};
    });
  }
  INFO("errors " << error[0] << " " << error[1] << " " << error[2]);
  CHECK(error[2] < 4e-4);  // differences of sin(x) at h = 0.16 are 0.4 % off, over a fifth of a turnover time and less
  CHECK(std::log2(error[0] / error[1]) > 1.9);
  CHECK(std::log2(error[1] / error[2]) > 1.9);
}

TEST_CASE("uniform flow between symmetry sides stays uniform", "[fluid][ranks]") {
  FluidSettings settings;
  const GridSettings shape = box({7, 6, 10}, {10, 10, 20});
  auto all = sides({Type::symmetry, Type::symmetry, Type::symmetry, Type::symmetry, Type::velocity_inlet, Type::outflow});
  all[4].speed = 2e-3;
  Grid grid(Comm(), make_node_source(shape), {false, false, false});
  FluidSolver solver(grid, settings, all, &shape);
  set_uniform(solver, {0, 0, 2e-3}, 1);
  run(solver, 1, 5);
  CHECK(largest_error(solver, [](const Triple&) { return Triple{0, 0, 2e-3}; }) < 1e-13 * 2e-3);  // round-off
}

TEST_CASE("a skewed grid keeps a uniform flow", "[fluid][ranks]") {
  const auto convection = GENERATE(Convection::none, Convection::extrapolated, Convection::implicit);
  FluidSettings settings;
  settings.convection = convection;
  auto all = sides(
      {Type::velocity_inlet, Type::velocity_inlet, Type::velocity_inlet, Type::velocity_inlet, Type::velocity_inlet, Type::velocity_inlet});
  for (auto& side : all) side.velocity = Triple{0.3, -0.5, 0.8};
  Grid grid(Comm(), warped_box({8, 7, 9}), {false, false, false});
  REQUIRE_FALSE(grid.orthogonal());
  FluidSolver solver(grid, settings, all);
  set_uniform(solver, {0.3, -0.5, 0.8}, 0.1);
  run(solver, 0.1, 5);
  CHECK(largest_error(solver, [](const Triple&) { return Triple{0.3, -0.5, 0.8}; }) < 1e-11);  // the projection's tolerance
}

TEST_CASE("a run that blows up stops with the reason", "[fluid]") {
  FluidSettings settings;
  const GridSettings shape = box({6, 6, 6}, {4, 4, 4});
  Grid grid(Comm(), make_node_source(shape), {true, false, true});
  FluidSolver solver(grid, settings, sides(periodic_between_walls), &shape);
  set_uniform(solver, {std::nan(""), 0, 0}, 1);
  solver.begin_step(1);
  CHECK_THROWS_AS(solver.solve(1, nullptr), ComputationError);
  CHECK_THROWS_WITH(solver.solve(1, nullptr), Catch::Contains("not a number"));
  FluidSolver blown_up(grid, settings, sides(periodic_between_walls), &shape);
  set_uniform(blown_up, {1e20, 0, 0}, 1);  // its square overflows single precision
  blown_up.begin_step(1);
  CHECK_THROWS_WITH(blown_up.solve(1, nullptr), Catch::Contains("senselessly large") && Catch::Contains("time.step_us"));
  FluidSettings strict;
  strict.max_iterations = 1;
  FluidSolver hurried(grid, strict, sides(periodic_between_walls), &shape);
  auto state = hurried.state();
  const auto x = grid.views().x;
  Kokkos::parallel_for(
      "corpuscle::test::u", Policy(0, grid.index().size()), KOKKOS_LAMBDA(int c) {
        store(state.u, c, Vec3{std::sin(3 * x(c, 1)), x(c, 0), 0});
      });
  hurried.restore(state);
  hurried.begin_step(10);
  CHECK_THROWS_WITH(hurried.solve(10, nullptr), Catch::Contains("did not converge in 1 iterations"));
}

TEST_CASE("a channel that is closed is named as the cause", "[fluid][ranks]") {
  const GridSettings shape = box({6, 6, 16}, {3, 3, 8});
  Grid grid(Comm(), make_node_source(shape), {false, false, false});
  auto all = sides({Type::wall, Type::wall, Type::wall, Type::wall, Type::velocity_inlet, Type::outflow});
  all[4].speed = 1e-3;
  FluidSettings settings;
  settings.max_iterations = 50;
  FluidSolver solver(grid, settings, all, &shape);
  const IndexSpace index = grid.index();
  Array<NodeKind> kind("corpuscle::test::kind", index.size());
  Kokkos::deep_copy(kind, grid.views().base_kind);
  for_owned(
      "corpuscle::test::plug", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int at = index.first[2] + k;
        if (at == 9 || at == 10) kind(index.cell(i, j, k)) = NodeKind::inside;
      });
  grid.halo().exchange(kind);
  solver.set_kinds(kind);
  solver.begin_step(1);
  // 36 cells in each of the nine layers before the plug
  const Catch::Matchers::StdString::ContainsMatcher named = Catch::Contains("cut off 324 fluid nodes");
  CHECK_THROWS_WITH(solver.solve(1, nullptr), named && Catch::Contains("grid.nodes"));
  CHECK_THROWS_WITH(solver.check_connected(), named);
}
