// What is refused before the first step: velocities that do not conserve volume, surfaces that do not fit.
#include "scenes.hpp"

#include "core/error.hpp"
#include "coupling/flow_checks.hpp"
#include "coupling/surface_checks.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/mesh_io.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

using namespace corpuscle;
using Catch::Contains;
using Type = BoundarySettings::Type;

namespace {

struct Box {
  GridSettings settings;
  Grid grid;
  explicit Box(const std::array<bool, 3>& periodic = {false, false, false})
      : settings{[] {
          GridSettings s;
          s.nodes = {9, 9, 13};
          s.upper_um = {4, 5, 12};
          return s;
        }()},
        grid(Comm(), make_node_source(settings), periodic) {}
};

/// Walls, and what the test puts at k_min and k_max.
std::vector<BoundarySettings> between(Type low, Type high) {
  auto all = scenes::sides(Type::wall);
  all[4].type = low, all[5].type = high;
  return all;
}

std::string refusal(const std::vector<BoundarySettings>& boundaries) {
  try {
    check_prescribed_flow(Box().grid, boundaries);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("prescribed velocities must conserve volume", "[ranks]") {
  auto two = between(Type::velocity_inlet, Type::velocity_inlet);
  two[4].speed = 2e-3, two[5].speed = 2e-3;
  SECTION("two inlets and no way out") {
    // 2 mm/s through 4 x 5 um.
    CHECK_THAT(refusal(two), Contains("0.04 um3/us in through k_min (boundary.4.velocity_mm_per_s)") &&
                                 Contains("0.04 um3/us in through k_max (boundary.5.velocity_mm_per_s)") &&
                                 Contains("a net flux of 0.08 um3/us in") && Contains("outflow") &&
                                 Contains("boundary.5.velocity_mm_per_s = -2"));
  }
  SECTION("in at one end and out at the other") {
    two[5].speed = -2e-3;
    CHECK(refusal(two) == "accepted");
    two[5].speed = -2.0004e-3;
    CHECK(refusal(two) == "accepted");  // four digits
    two[5].speed = -2.01e-3;
    CHECK_THAT(refusal(two), Contains("do not conserve volume"));
    two[5].velocity = Triple{1e-3, 0, 2e-3};
    CHECK(refusal(two) == "accepted");
    two[5].velocity = Triple{1e-3, 0, -2e-3};
    CHECK_THAT(refusal(two), Contains("do not conserve volume"));
  }
  SECTION("with a way out") {
    two[0].type = Type::outflow;
    CHECK(refusal(two) == "accepted");
  }
  SECTION("at every time") {
    two[5].speed = -2e-3;
    two[4].ramp_us = 20;
    CHECK_THAT(refusal(two), Contains("at 0 us") && Contains("ramp_us and time_table that agree"));
    two[5].ramp_us = 10;
    CHECK_THAT(refusal(two), Contains("at 10 us") && Contains("ramp_us and time_table that agree"));
    two[5].ramp_us = 0;
    two[5].time_table = {{0, 0}, {20, 1}};
    CHECK(refusal(two) == "accepted");
    two[5].time_table.push_back({30, 1.5});
    CHECK_THAT(refusal(two), Contains("at 30 us"));
  }
  SECTION("one velocity on all sides") {
    auto all = scenes::sides(Type::velocity_inlet);
    for (auto& side : all) side.velocity = Triple{1e-3, -2e-3, 3e-3};
    CHECK(refusal(all) == "accepted");
    all[3].velocity = Triple{1e-3, -1e-3, 3e-3};
    CHECK_THAT(refusal(all), Contains("do not conserve volume") && Contains("j_max"));
  }
  SECTION("beside periodic sides") {
    auto sides = two;
    for (int s : {0, 1}) sides[s].type = Type::periodic;
    CHECK_THROWS_WITH(check_prescribed_flow(Box({true, false, false}).grid, sides), Contains("do not conserve volume"));
  }
}

TEST_CASE("changes of the inflow that no step sees are refused") {
  const auto found = [](const std::vector<std::array<double, 2>>& table, const TimeSettings& time = {2, 20}) {
    auto sides = between(Type::velocity_inlet, Type::outflow);
    sides[4].speed = 2e-3, sides[4].time_table = table;
    try {
      check_courses(sides, StepSchedule(time, sudden_changes(sides, time.step_us)));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK_THAT(found({{0, 0}, {2.1, 0}, {3, 50}, {3.9, 0}, {100, 0}}),
             Contains("boundary.4.time_table: row 2 (3 us, factor 50)") && Contains("time.step_us") && Contains("0.45 us"));
  CHECK(found({{0, 0}, {2.1, 0}, {3, 50}, {3.9, 0}, {100, 0}}, {0.25, 20}) == "accepted");
  CHECK_THAT(found({{0, 1}, {2.1, 1}, {3, 0}, {3.9, 1}, {100, 1}}), Contains("row 2 (3 us, factor 0)"));
  // A jump, which the step after it has; a course that the steps sample; and what comes after the end.
  CHECK(found({{0, 0}, {3, 0}, {3.001, 1}, {100, 1}}) == "accepted");
  CHECK(found({{0, 0}, {5, 0.5}, {10, 1}, {15, 0.5}, {20, 0}}) == "accepted");
  CHECK(found({{0, 0}, {10, 1}, {30, 1}, {30.1, 9}, {30.2, 1}}) == "accepted");
  CHECK_THAT(found({{0, 0}, {1e-5, 0.5}, {2e-5, 1}}),
             Contains("boundary.4.time_table") && Contains("within the first step") && Contains("1e6"));
}

TEST_CASE("a pressure gradient must point along the periodic sides' shift") {
  const NodeSource source{{4, 4, 4}, [](int i, int j, int k) { return Triple{double(i) + 0.5 * k, double(j), double(k)}; }};
  const Grid grid(Comm(), source, {false, false, true});
  CHECK_NOTHROW(check_pressure_gradient(grid, {0, 0, 0}));
  CHECK_NOTHROW(check_pressure_gradient(grid, {-0.5, 0, -1}));
  CHECK_THROWS_WITH(check_pressure_gradient(grid, {0, -1, 0}), Contains("fluid.pressure_gradient_Pa_per_um") && Contains("drives nothing"));
  // (0, 0, -1.25) has the same part along (0.5, 0, 1) as (-0.5, 0, -1).
  CHECK_THROWS_WITH(check_pressure_gradient(grid, {0, 0, -1.25}), Contains("the same flow comes from [-0.5, 0, -1]"));
}

TEST_CASE("a moving wall must not move through itself", "[ranks]") {
  auto lid = between(Type::wall, Type::moving_wall);
  lid[5].velocity = Triple{2e-3, -1e-3, 0};
  CHECK(refusal(lid) == "accepted");
  lid[5].velocity = Triple{2e-3, 0, 1e-6};
  CHECK_THAT(refusal(lid),
             Contains("boundary.5.velocity_mm_per_s") && Contains("k_max") && Contains("0.001 mm/s") && Contains("velocity_inlet"));
  lid[0].type = Type::outflow;  // which does not make it one that fluid goes through
  CHECK_THAT(refusal(lid), Contains("must not move through itself"));
}

TEST_CASE("walls that would tear a cell in a step are refused, and fast ones warned of") {
  const Box box;
  auto sides = between(Type::moving_wall, Type::moving_wall);  // 12 um apart
  sides[4].velocity = Triple{-0.3, 0, 0}, sides[5].velocity = Triple{0.3, 0, 0};
  const auto strain = [&](double step_us, bool viscous = false) {
    try {
      return check_wall_strain(box.grid, sides, step_us, viscous);
    } catch (const InputError& error) {
      return std::string("InputError: ") + error.what();
    }
  };
  CHECK(strain(9.9).empty());
  CHECK_THAT(strain(10.1), !Contains("InputError: ") && Contains("boundary.4.velocity_mm_per_s = [-300, 0, 0]") && Contains("12 um away") &&
                               Contains("600 mm/s") && Contains("by 0.505 in a step of 10.1 us") && Contains("time.step_us to 9.8 us"));
  CHECK(strain(1.98, true).empty());
  CHECK_THAT(strain(2.02, true),
             Contains("by 0.101 in a step of 2.02 us") && Contains("0.1 is the most that a cell whose membrane is viscous follows well"));
  CHECK_THAT(strain(39.9), !Contains("InputError: ") && Contains("strains"));
  CHECK_THAT(strain(40.1), Contains("InputError: boundary.4.velocity_mm_per_s"));
  sides[5].velocity = sides[4].velocity;  // the fluid between goes with them
  CHECK(strain(1e4).empty());
  sides[5].type = Type::symmetry;
  CHECK(strain(1e4).empty());
  sides[5].type = Type::wall;
  CHECK_THAT(strain(1e4), Contains("InputError: "));
  sides[4].ramp_us = 20;
  CHECK_THAT(strain(1e4), Contains("InputError: "));
  sides[4].time_table = {{0, 0}, {10, 1e-4}};
  sides[4].ramp_us = 0;
  CHECK(strain(20).empty());
}

namespace {

/// A box of 20 um, nodes 0.5 um apart, or along z as given.
struct Scene {
  Case scene;
  explicit Scene(int nodes_along_z = 41) {
    scene.grid = scenes::cube(20, 40);
    scene.grid->nodes[2] = nodes_along_z;
  }
  CellSettings& cell(const Triple& center) {
    scene.cells.emplace_back();
    scene.cells.back().center_um = center;
    scene.cells.back().vertices = 200;
    return scene.cells.back();
  }
  BodySettings& sphere(double radius, const Triple& center) {
    scene.bodies.push_back(scenes::sphere(radius));
    scene.bodies.back().center_um = center;
    scene.bodies.back().vertices = 200;
    return scene.bodies.back();
  }
  std::string refusal(const std::array<bool, 3>& periodic = {false, false, false}) const {
    const Grid grid(Comm(), make_node_source(*scene.grid), periodic);
    std::vector<TriangleMesh> bodies;
    for (const auto& body : scene.bodies) bodies.push_back(make_body_mesh(body, 0.5));
    Membranes membranes(scene.cells, bodies);
    try {
      check_surfaces(grid, scene, membranes.surfaces());
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  Resolution resolution() const {
    const Grid grid(Comm(), make_node_source(*scene.grid), {false, false, false});
    std::vector<TriangleMesh> bodies;
    for (const auto& body : scene.bodies) bodies.push_back(make_body_mesh(body, 0.5));
    Membranes membranes(scene.cells, bodies);
    return measure_resolution(SpacingMap(grid), scene, membranes.surfaces()).front();
  }
};

}  // namespace

TEST_CASE("surfaces inside one another or across one another are called that", "[ranks]") {
  Scene s;
  s.cell({0, 0, 0});
  SECTION("a cell inside a sphere") {
    s.sphere(6, {0.3, 0.2, 0.1});
    CHECK_THAT(s.refusal(), Contains("cells.0 lies inside bodies.0") && Contains("center_um"));
  }
  SECTION("a sphere inside a sphere") {
    s.sphere(1, {3, 0, 6});
    s.sphere(2, {3, 0, 6});
    CHECK_THAT(s.refusal(), Contains("bodies.0 lies inside bodies.1"));
  }
  SECTION("a cell partly in a sphere") {
    s.sphere(4, {6, 0, 0});
    CHECK_THAT(s.refusal(), Contains("surfaces cross: cells.0 and bodies.0 overlap near") && Contains("center_um"));
  }
  SECTION("apart") {
    s.sphere(2, {0, 0, 6});
    s.cell({0, 0, -6});
    CHECK(s.refusal() == "accepted");
  }
  SECTION("across a periodic side") {
    s.cell({0, 0, 19});
    s.scene.cells[0].center_um = {0, 0, -0.5};
    CHECK(s.refusal() == "accepted");
    CHECK_THAT(s.refusal({false, false, true}), Contains("cells.0 and cells.1 overlap"));
  }
  SECTION("whole periods away") {
    s.cell({0, 0, 60.3});
    CHECK(s.refusal() == "accepted");
    CHECK_THAT(s.refusal({false, false, true}), Contains("cells.0 and cells.1 overlap"));
  }
}

TEST_CASE("a body's size must fit the grid, or another unit is suggested") {
  Scene s;
  const auto path = (std::filesystem::temp_directory_path() / "corpuscle_scene_check.off").string();
  write_off(path, ellipsoid_mesh({3e-3, 2e-3, 2e-3}, 200));
  auto& body = s.sphere(1, {0, 0, 0});
  body.shape = BodySettings::Shape::file;
  body.file = path;
  CHECK_THAT(s.refusal(), Contains("bodies.0: 0.00596 x ") && Contains("smaller than the spacing") &&
                              Contains("bodies.0.scale = 1000 (a file in mm) would make it 5.96 um"));
  body.scale = 1e6;
  CHECK_THAT(s.refusal(), Contains("larger than the grid, which is 20 x 20 x 20 um") && Contains("bodies.0.scale = 1000 (a file in mm)"));
  body.scale = 1e3;
  CHECK(s.refusal() == "accepted");
  std::filesystem::remove(path);
}

TEST_CASE("how the grid resolves a body is measured across it") {
  Scene fine;
  fine.cell({0, 0, 0});
  const Resolution of_cell = fine.resolution();
  // 0.81 um at the centre and 2.5 um near the rim, more where the rim is seen from its side; from a coarse mesh's vertices.
  CHECK(of_cell.spacing_um == Approx(0.5).epsilon(1e-9));
  CHECK(of_cell.thickness_um == Approx(0.85).margin(0.1));
  CHECK(of_cell.largest == Approx(0.5 / of_cell.thickness_um));
  CHECK(of_cell.typical == Approx(0.5 / 2.5).margin(0.02));

  Scene ball;
  ball.sphere(2, {0, 0, 0});
  const Resolution of_ball = ball.resolution();
  // Across the middle everywhere, of a mesh that lies up to 1 % inside.
  CHECK(of_ball.thickness_um == Approx(4).epsilon(0.02));
  CHECK(of_ball.typical == Approx(0.5 / 4).epsilon(0.02));
}

TEST_CASE("a grid too coarse for a body is refused with the figures and what would do") {
  Scene flat(6);  // 4 um along z
  flat.cell({0, 0, 0});
  CHECK_THAT(flat.refusal(), Contains("cells.0: the grid is too coarse") && Contains("um apart across it") &&
                                 Contains("spacing over thickness") && Contains("grid.nodes = [41, 41, "));
  // Tilted by 90 degrees it is thin where the nodes are near each other.
  flat.scene.cells[0].axis = {1, 0, 0};
  CHECK(flat.refusal() == "accepted");
  Scene small(41);
  small.sphere(0.3, {0.2, 0.1, 0.05});
  CHECK_THAT(small.refusal(), Contains("bodies.0"));
  Scene enough(41);
  enough.cell({0, 0, 0});
  CHECK(enough.refusal() == "accepted");
}

TEST_CASE("a grid that is just too coarse is told with figures that differ") {
  Scene s;
  s.cell({0, 0, 0});
  const double typical = s.resolution().typical;
  s.scene.coupling = CouplingSettings{};
  s.scene.coupling->scheme = CouplingSettings::Scheme::force;
  // The limit is 0.5; nodes so far apart that the figure is a hair above it.
  for (const double above : {1.0004, 1.004}) {
    const double spacing = 0.5 * above * 0.5 / typical;
    GridSettings grid = *s.scene.grid;
    for (int d = 0; d < 3; ++d) {
      const double middle = 0.5 * (grid.lower_um[d] + grid.upper_um[d]), half = 0.5 * spacing * (grid.nodes[d] - 1);
      grid.lower_um[d] = middle - half, grid.upper_um[d] = middle + half;
    }
    const Grid built(Comm(), make_node_source(grid), {false, false, false});
    Membranes membranes(s.scene.cells, {});
    const auto coarse = check_surfaces(built, s.scene, membranes.surfaces());
    REQUIRE(coarse.size() >= 1);
    CHECK_THAT(coarse[0].text, Contains(above < 1.001 ? "0.5002 or more" : "0.502 or more") && Contains("no more than 0.5 will do"));
  }
}

TEST_CASE("a rigid body that passes more than a spacing in a step is refused with its Courant number") {
  Case scene;
  scene.grid = scenes::cube(12, 16);
  scene.time = {4, 8};
  scene.fluid = FluidSettings{};
  scene.boundaries = scenes::sides(Type::periodic);
  scene.bodies = {scenes::sphere(2)};
  scene.bodies[0].velocity_um_per_us = {0, 0, 0.5};
  Timers timers;
  CHECK_THROWS_WITH(FlowSimulation(Comm(), scene, timers), Contains("moves by 2 um in a step, 2.67 times the spacing") &&
                                                               Contains("Courant number") && Contains("time.step_us to 1.5 us") &&
                                                               Contains("bodies.velocity_mm_per_s"));
  scene.bodies[0].velocity_um_per_us = {0, 0, 0.18};
  CHECK_NOTHROW(FlowSimulation(Comm(), scene, timers));
}
