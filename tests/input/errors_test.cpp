// Every message about a wrong case file is provoked, and must name file, line, key, value and what is allowed.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "core/nearest.hpp"
#include "input/case.hpp"

using namespace corpuscle;
namespace fs = std::filesystem;

namespace {

const fs::path cases = fs::path(CORPUSCLE_SOURCE_DIR) / "cases";

// A complete flow case, short enough to count its lines; `@` marks where a test puts its own text.
const std::string flow = R"([time]
step_us = 1
end_us = 10
[grid]
generator = "box"
nodes = [5, 5, 5]
lower_um = [0, 0, 0]
upper_um = [4, 4, 4]
[fluid]
[[boundary]]
side = "k_min"
type = "velocity_inlet"
velocity_mm_per_s = 2
[[boundary]]
side = "k_max"
type = "outflow"
[[boundary]]
side = "i_min"
type = "wall"
[[boundary]]
side = "i_max"
type = "wall"
[[boundary]]
side = "j_min"
type = "wall"
[[boundary]]
side = "j_max"
type = "wall"
)";

std::string message(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const auto path = fs::temp_directory_path() / "corpuscle_wrong.toml";
  std::ofstream(path) << text;
  try {
    read_case(path.string(), overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

void require_parts(const std::string& found, const std::vector<std::string>& parts) {
  INFO("message: " << found);
  for (const auto& part : parts) REQUIRE_THAT(found, Catch::Contains(part));
}

}  // namespace

TEST_CASE("the flow case that the other tests break is right") { REQUIRE(message(flow) == "accepted"); }

TEST_CASE("wrong values: file, line, key, value and what is allowed") {
  struct Row {
    std::string from, to;
    std::vector<std::string> parts;
  };
  const std::vector<Row> rows{
      {"step_us = 1", "step_us = -1", {"wrong.toml:2: time.step_us = -1", "a number above 0"}},
      {"step_us = 1", "step_us = \"1\"", {":2: time.step_us = ", "a number above 0"}},
      {"step_us = 1", "step_us = nan", {":2: time.step_us = nan", "a number above 0"}},
      {"upper_um = [4, 4, 4]", "upper_um = [4, 4, 1e200]", {":8: grid.upper_um = [4, 4, 1e+200]", "10000000"}},
      {"upper_um = [4, 4, 4]", "upper_um = [4, 4, inf]", {":8: grid.upper_um = [4, 4, inf]", "each a number"}},
      {"lower_um = [0, 0, 0]", "lower_um = [nan, 0, 0]", {":7: grid.lower_um = [nan, 0, 0]", "each a number"}},
      {"step_us = 1", "step_us = 11", {":2: time.step_us = 11", "must not exceed end_us = 10"}},
      {"nodes = [5, 5, 5]", "nodes = [5, 5]", {":6: grid.nodes", "three whole numbers", "from 4 to"}},
      {"nodes = [5, 5, 5]", "nodes = [5, 5, 3]", {":6: grid.nodes", "from 4 to"}},
      {"nodes = [5, 5, 5]", "nodes = [5, 5, 5.5]", {":6: grid.nodes", "three whole numbers"}},
      {"lower_um = [0, 0, 0]", "lower_um = [0, 0]", {":7: grid.lower_um", "three numbers [x, y, z]"}},
      {"upper_um = [4, 4, 4]", "upper_um = [4, 0, 4]", {":8: grid.upper_um", "must exceed lower_um = [0, 0, 0]"}},
      {"\"box\"", "\"boxes\"", {":5: grid.generator = ", "one of \"box\"", "did you mean \"box\"?"}},
      {"[fluid]", "[fluid]\ndensity_pg_per_um3 = 0", {":10: fluid.density_pg_per_um3 = 0", "above 0"}},
      {"[fluid]", "[fluid]\nkinematic_viscosity_um2_per_us = -1", {":10: fluid.kinematic_viscosity_um2_per_us = -1"}},
      {"[fluid]", "[fluid]\nconvection = 1", {":10: fluid.convection = 1", "\"extrapolated\" or \"implicit\""}},
      {"[fluid]", "[fluid]\nmomentum_tolerance = 2", {":10: fluid.momentum_tolerance = 2", "from 1e-15 to 0.1"}},
      {"[fluid]", "[fluid]\nmax_iterations = 1.5", {":10: fluid.max_iterations = 1.5", "a whole number from 1"}},
      {"[fluid]",
       "[fluid]\npressure_gradient_Pa_per_um = [0, 0, 1]",
       {":10: fluid.pressure_gradient_Pa_per_um", "needs a pair of periodic sides"}},
      {"[fluid]", "[fluid]\ndensity_pg_per_um3 = 1e300", {":10: fluid.density_pg_per_um3 = 1e+300", "at most"}},
      {"velocity_mm_per_s = 2", "velocity_mm_per_s = true", {":13: boundary.0.velocity_mm_per_s = true", "mean speed"}},
      {"velocity_mm_per_s = 2", "velocity_mm_per_s = [1, 2]", {":13: boundary.0.velocity_mm_per_s", "three numbers"}},
      {"\"velocity_inlet\"", "\"inlet\"", {":12: boundary.0.type", "one of \"velocity_inlet\", \"outflow\""}},
      {"[fluid]", "[output]\nfields = [\"velocty\"]\n[fluid]", {":10: output.fields", "\"velocity\", \"pressure\", \"kind\""}},
      {"[fluid]", "[output]\ncells = true\n[fluid]", {":10: output.cells", "no [[cells]]"}},
  };
  for (const auto& row : rows) require_parts(message(replaced(flow, row.from, row.to)), row.parts);
}

TEST_CASE("unknown keys and sections are errors with the nearest known one") {
  struct Row {
    std::string from, to;
    std::vector<std::string> parts;
  };
  const std::vector<Row> rows{
      {"step_us", "setp_us", {":2: time.setp_us = 1", "unknown key", "did you mean 'step_us'?"}},
      {"step_us", "step_ms", {":2: time.step_ms = 1", "did you mean 'step_us'?", "unit is part of the name"}},
      {"velocity_mm_per_s",
       "velocity_um_per_us",
       {":13: boundary.0.velocity_um_per_us = 2", "did you mean 'velocity_mm_per_s'?", "unit is part of the name"}},
      {"[fluid]", "[fluid]\nzzzz = 1", {":10: fluid.zzzz = 1", "known here: density_pg_per_um3"}},
      {"generator", "generater", {":5: grid.generater", "did you mean 'generator'?"}},
      {"[fluid]", "[fluids]", {":9: fluids", "unknown section", "did you mean 'fluid'?"}},
      {"[time]", "tilte = \"x\"\n[time]", {":1: tilte", "unknown key", "did you mean 'title'?"}},
      {"[time]", "title = 1\n[time]", {":1: title = 1", "a text in quotes"}},
      {"[fluid]", "[[fluid]]", {":9: fluid", "write it as one section, [fluid]"}},
      {"[fluid]", "[cells]\nvertices = 500\n[fluid]", {":9: cells", "[[cells]]"}},
  };
  for (const auto& row : rows) require_parts(message(replaced(flow, row.from, row.to)), row.parts);
}

TEST_CASE("missing keys and sections are named") {
  struct Row {
    std::string from, to;
    std::vector<std::string> parts;
  };
  const std::vector<Row> rows{
      {"end_us = 10\n", "", {":1: time.end_us: required key is missing", "a number above 0"}},
      {"generator = \"box\"\n", "", {":4: grid.generator: required key is missing", "one of \"box\""}},
      {"lower_um = [0, 0, 0]\n", "", {":4: grid.lower_um: required key is missing", "three numbers"}},
      {"velocity_mm_per_s = 2\n", "", {":10: boundary.0.velocity_mm_per_s: required key is missing", "inward normal"}},
      {"side = \"k_min\"\n", "", {":10: boundary.0.side: required key is missing"}},
      {"[time]\nstep_us = 1\nend_us = 10\n", "", {"wrong.toml: section [time] is missing", "step_us and end_us"}},
      {"[fluid]\n", "[fluid]\n[[cells]]\n", {":10: cells.0.center_um: required key is missing", "three numbers"}},
      {"[fluid]\n", "[fluid]\n[[bodies]]\n", {":10: bodies.0.shape: required key is missing", "\"sphere\""}},
      {"[fluid]\n", "", {":9: boundary", "need a [fluid]"}},
  };
  for (const auto& row : rows) require_parts(message(replaced(flow, row.from, row.to)), row.parts);
  require_parts(message(""), {"wrong.toml: nothing to compute", "[fluid] or [stretching]"});
}

TEST_CASE("grid generators take their own keys only") {
  const std::string box = "generator = \"box\"\nnodes = [5, 5, 5]\nlower_um = [0, 0, 0]\nupper_um = [4, 4, 4]";
  const auto grid = [&](const std::string& text) { return message(replaced(flow, box, text)); };
  const std::string swept = "generator = \"swept_tube\"\nnodes = [5, 5, 5]\ndiameter_um = 10\n";
  require_parts(grid(box + "\ndiameter_um = 3"), {":9: grid.diameter_um = 3", "only generator = \"straight_tube\" or"});
  require_parts(grid("generator = \"straight_tube\"\nnodes = [5, 5, 5]\ndiameter_um = 10"),
                {":4: grid.length_um: required key is missing"});
  require_parts(grid(swept + "length_um = 3\ncenterline = \"arc\""), {"grid.length_um = 3", "only generator"});
  require_parts(grid(swept), {"grid.centerline: required key is missing", "\"helix\""});
  require_parts(grid(swept + "centerline = \"spline\""), {"grid.points_um: required key is missing"});
  require_parts(grid(swept + "centerline = \"spline\"\npoints_um = [[0, 0, 0], [0, 0, 1]]"), {":9: grid.points_um", "3 or more rows"});
  require_parts(grid(swept + "centerline = \"spline\"\npoints_um = [[0, 0, 0], [0, 0, 0], [0, 0, 1]]"),
                {":9: grid.points_um", "points 0 and 1 coincide"});
  require_parts(grid(swept + "centerline = \"arc\"\narc_angle_deg = 90\narc_radius_um = 4"),
                {":10: grid.arc_radius_um = 4", "half the diameter, 5 um"});
  require_parts(grid(swept + "centerline = \"arc\"\nhelix_turns = 2"), {"grid.helix_turns = 2", "centerline = \"helix\""});
  require_parts(grid("generator = \"file\"\nfile = \"no_such.h5\""), {":6: grid.file", "no_such.h5", "there is no file"});
  require_parts(grid("generator = \"file\"\nnodes = [5, 5, 5]"), {":6: grid.nodes", "the file decides"});
}

TEST_CASE("a pressure gradient along a direction that is not periodic is refused, one along a periodic one is not") {
  auto slit = flow;
  for (const char* side : {"i_min", "i_max"}) {
    const std::string entry = "side = \"" + std::string(side) + "\"\ntype = ";
    slit = replaced(slit, entry + "\"wall\"", entry + "\"periodic\"");
  }
  const auto with = [&](const std::string& value) {
    return message(replaced(slit, "[fluid]\n", "[fluid]\npressure_gradient_Pa_per_um = " + value + "\n"));
  };
  CHECK(with("[-0.8, 0, 0]") == "accepted");
  require_parts(with("[-0.8, 0, 1e-3]"), {":10: fluid.pressure_gradient_Pa_per_um", "z component drives nothing", "k_min and k_max"});
  require_parts(with("[0, 0.5, 0]"), {":10: fluid.pressure_gradient_Pa_per_um", "y component drives nothing", "j_min and j_max"});
}

TEST_CASE("boundaries must make sense together") {
  const auto with = [](const std::string& from, const std::string& to) { return message(replaced(flow, from, to)); };
  require_parts(with("\"j_max\"", "\"j_min\""), {":27: boundary.5.side", "already has a [[boundary]] (boundary.4)"});
  require_parts(with("[[boundary]]\nside = \"j_max\"\ntype = \"wall\"\n", ""), {":10: boundary: ", "no [[boundary]] for j_max"});
  require_parts(with("\"outflow\"", "\"wall\""), {":12: boundary.0.type", "no way out"});
  require_parts(with("side = \"i_min\"\ntype = \"wall\"", "side = \"i_min\"\ntype = \"periodic\""),
                {":19: boundary.2.type", "make i_max periodic as well"});
  require_parts(with("type = \"outflow\"", "type = \"outflow\"\nramp_us = 3"), {":17: boundary.1.ramp_us = 3", "change with time"});
  require_parts(with("type = \"outflow\"", "type = \"outflow\"\nvelocity_mm_per_s = 3"),
                {":17: boundary.1.velocity_mm_per_s = 3", "have a velocity"});
  require_parts(with("type = \"outflow\"", "type = \"moving_wall\"\nvelocity_mm_per_s = 3"),
                {":17: boundary.1.velocity_mm_per_s = 3", "three numbers"});
  const std::string inlet = "velocity_mm_per_s = 2";
  require_parts(with(inlet, inlet + "\nramp_us = 2\ntime_table = [[0, 0], [1, 1]]"), {":14: boundary.0.ramp_us = 2", "not both"});
  require_parts(with(inlet, inlet + "\ntime_table = [[1, 0], [1, 1]]"), {":14: boundary.0.time_table", "times must rise"});
  require_parts(with(inlet, inlet + "\nprofile = \"table\""), {"boundary.0.radial_table: required key is missing"});
  require_parts(with(inlet, inlet + "\nradial_table = [[0, 2], [1, 0]]"), {":14: boundary.0.radial_table", "profile = \"table\""});
  require_parts(with(inlet, inlet + "\nprofile = \"table\"\nradial_table = [[0, 2], [2, 0]]"),
                {":15: boundary.0.radial_table", "at most 1"});
  require_parts(with(inlet, "velocity_mm_per_s = [0, 0, 2]\nprofile = \"parabolic\""), {":14: boundary.0.profile", "give a mean speed"});
  auto tube = replaced(flow, "\"box\"", "\"straight_tube\"");
  tube = replaced(tube, "lower_um = [0, 0, 0]\nupper_um = [4, 4, 4]", "diameter_um = 10\nlength_um = 20");
  require_parts(message(replaced(tube, "side = \"i_min\"\ntype = \"wall\"", "side = \"i_min\"\ntype = \"symmetry\"")),
                {":19: boundary.2.type", "part of the tube's wall"});
}

TEST_CASE("cells and bodies are checked") {
  const auto cell = [](const std::string& text) {
    return message(replaced(flow, "[fluid]\n", "[fluid]\n[[cells]]\ncenter_um = [2, 2, 2]\n" + text + "\n"));
  };
  REQUIRE(cell("") == "accepted");
  require_parts(cell("vertices = 199"), {":12: cells.0.vertices = 199", "from 200 to 30000"});
  require_parts(cell("vertices = 30001"), {":12: cells.0.vertices = 30001", "from 200 to 30000"});
  require_parts(cell("vertices = 500.5"), {":12: cells.0.vertices = 500.5", "a whole number"});
  require_parts(cell("mass_pg = 0"), {":12: cells.0.mass_pg = 0", "above 0"});
  require_parts(cell("mass_kg = 1e-13"), {":12: cells.0.mass_kg", "did you mean 'mass_pg'?", "convert"});
  require_parts(cell("shear_modulus_uN_per_m = 0"), {":12: cells.0.shear_modulus_uN_per_m = 0", "above 0"});
  require_parts(cell("local_area_modulus_uN_per_m = 0"), {":12: cells.0.local_area_modulus_uN_per_m = 0", "ill-posed"});
  require_parts(cell("axis = [0, 0, 0]"), {":12: cells.0.axis", "must not be zero"});
  require_parts(cell("interior = \"cytosol\""), {":12: cells.0.interior", "viscosity_ratio", "\"empty\""});
  require_parts(cell("reference = \"shapes\""), {":12: cells.0.reference", "did you mean \"shape\"?"});
  require_parts(cell("mesh = \"missing.off\""), {":12: cells.0.mesh", "there is no file", "missing.off"});
  const auto mesh = (cases / "mills2004.csv").string();
  require_parts(cell("mesh = \"" + mesh + "\""), {":12: cells.0.mesh", "OFF or STL"});
  for (const char* key : {"scale = 2", "recenter = false", "align = false"})
    require_parts(cell(key), {":12: cells.0." + std::string(key), "only a cell with a mesh file"});
  const auto surface = (fs::temp_directory_path() / "corpuscle_surface.off").string();
  std::ofstream(surface) << "read later\n";
  const std::string from_file = "mesh = \"" + surface + "\"\n";
  REQUIRE(cell(from_file + "scale = 1000\nrecenter = false\nalign = false") == "accepted");
  require_parts(cell(from_file + "scale = 0"), {":13: cells.0.scale = 0", "above 0"});
  require_parts(cell(from_file + "recenter = 1"), {":13: cells.0.recenter = 1", "true or false"});
  require_parts(cell(from_file + "recentre = true"), {":13: cells.0.recentre", "did you mean 'recenter'?"});
  require_parts(cell("[coupling]\nscheme = \"strong\""), {":13: coupling.scheme", "\"robin\", \"iterated\", \"loose\""});
  const std::string force = "[coupling]\nscheme = \"force\"\n";
  REQUIRE(cell(force + "kernel = \"four-point\"\nslip = false") == "accepted");
  require_parts(cell(force + "kernel = \"two-point\""), {":14: coupling.kernel", "\"three-point\", \"four-point\""});
  REQUIRE(cell(force + "pressure = \"sharp\"") == "accepted");
  require_parts(cell(force + "pressure = \"smeared\""), {":14: coupling.pressure", "\"spread\", \"sharp\""});
  for (const char* key : {"tolerance = 0.001", "max_iterations = 10", "robin_in_iterated = true", "acceleration = \"aitken\""})
    require_parts(cell(force + key), {":14: coupling." + std::string(key), "only scheme = \"iterated\""});
  require_parts(cell(force + "robin_coefficient_pg_per_um2_per_us = 1"), {":14: coupling.robin_coefficient", "move with the fluid"});
  for (const char* key : {"kernel = \"three-point\"", "slip = true", "pressure = \"spread\""})
    require_parts(cell("[coupling]\n" + std::string(key)), {":13: coupling." + std::string(key), "only scheme = \"force\""});
  REQUIRE(cell("membrane_viscosity_N_s_per_m = 1e-7\nviscosity_ratio = 5\n" + force) == "accepted");
  for (const char* key : {"viscosity_ratio = 0.05", "viscosity_ratio = 60"})
    require_parts(cell(std::string(key) + "\n" + force),
                  {":12: cells.0." + std::string(key), "from 0.1 to 50", "inside over that outside"});
  require_parts(cell("viscosity_ratio = 5"), {":12: cells.0.viscosity_ratio", "coupling.scheme = \"force\"", "no fluid inside"});
  require_parts(cell("start_stretch = [1, 3, 1]"), {":12: cells.0.start_stretch", "from 0.5 to 2"});
  require_parts(cell("[coupling]\nscheme = \"iterated\"\ntolerance = 1"), {":14: coupling.tolerance = 1", "from 1e-12 to 0.5"});
  for (const char* key : {"tolerance = 1e-4", "max_iterations = 5", "acceleration = \"aitken\"", "robin_in_iterated = false"})
    require_parts(cell("[coupling]\n" + std::string(key)),
                  {":13: coupling." + std::string(key).substr(0, std::string(key).find(' ')), "only scheme = \"iterated\""});
  for (const char* key : {"shear_modulus_uN_per_m = 1e300", "volume_modulus_Pa = 1e300", "axis = [1e200, 0, 1e200]", "mass_pg = 1e300"}) {
    const std::string name(key, std::string(key).find(' '));
    require_parts(cell(key), {":12: cells.0." + name, "must be", "a number"});
  }
  require_parts(message(replaced(flow, "[fluid]\n", "[fluid]\n[[cells]]\ncenter_um = [1e300, 0, 0]\n")),
                {":11: cells.0.center_um = [1e+300, 0, 0]", "each a number from -1"});
  require_parts(cell("[contact]"), {":12: contact", "coupling.scheme = \"force\""});
  const std::string touching = "[contact]\n[coupling]\nscheme = \"force\"\n";
  REQUIRE(cell("push_nN = [0, 0, 1]\n" + touching) == "accepted");
  const auto contact = [&](const std::string& key) { return cell("[coupling]\nscheme = \"force\"\n[contact]\n" + key); };
  REQUIRE(contact("range_um = 0.3\naggregation_energy_fJ_per_um2 = 1e-3\naggregation_range_um = 0.5") == "accepted");
  require_parts(contact("range_um = 0"), {":15: contact.range_um = 0", "from 0.01 to 2"});
  require_parts(contact("pressure_Pa = -1"), {":15: contact.pressure_Pa = -1", "from 0.01 to"});
  require_parts(contact("aggregation_range_um = 0.5"), {":15: contact.aggregation_range_um", "only with aggregation_energy_fJ_per_um2"});
  require_parts(contact("aggregation_energy_fJ_per_um2 = 1e-3\naggregation_range_um = 0.2"),
                {":16: contact.aggregation_range_um", "1.2 times range_um"});
  require_parts(contact("pressure_kPa = 1"), {":15: contact.pressure_kPa", "did you mean 'pressure_Pa'?"});
  require_parts(cell("[blood]"), {":12: blood", "coupling.scheme = \"force\""});
  require_parts(message(flow + "\n[blood]\n"), {"blood", "there are no [[cells]] to measure"});
  const auto blood = [&](const std::string& key) { return cell("[coupling]\nscheme = \"force\"\n[blood]\n" + key); };
  REQUIRE(blood("sample_every_us = 10\nbins = 12\nlayer_window_um = 0.5") == "accepted");
  require_parts(blood("bins = 1"), {":15: blood.bins = 1", "from 2 to 32"});
  require_parts(blood("bins = 33"), {":15: blood.bins = 33", "from 2 to 32"});
  require_parts(blood("sample_every_us = 0"), {":15: blood.sample_every_us = 0", "above 0"});
  require_parts(blood("layer_window_um = 0"), {":15: blood.layer_window_um = 0", "from 0.1"});
  require_parts(blood("from_us = 1e9"), {":15: blood.from_us", "time.end_us", "begin earlier"});
  require_parts(blood("sample_every_us = 1e9"), {":15: blood.sample_every_us", "no sample, of those"});
  require_parts(blood("from_us = 9\nsample_every_us = 4"), {":16: blood.sample_every_us", "no sample"});
  REQUIRE(blood("from_us = 7\nsample_every_us = 4") == "accepted");      // at 8 us
  REQUIRE(blood("from_us = 9.5\nsample_every_us = 4.6") == "accepted");  // of 9.2 us, at 10: the first step that has come to it
  require_parts(blood("from_ms = 1"), {":15: blood.from_ms", "did you mean 'from_us'?"});
  require_parts(message(flow + "\n[output]\nfields = [\"wall_stress\"]\n"), {"output.fields", "\"wall_shear_stress\""});
  require_parts(cell("[output]\ncells_in_history = -1"), {":13: output.cells_in_history = -1", "from 0"});
  require_parts(cell("push_nN = [0, 0, 1]"), {":12: cells.0.push_nN", "coupling.scheme = \"force\""});

  const auto body = [](const std::string& text) {
    return message(replaced(flow, "[fluid]\n", "[fluid]\n[[bodies]]\ncenter_um = [2, 2, 2]\n" + text + "\n"));
  };
  REQUIRE(body("shape = \"sphere\"\nradius_um = 1") == "accepted");
  require_parts(body("shape = \"sphere\""), {":10: bodies.0.radius_um: required key is missing"});
  require_parts(body("shape = \"sphere\"\nradius_um = 1\nsemi_axes_um = [1, 1, 1]"),
                {":14: bodies.0.semi_axes_um", "shape = \"ellipsoid\""});
  require_parts(body("shape = \"ellipsoid\"\nsemi_axes_um = [1, 1, -1]"), {":13: bodies.0.semi_axes_um", "each a number above 0"});
  require_parts(body("shape = \"sphere\"\nradius_um = 1\nvertices = 5"), {":14: bodies.0.vertices = 5", "42"});
  require_parts(body("shape = \"sphere\"\nradius_um = 1\nvelocity_um_per_us = [0, 0, 1]"),
                {":14: bodies.0.velocity_um_per_us", "did you mean 'velocity_mm_per_s'?"});
  for (const char* key : {"axis = [1, 0, 0]", "spin_deg = 10"})
    require_parts(body("shape = \"sphere\"\nradius_um = 1\n" + std::string(key)), {":14: bodies.0.", "a sphere is the same"});
  const std::string ellipsoid = "shape = \"ellipsoid\"\nsemi_axes_um = [1, 1, 2]\n";
  REQUIRE(body(ellipsoid + "axis = [1, 0, 0]\nspin_deg = 10") == "accepted");
  require_parts(body(ellipsoid + "axis = [0, 0, 0]"), {":14: bodies.0.axis", "must not be zero"});
  require_parts(body(ellipsoid + "scale = 2"), {":14: bodies.0.scale = 2", "only shape = \"file\""});
  REQUIRE(body("shape = \"file\"\nfile = \"" + surface + "\"\nscale = 0.001\nrecenter = true\naxis = [0, 1, 0]") == "accepted");
  fs::remove(surface);
  require_parts(body("shape = \"sphere\"\nradius_um = 1\n[coupling]"), {":14: coupling: there are no [[cells]]"});
  const std::string beside = "shape = \"sphere\"\nradius_um = 1\n[[cells]]\ncenter_um = [2, 2, 2]\n[coupling]\nscheme = \"force\"";
  REQUIRE(body(beside + "\n[contact]") == "accepted");
  require_parts(body(beside), {"bodies: ", "add [contact]"});
  require_parts(body(beside + "\n[contact]\n[blood]"), {"blood: ", "without obstacles", "[[bodies]]"});
  require_parts(body(beside + "\n[contact]\n[[cell_types]]\nname = \"red\"\n[[populations]]\ntype = \"red\"\ncount = 2"),
                {"populations: ", "not packed around rigid bodies", "[[cells]]"});
}

TEST_CASE("shapes, laws and resting states of cells take their own keys only") {
  const auto cell = [](const std::string& text) {
    return message(replaced(flow, "[fluid]\n", "[fluid]\n[[cells]]\ncenter_um = [2, 2, 2]\n" + text + "\n"));
  };
  const std::string sphere = "shape = \"sphere\"\nradius_um = 3\n", skalak = "law = \"skalak\"\n";
  REQUIRE(cell(sphere + skalak + "skalak_c = 10\nvertices = 42\nbending_modulus_J = 0\ninflation = 0.05") == "accepted");
  REQUIRE(cell("diameter_um = 6\nreference = \"spheroid\"\nreference_reduced_volume = 0.93") == "accepted");
  REQUIRE(cell("shape = \"ellipsoid\"\nsemi_axes_um = [3, 2, 1]\nlaw = \"neo-hookean\"") == "accepted");
  require_parts(cell("shape = \"disc\""), {":12: cells.0.shape = \"disc\"", "one of \"biconcave\", \"sphere\", \"ellipsoid\""});
  require_parts(cell("shape = \"sphere\""), {":10: cells.0.radius_um: required key is missing", "from 0.5 to 50"});
  require_parts(cell("radius_um = 3"), {":12: cells.0.radius_um = 3", "only shape = \"sphere\""});
  require_parts(cell(sphere + "diameter_um = 6"), {":14: cells.0.diameter_um = 6", "only shape = \"biconcave\""});
  require_parts(cell("diameter_um = 0.5"), {":12: cells.0.diameter_um = 0.5", "from 1 to 100"});
  require_parts(cell("shape = \"ellipsoid\"\nsemi_axes_um = [0.1, 0.1, 0.2]"), {":13: cells.0.semi_axes_um", "are these um?"});
  require_parts(cell("shape = \"ellipsoid\"\nsemi_axes_um = [11, 1, 1]"), {":13: cells.0.semi_axes_um", "ten times", "mesh file"});
  require_parts(cell(sphere + "vertices = 41"), {":14: cells.0.vertices = 41", "from 42 to 30000"});
  require_parts(cell("law = \"skalack\""), {":12: cells.0.law", "\"wlc-pow\", \"neo-hookean\", \"skalak\"", "did you mean \"skalak\"?"});
  require_parts(cell("skalak_c = 10"), {":12: cells.0.skalak_c = 10", "only law = \"skalak\""});
  require_parts(cell(skalak + "skalak_c = -1"), {":13: cells.0.skalak_c = -1", "from 0 to"});
  REQUIRE(cell(skalak + "local_area_modulus_uN_per_m = 0") == "accepted");
  require_parts(cell("reference_reduced_volume = 0.95"), {":12: cells.0.reference_reduced_volume", "only reference = \"spheroid\""});
  require_parts(cell("reference = \"spheroid\"\nreference_reduced_volume = 0.6"),
                {":13: cells.0.reference_reduced_volume = 0.6", "0.65 to 1"});
  require_parts(cell(sphere + "reference = \"spheroid\""), {":14: cells.0.reference", "only the built-in biconcave shape", "leave out"});
  require_parts(cell("inflation = 0.1"), {":12: cells.0.inflation = 0.1", "only shape = \"sphere\""});
  require_parts(cell(sphere + "inflation = -0.1"), {":14: cells.0.inflation = -0.1", "from 0 to 1"});

  const auto surface = (fs::temp_directory_path() / "corpuscle_shape.off").string();
  std::ofstream(surface) << "read later\n";
  const std::string mesh = "mesh = \"" + surface + "\"\n";
  REQUIRE(cell(mesh + "law = \"neo-hookean\"") == "accepted");
  for (const char* key : {"shape = \"sphere\"", "radius_um = 3", "diameter_um = 6"})
    require_parts(cell(mesh + key), {":13: cells.0.", "the mesh file decides the shape", "leave out this key or mesh"});
  require_parts(cell(mesh + "reference = \"spheroid\""), {":13: cells.0.reference", "only the built-in biconcave shape"});
  fs::remove(surface);
}

TEST_CASE("cell types are checked") {
  const std::string rbc = "[[cell_types]]\nname = \"rbc\"\n";
  const auto types = [](const std::string& text, const std::vector<std::string>& overrides = {}) {
    return message(replaced(flow, "[fluid]\n", text + "[fluid]\n"), overrides);
  };
  const std::string cell = "[[cells]]\ntype = \"rbc\"\ncenter_um = [2, 2, 2]\n";
  REQUIRE(types(rbc + cell) == "accepted");
  REQUIRE(types(rbc + cell + "axis = [1, 0, 0]\nspin_deg = 20\n") == "accepted");
  REQUIRE(types(cell + rbc) == "accepted");  // in any order
  require_parts(types("[[cell_types]]\nvertices = 300\n"), {":9: cell_types.0.name: required key is missing"});
  require_parts(types("[[cell_types]]\nname = \"\"\n"), {":10: cell_types.0.name", "must not be empty"});
  require_parts(types(rbc + rbc), {":12: cell_types.1.name = \"rbc\"", "cell_types.0 has this name already"});
  require_parts(types(rbc + "vertices = 100\n"), {":11: cell_types.0.vertices = 100", "from 200 to 30000"});
  require_parts(types(rbc + "center_um = [0, 0, 0]\n"), {":11: cell_types.0.center_um", "in the [[cells]] entry"});
  require_parts(types(rbc + "vertexes = 300\n"), {":11: cell_types.0.vertexes", "did you mean 'vertices'?"});
  require_parts(types(rbc + cell, {"cells.0.type=rcb"}),
                {"--set cells.0.type=rcb", "unknown cell type; known: \"rbc\"", "did you mean \"rbc\"?"});
  require_parts(types(cell), {":10: cells.0.type = \"rbc\"", "no [[cell_types]]", "leave out type"});
  require_parts(types(rbc + cell + "vertices = 300\n"),
                {":14: cells.0.vertices = 300", "cell's type, \"rbc\"", "set cell_types.0.vertices"});
  require_parts(types(rbc + cell + "mass_pg = 100\n"), {"cells.0.mass_pg", "set cell_types.0.mass_pg"});
  require_parts(types(rbc + cell + "spin = 300\n"), {"cells.0.spin", "unknown key; did you mean 'spin_deg'?"});
  require_parts(types(rbc + cell + "zzzz = 1\n"), {"cells.0.zzzz", "unknown key; known here: type, center_um, axis, spin_deg"});
  require_parts(types(rbc + "[[cells]]\ntype = \"rbc\"\n"), {":11: cells.0.center_um: required key is missing"});
  require_parts(types(rbc + cell, {"cell_types.0.vertices=50"}), {"--set cell_types.0.vertices=50", "from 200 to 30000"});
  require_parts(types(rbc + cell, {"cell_types.1.vertices=500"}), {"the case has 1 [[cell_types]]"});
  require_parts(types(rbc + cell, {"cell_types.vertices=500"}), {"cell_types.0.key=value"});
}

TEST_CASE("populations are checked") {
  const std::string start = "[coupling]\nscheme = \"force\"\n[[cell_types]]\nname = \"rbc\"\n[[populations]]\n";
  const auto with = [&](const std::string& keys, const std::string& before = "") {
    return message(replaced(flow, "[fluid]\n", (before.empty() ? start : before) + keys + "[fluid]\n"));
  };
  const std::string rbc = "type = \"rbc\"\n";
  REQUIRE(with(rbc + "hematocrit = 0.3\nseed = 4\ngap_um = 0.2\norientation = \"aligned\"\naxis = [1, 0, 0]\n") == "accepted");
  REQUIRE(with(rbc + "count = 3\nlower_um = [0, 0, 0]\nupper_um = [2, 4, 4]\n") == "accepted");
  require_parts(with("count = 3\n"), {":13: populations.0.type: required key is missing"});
  require_parts(with("type = \"rcb\"\ncount = 3\n"), {":14: populations.0.type = \"rcb\"", "did you mean \"rbc\"?"});
  require_parts(with(rbc), {":13: populations.0.hematocrit: required key is missing", "or count"});
  require_parts(with(rbc + "count = 3\nhematocrit = 0.3\n"), {":15: populations.0.count", "leave out one of the two"});
  require_parts(with(rbc + "hematocrit = 1.5\n"), {":15: populations.0.hematocrit = 1.5", "at most 0.8"});
  require_parts(with(rbc + "count = 0\n"), {":15: populations.0.count = 0", "from 1 to"});
  require_parts(with(rbc + "count = 3\ngap_um = -1\n"), {":16: populations.0.gap_um = -1", "from 0 to 2"});
  require_parts(with(rbc + "count = 3\naxis = [1, 0, 0]\n"), {":16: populations.0.axis", "only orientation = \"aligned\""});
  require_parts(with(rbc + "count = 3\nlower_um = [2, 0, 0]\nupper_um = [2, 4, 4]\n"), {":17: populations.0.upper_um", "above lower_um"});
  require_parts(with(rbc + "count = 3\nhematcrit = 0.3\n"), {"populations.0.hematcrit", "did you mean 'hematocrit'?"});
  const auto surface = (fs::temp_directory_path() / "corpuscle_packed.off").string();
  std::ofstream(surface) << "read later\n";
  require_parts(
      with(rbc + "count = 3\n", replaced(start, "name = \"rbc\"\n", "name = \"rbc\"\nmesh = \"" + surface + "\"\nrecenter = false\n")),
      {"cell_types.0.recenter", "by the centroid", "leave it out"});
  const std::string viscous = "name = \"rbc\"\nviscosity_ratio = 5\nmembrane_viscosity_N_s_per_m = 5e-7\n";
  REQUIRE(with(rbc + "count = 3\n", replaced(start, "name = \"rbc\"\n", viscous)) == "accepted");
  require_parts(with(rbc + "count = 3\n", "[[cell_types]]\nname = \"rbc\"\n[[populations]]\n"),
                {"populations.0", "coupling.scheme = \"force\"", "[[cells]]"});
  require_parts(with(rbc + "count = 3\n", "[coupling]\nscheme = \"force\"\n[[populations]]\n"),
                {"populations.0.type", "no [[cell_types]]"});
}

TEST_CASE("a long value is shortened in a message") {
  std::string list = "[0";
  for (int i = 0; i < 60; ++i) list += ", 0";
  const auto found = message(replaced(flow, "nodes = [5, 5, 5]", "nodes = " + list + "]"));
  require_parts(found, {":6: grid.nodes = [0, 0, ", "...: must be three whole numbers"});
  const auto value = found.substr(found.find("= ") + 2);
  REQUIRE(value.find("...") + 3 == 120);
}

TEST_CASE("modules that contradict each other are refused") {
  require_parts(message(flow + "[[cells]]\ncenter_um = [0, 0, 0]\n[stretching]\n"), {":9: fluid: a stretching test has no fluid"});
  require_parts(message("[stretching]\n"), {":1: stretching: a stretching test pulls one cell; the case has 0"});
  require_parts(message("[[cells]]\n[stretching]\n[time]\nstep_us = 1\nend_us = 1\n"), {":3: time: ", "has no [time]"});
  require_parts(message("[[cells]]\n[stretching]\nforce_N = 1\n"), {":3: stretching.force_N", "'force_pN'"});
  require_parts(message("[[cells]]\n[stretching]\npatch_fraction = 0.6\n"), {":3: stretching.patch_fraction = 0.6"});
  require_parts(message("[[cells]]\n[stretching]\n[output]\nfields = true\n"), {":4: output.fields = true", "no [fluid]"});
  require_parts(message("[[cells]]\n"), {":1: cells: nothing to compute"});
  require_parts(message("[[bodies]]\nshape = \"sphere\"\nradius_um = 1\ncenter_um = [0, 0, 0]\n"),
                {":1: bodies: rigid bodies need a [fluid]"});
  require_parts(message("[grid]\ngenerator = \"box\"\nnodes = [5, 5, 5]\nlower_um = [0, 0, 0]\nupper_um = [1, 1, 1]\n"),
                {":1: grid: a grid without a [fluid]"});
  require_parts(message("[time]\nstep_us = 1\nend_us = 1\n[fluid]\n"), {":4: fluid: a fluid needs a [grid]"});
}

TEST_CASE("overrides that are wrong say so") {
  const auto set = [](const std::string& text) { return message(flow, {text}); };
  require_parts(set("time.step_us=-3"), {"--set time.step_us=-3: time.step_us = -3", "above 0"});
  require_parts(set("time.step_us"), {"--set time.step_us: write section.key=value"});
  require_parts(set("=3"), {"--set =3: write section.key=value"});
  require_parts(set("time..step_us=3"), {"write section.key=value"});
  require_parts(set("time.step_us="), {"--set time.step_us=: no value"});
  require_parts(set("step_us=3"), {"there is no section 'step_us'"});
  require_parts(set("tme.step_us=3"), {"there is no section 'tme'", "did you mean 'time'?"});
  require_parts(set("time.stp_us=3"), {"--set time.stp_us=3: time.stp_us = 3", "did you mean 'step_us'?"});
  require_parts(set("boundary.side=k_min"), {"write boundary.0.key=value"});
  require_parts(set("boundary.x.side=k_min"), {"'x' is not the number of an entry"});
  require_parts(set("boundary.6.side=k_min"), {"the case has 6 [[boundary]], counted from 0"});
  require_parts(set("cells.0.vertices=500"), {"the case has 0 [[cells]]"});
  require_parts(set("grid.nodes=[5,5"), {"--set grid.nodes=[5,5: the value is not valid TOML"});
  require_parts(set("grid.nodes.0=5"), {"write grid.key=value"});
  require_parts(set("grid.generator=bxo"), {"--set grid.generator=bxo: grid.generator", "did you mean \"box\"?"});
  require_parts(set("output.every_us=ten"), {"--set output.every_us=ten", "a number, 0 or more"});
}

TEST_CASE("files that are not case files are refused") {
  require_parts(message("[time\nstep_us = 1"), {"wrong.toml:1: not valid TOML"});
  require_parts(message("[time]\nstep_us = 1\nstep_us = 2"), {"wrong.toml:3: not valid TOML"});
  const auto refused = [](const std::string& path) -> std::string {
    try {
      read_case(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  require_parts(refused("/no/such/case.toml"), {"/no/such/case.toml: cannot read"});
  require_parts(refused(cases.string()), {cases.string() + ": is a folder"});
}

TEST_CASE("suggestions: the unit first, then the spelling, and none for what is alike to nothing") {
  const std::vector<std::string> known{"velocity_mm_per_s", "vertices", "mass_pg"};
  REQUIRE(nearest("velocity_um_per_us", known) == "velocity_mm_per_s");
  REQUIRE(nearest("velocity", known) == "velocity_mm_per_s");
  REQUIRE(nearest("vertexes", known) == "vertices");
  REQUIRE(nearest("quantum", known) == "");
  REQUIRE(without_unit("density_pg_per_um3") == "density");
  REQUIRE(without_unit("bending_modulus_J") == "bending_modulus");
  REQUIRE(edit_distance("abcd", "abdc") == 1);
  REQUIRE(edit_distance("", "abc") == 3);
}
