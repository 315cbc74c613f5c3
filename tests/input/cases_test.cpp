// The case files that come with the program, and the echo of what was read.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "core/units.hpp"
#include "input/case_changes.hpp"
#include "input/case_file.hpp"

using namespace corpuscle;
namespace fs = std::filesystem;

namespace {

const fs::path cases = fs::path(CORPUSCLE_SOURCE_DIR) / "cases";

Case read(const std::string& name, const std::vector<std::string>& overrides = {}) { return read_case((cases / name).string(), overrides); }

// The same but for where it was read from and the text of the echo.
void require_same(const Case& a, const Case& b) {
  REQUIRE(a.title == b.title);
  REQUIRE(a.time == b.time);
  REQUIRE(a.grid == b.grid);
  REQUIRE(a.fluid == b.fluid);
  REQUIRE(a.boundaries == b.boundaries);
  REQUIRE(a.cell_types == b.cell_types);
  REQUIRE(a.cells == b.cells);
  REQUIRE(a.bodies == b.bodies);
  REQUIRE(a.coupling == b.coupling);
  REQUIRE(a.stretching == b.stretching);
  REQUIRE(a.output == b.output);
}

Case read_back(const std::string& text) {
  const auto path = fs::temp_directory_path() / "corpuscle_test_echo.toml";
  std::ofstream(path) << text;
  auto again = read_case(path.string());
  fs::remove(path);
  return again;
}

}  // namespace

TEST_CASE("every case file reads, and its echo reads back to the same case") {
  int found = 0;
  for (const auto& entry : fs::directory_iterator(cases)) {
    if (entry.path().extension() != ".toml") continue;
    ++found;
    INFO(entry.path());
    const auto scene = read_case(entry.path().string());
    const auto again = read_back(scene.resolved);
    require_same(scene, again);
    REQUIRE(again.resolved == scene.resolved);
    const auto resolved = read_back(resolved_text(scene));
    require_same(scene, resolved);
    CHECK(resolved.remarks == scene.remarks);  // nothing that it says besides is warned of
  }
  REQUIRE(found >= 6);
}

TEST_CASE("the echo keeps overrides, awkward texts and every kind of value") {
  const auto scene =
      read("straight_tube.toml", {"title=\"a \\\"quoted\\\" \\\\ title\\n with two lines\"", "boundary.0.profile=table",
                                  "boundary.0.radial_table=[[0, 2], [0.5, 1.5], [1, 0]]", "boundary.0.velocity_mm_per_s=1.23456789",
                                  "cells.0.bending_modulus_J=1.7e-19", "cells.0.spin_deg=0.1", "fluid.convection=implicit",
                                  "output.fields=[\"pressure\"]", "coupling.robin_coefficient_pg_per_um2_per_us=4.5"});
  REQUIRE(scene.title == "a \"quoted\" \\ title\n with two lines");
  REQUIRE(scene.coupling->robin_coefficient == 4.5);
  REQUIRE_FALSE(scene.output.velocity);
  REQUIRE(scene.output.pressure);
  require_same(scene, read_back(scene.resolved));
}

TEST_CASE("the stretching case names its experiment by a path that holds from anywhere") {
  const auto scene = read("stretch.toml");
  REQUIRE(scene.stretching->experiment == (cases / "mills2004.csv").lexically_normal().string());
  REQUIRE(scene.stretching->force_pN == 200);
  REQUIRE_FALSE(scene.fluid);
  REQUIRE_FALSE(scene.grid);
  REQUIRE_FALSE(scene.coupling);
  REQUIRE_FALSE(scene.output.fields);
  REQUIRE(scene.output.cells);
}

TEST_CASE("units of the case file become internal ones") {
  const auto scene = read("straight_tube.toml");
  REQUIRE(scene.grid->nodes == std::array{31, 31, 51});
  const auto& inlet = scene.boundaries.at(0);
  REQUIRE(inlet.type == BoundarySettings::Type::velocity_inlet);
  REQUIRE(inlet.speed == 2e-3);  // um/us; 2 mm/s
  REQUIRE_FALSE(inlet.velocity);
  REQUIRE(inlet.ramp_us == 20);
  // 2.4e-19 J in fJ, to rounding
  REQUIRE(scene.cells.at(0).bending_modulus_fJ == Approx(2.4e-4).epsilon(1e-14));
  REQUIRE(scene.coupling->scheme == CouplingSettings::Scheme::robin);

  const auto wall = read("couette.toml").boundaries.at(1);
  REQUIRE(wall.velocity.value() == Triple{2e-3, 0, 0});
}

namespace {

/// The straight tube with cells of two types and one with keys of its own.
Case typed_case(const std::vector<std::string>& overrides = {}) {
  const auto path = fs::temp_directory_path() / "corpuscle_test_types.toml";
  std::ifstream in(cases / "straight_tube.toml");
  std::ofstream(path) << in.rdbuf() << R"(
[[cell_types]]
name = "stiff"
vertices = 300
reference = "spheroid"
shear_modulus_uN_per_m = 20
[[cell_types]]
name = "capsule"
shape = "sphere"
radius_um = 2
law = "skalak"
skalak_c = 10
[[cells]]
type = "capsule"
center_um = [0, 0, 8]
[[cells]]
type = "stiff"
center_um = [0, 0, 14]
axis = [0, 1, 0]
[[cells]]
type = "stiff"
center_um = [0, 0, -9]
)";
  auto scene = read_case(path.string(), overrides);
  fs::remove(path);
  return scene;
}

std::vector<std::string> changed_keys(const Case& before, const Case& now, bool geometry) {
  std::vector<std::string> keys;
  for (const auto& change : case_changes(before.resolved, now.resolved))
    if (change.geometry == geometry) keys.push_back(change.key);
  return keys;
}

}  // namespace

TEST_CASE("cells have what their type says, and the echo keeps types") {
  const auto scene = typed_case({"cell_types.0.vertices=400", "cell_types.0.bending_modulus_J=1.7e-19"});
  REQUIRE(scene.cell_types.size() == 2);
  REQUIRE(scene.cells.size() == 4);
  REQUIRE(scene.cells[0].type == -1);
  const auto &capsule = scene.cells[1], &stiff = scene.cells[2];
  REQUIRE(capsule.type == 1);
  REQUIRE(capsule.shape == CellSettings::Shape::sphere);
  REQUIRE(capsule.law == CellSettings::Law::skalak);
  REQUIRE(capsule.skalak_c == 10);
  // A sheet has its own resistance to change of area, and no further one unless asked for.
  REQUIRE(capsule.area_modulus_uN_per_m == 0);
  REQUIRE(capsule.local_area_modulus_uN_per_m == 0);
  REQUIRE(stiff.vertices == 400);
  REQUIRE(stiff.shear_modulus_uN_per_m == 20);
  REQUIRE(stiff.reference_reduced_volume == 0.95);
  REQUIRE(stiff.area_modulus_uN_per_m == 236);
  REQUIRE(stiff.axis == Triple{0, 1, 0});
  REQUIRE(scene.cells[3].center_um == Triple{0, 0, -9});
  REQUIRE(scene.cells[3].vertices == 400);
  require_same(scene, read_back(scene.resolved));
}

TEST_CASE("keys without effect on membranes that are forces are remarked upon") {
  REQUIRE(read("straight_tube.toml").remarks.empty());
  const auto scene = read("straight_tube.toml", {"coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0"});
  REQUIRE(scene.remarks.size() == 2);
  REQUIRE(scene.remarks[0] == "cells.0.mass_pg = 100 has no effect with coupling.scheme = \"force\": membranes have no mass of their own");
  REQUIRE(scene.remarks[1].rfind("cells.0.interior = \"empty\" has no effect", 0) == 0);
  require_same(scene, read_back(scene.resolved));
  const auto typed = typed_case({"coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "cell_types.1.mass_pg=30"});
  REQUIRE(typed.remarks.size() == 3);
  REQUIRE(typed.remarks[2].find("cells and no [contact]") != std::string::npos);
  const auto touching =
      typed_case({"coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "cell_types.1.mass_pg=30", "contact.range_um=0.3"});
  REQUIRE(touching.remarks.size() == 2);
  REQUIRE(touching.contact->range_um == 0.3);
  REQUIRE(typed.remarks[0].rfind("cell_types.1.mass_pg = 30 (and 1 more) has no effect", 0) == 0);
}

TEST_CASE("membranes with viscosity that are forces begin with short steps, unless the case says otherwise") {
  const std::string viscous = "cell_types.0.membrane_viscosity_N_s_per_m=5e-7";
  const auto first = [&](const std::vector<std::string>& overrides) { return read("two_cells.toml", overrides).time.first_step_us; };
  CHECK(first({}) == 0);
  CHECK(first({viscous}) == 20.0 / 16);
  CHECK(first({viscous, "time.first_step_us=5"}) == 5);
  const auto whole = read("two_cells.toml", {viscous, "time.first_step_us=0"});
  CHECK(whole.time.first_step_us == 0);
  REQUIRE(whole.remarks.size() == 1);
  CHECK(whole.remarks[0].find("leave the key out") != std::string::npos);
  const auto scene = read("two_cells.toml", {viscous});
  CHECK(scene.remarks.empty());
  require_same(scene, read_back(scene.resolved));
  CHECK(read("straight_tube.toml", {"time.first_step_us=0", "cells.0.membrane_viscosity_N_s_per_m=5e-7"}).remarks.empty());
}

TEST_CASE("keys that mean nothing in a scene are remarked upon") {
  const auto only = [](const std::string& key, const std::string& override) {
    const auto scene = read("two_cells.toml", {override});
    INFO(override);
    REQUIRE(scene.remarks.size() == 1);
    CHECK(scene.remarks[0].find(key) != std::string::npos);
  };
  REQUIRE(read("two_cells.toml").remarks.empty());
  only("time.first_step_us = 40 is longer", "time.first_step_us=40");
  only("no side is an \"outflow\"", "time.stop_before_outflow_um=2");
  only("less than the shortest step, 20 us", "output.history_every_us=1e-6");
  only("volume_modulus_Pa = 1000", "cell_types.0.volume_modulus_Pa=1000");
  // Slips of the unit.
  only("cell_types.0.shear_modulus_uN_per_m = 6.32e-06 is far from what there is: red cells have 2 to 20 uN/m",
       "cell_types.0.shear_modulus_uN_per_m=6.32e-6");
  only("cell_types.0.shear_modulus_uN_per_m = 6320", "cell_types.0.shear_modulus_uN_per_m=6320");
  only("cell_types.0.membrane_viscosity_N_s_per_m = 0.3", "cell_types.0.membrane_viscosity_N_s_per_m=0.3");
  only("cell_types.0.bending_modulus_J = 2.4e-12", "cell_types.0.bending_modulus_J=2.4e-12");
  only("fluid.density_pg_per_um3 = 1000", "fluid.density_pg_per_um3=1000");
  only("fluid.pressure_gradient_Pa_per_um = 1e+06", "fluid.pressure_gradient_Pa_per_um=[-1e6, 0, 0]");
  const Case pushed = read("two_cells.toml", {"cells.0.push_nN=[0, 0, 200]", "cells.1.push_nN=[0, 0, -200]"});
  REQUIRE(pushed.remarks.size() == 2);
  CHECK(pushed.remarks[0].rfind("cells.0.push_nN = 200 is far from what there is", 0) == 0);
  // By default samples are ten steps, 200 us, apart.
  const auto sampled = [&](const char* end) { return read("two_cells.toml", {"blood.bins=4", std::string("time.end_us=") + end}).remarks; };
  REQUIRE(sampled("180").size() == 1);
  CHECK(sampled("180")[0].rfind("blood.sample_every_us: unless it is set", 0) == 0);
  CHECK(sampled("200").empty());
  only("fluid.kinematic_viscosity_um2_per_us = 1.1e-06", "fluid.kinematic_viscosity_um2_per_us=1.1e-6");
  for (const char* usual : {"capsule_shear.toml", "straight_tube.toml", "blood_tube.toml", "relax.toml", "stretch.toml"})
    CHECK(read(usual).remarks.empty());
  // Nothing is left of it that could limit a step.
  CHECK(read("two_cells.toml", {"cell_types.0.volume_modulus_Pa=1000"}).cells[0].volume_modulus_Pa == 0);
  CHECK(read("straight_tube.toml").cells[0].volume_modulus_Pa == 248);
  const auto path = fs::temp_directory_path() / "corpuscle_test_unused.toml";
  std::ifstream in(cases / "two_cells.toml");
  std::ofstream(path) << in.rdbuf() << "\n[[cell_types]]\nname = \"idle\"\n";
  const auto idle = read_case(path.string());
  REQUIRE(idle.remarks.size() == 1);
  CHECK(idle.remarks[0].find("cell_types.1 (\"idle\")") != std::string::npos);
}

TEST_CASE("a restart lists changed laws and constants of types, and refuses other shapes") {
  const auto before = typed_case();
  using Keys = std::vector<std::string>;
  const auto now = typed_case({"cells.0.law=neo-hookean", "cell_types.1.skalak_c=5", "cell_types.0.reference_reduced_volume=0.97"});
  REQUIRE(changed_keys(before, now, true).empty());
  // A sheet has no terms of area by default.
  REQUIRE(changed_keys(before, now, false) == Keys{"cell_types.0.reference_reduced_volume", "cell_types.1.skalak_c", "cells.0.law",
                                                   "cells.0.area_modulus_uN_per_m", "cells.0.local_area_modulus_uN_per_m"});
  const auto disc = read("straight_tube.toml");
  REQUIRE(changed_keys(disc, read("straight_tube.toml", {"cells.0.diameter_um=6"}), true) == Keys{"cells.0.diameter_um"});
  REQUIRE(changed_keys(before, typed_case({"cell_types.1.radius_um=3"}), true) == Keys{"cell_types.1.radius_um"});
  REQUIRE(changed_keys(before, typed_case({"cell_types.0.diameter_um=6"}), true) == Keys{"cell_types.0.diameter_um"});
  REQUIRE(changed_keys(before, typed_case({"cell_types.0.vertices=500"}), true) == Keys{"cell_types.0.vertices"});
  REQUIRE(changed_keys(before, typed_case({"cells.3.type=capsule"}), true) == Keys{"cells.3.type"});
  // Membranes as forces have fluid inside; the others differ in how they move only.
  const auto sharp = typed_case({"cells.0.membrane_viscosity_N_s_per_m=0"});
  const auto force = typed_case({"cells.0.membrane_viscosity_N_s_per_m=0", "coupling.scheme=force"});
  REQUIRE(changed_keys(sharp, force, true) == Keys{"coupling.scheme"});
  REQUIRE(changed_keys(force, sharp, true) == Keys{"coupling.scheme"});
  REQUIRE(changed_keys(before, typed_case({"coupling.scheme=iterated"}), true).empty());
}

TEST_CASE("a flow with cells but no [coupling] is coupled by robin") {
  const auto path = fs::temp_directory_path() / "corpuscle_test_uncoupled.toml";
  std::ifstream in(cases / "straight_tube.toml");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto start = text.find("[coupling]");
  text.erase(start, text.find("[output]") - start);
  std::ofstream(path) << text;
  const auto scene = read_case(path.string());
  fs::remove(path);
  REQUIRE(scene.coupling->scheme == CouplingSettings::Scheme::robin);
  REQUIRE(scene.coupling->robin_coefficient < 0);  // chosen from the grid
}

TEST_CASE("convection takes true, false and two words") {
  using Convection = FluidSettings::Convection;
  const auto with = [](const std::string& value) { return read("tube_flow.toml", {"fluid.convection=" + value}).fluid->convection; };
  REQUIRE(with("true") == Convection::extrapolated);
  REQUIRE(with("false") == Convection::none);
  REQUIRE(with("extrapolated") == Convection::extrapolated);
  REQUIRE(with("\"implicit\"") == Convection::implicit);
  REQUIRE_THROWS_AS(with("explicit"), InputError);
}

TEST_CASE("the keys that scripts rely on can all be set") {
  const auto scene =
      read("straight_tube.toml",
           {"time.step_us=2", "time.end_us=10", "grid.nodes=[21,22,23]", "fluid.density_pg_per_um3=1.1",
            "fluid.kinematic_viscosity_um2_per_us=0.9", "fluid.convection=false", "cells.0.vertices=1000", "cells.0.mass_pg=7200",
            "cells.0.reference=spontaneous-angle", "cells.0.interior=empty", "cells.0.shear_modulus_uN_per_m=5", "coupling.scheme=aitken",
            "coupling.tolerance=1e-4", "output.every_us=5", "output.fields=false"});
  REQUIRE(scene.time.step_us == 2);
  REQUIRE(scene.time.end_us == 10);
  REQUIRE(scene.grid->nodes == std::array{21, 22, 23});
  REQUIRE(scene.fluid->density_pg_per_um3 == 1.1);
  REQUIRE(scene.fluid->kinematic_viscosity_um2_per_us == 0.9);
  REQUIRE(scene.cells[0].vertices == 1000);
  REQUIRE(scene.cells[0].mass_pg == 7200);
  REQUIRE(scene.cells[0].reference == CellSettings::Reference::spontaneous_angle);
  REQUIRE(scene.cells[0].shear_modulus_uN_per_m == 5);
  REQUIRE(scene.coupling->scheme == CouplingSettings::Scheme::iterated);
  REQUIRE(scene.coupling->tolerance == 1e-4);
  REQUIRE(scene.output.every_us == 5);
  REQUIRE_FALSE(scene.output.fields);
}
