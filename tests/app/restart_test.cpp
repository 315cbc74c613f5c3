// Restarts on other ranks, what a restart may change, and what the report says after one.
#include <cmath>
#include <cstring>

#include "program.hpp"

using namespace app;
using Catch::Contains;

#ifdef CORPUSCLE_HDF5

namespace {

constexpr const char* of_the_whole_run[] = {"iterations", "immersed", "errors", "energy_fJ", "steps", "simulated_us"};

Words restarted(Words words, const std::string& checkpoint) {
  words.insert(words.end(), {"--restart", checkpoint});
  return words;
}

std::string sphere_in_tube(const fs::path& folder) {
  const auto path = folder / "sphere.toml";
  std::ofstream(path) << contents(scene("tube_flow")) << "\n[[bodies]]\nshape = \"sphere\"\nradius_um = 2\ncenter_um = [0.3, 0, -1]\n"
                      << "velocity_mm_per_s = [0, 0, 40]\nangular_velocity_rad_per_s = [3e4, 0, 0]\n";
  return path.string();
}

/// A run to 40 us of which the first 20 were written on n ranks and the rest on m, against one on n ranks throughout.
void require_same_on(const fs::path& folder, const Words& settings, const std::string& name, int n, const std::vector<int>& others) {
  const auto words = [&](const std::string& out, const std::string& end) {
    auto all = settings;
    all.insert(all.end(), {"time.step_us=4", "time.first_step_us=1", "output.history_every_us=4", "output.every_us=20",
                           "output.fields=false", "output.cells=false", end});
    return with({"run", name, "--out", out}, all);
  };
  const auto in = [&](const char* what) { return std::string(what) + std::to_string(n); };
  succeed(folder, words(in("whole"), "time.end_us=40"), {1, n});
  succeed(folder, words(in("start"), "time.end_us=20"), {1, n});
  const auto whole = history(folder / in("whole"));
  const auto first = report(folder / in("whole"));
  for (const int m : others) {
    const auto parts = in("parts") + std::to_string(m);
    fs::copy(folder / in("start"), folder / parts);
    succeed(folder, restarted(words(parts, "time.end_us=40"), parts + "/checkpoint.h5"), {1, m});
    const auto found = history(folder / parts);
    REQUIRE(found.lines.size() == whole.lines.size());
    double largest = 0;
    for (std::size_t l = 0; l < whole.lines.size(); ++l)
      for (const auto& column : whole.names) largest = std::max(largest, std::abs(found.number(l, column) - whole.number(l, column)));
    INFO("from " << n << " to " << m << " ranks: histories differ by " << largest);
    CHECK(largest < 1e-8);  // um, mm/s, nN: the solvers' tolerances; 2e-10 measured
    const auto r = report(folder / parts);
    CHECK(r["immersed"] == first["immersed"]);  // counts do not depend on ranks, and are carried over the restart
    CHECK(r["steps"] == first["steps"]);
    CHECK(r["iterations"]["momentum"]["max"].get<double>() >= 1);
    CHECK(r["wall_s"].get<double>() > r["wall_s_this_run"].get<double>());
    if (m != n) continue;
    CHECK(contents(folder / parts / "history.csv") == contents(folder / in("whole") / "history.csv"));
    for (const char* key : of_the_whole_run) {
      INFO(key);
      CHECK(r[key] == first[key]);
    }
  }
}

}  // namespace

TEST_CASE("a checkpoint goes on on any number of ranks, and on the same number with the same bits and report") {
  const auto folder = fresh_folder("restart_ranks");
  const Words coarse{"grid.nodes=[17,17,25]"};
#ifdef CORPUSCLE_MPI
  SECTION("cell in the tube, from one rank") { require_same_on(folder, coarse, scene("straight_tube"), 1, {1, 4}); }
  SECTION("cell in the tube, from two") { require_same_on(folder, coarse, scene("straight_tube"), 2, {1, 2}); }
  SECTION("cell in the tube, from four") { require_same_on(folder, coarse, scene("straight_tube"), 4, {2, 4}); }
  SECTION("cell whose centre passes the side of a periodic tube before the stop") {
    require_same_on(folder, {"grid.nodes=[17,17,13]", "cells.0.center_um=[0,0,9.98]"}, scene("periodic_tube"), 2, {1, 2});
  }
  SECTION("moving sphere") { require_same_on(folder, coarse, sphere_in_tube(folder), 2, {1, 2}); }
#else
  SECTION("cell in the tube") { require_same_on(folder, coarse, scene("straight_tube"), 1, {1}); }
  SECTION("moving sphere") { require_same_on(folder, coarse, sphere_in_tube(folder), 1, {1}); }
#endif
}

TEST_CASE("energies of a run that stopped between samples are those of one that did not") {
  const auto folder = fresh_folder("restart_energy");
  const auto run = [&](const std::string& out, const std::string& end, const Words& more) {
    succeed(folder,
            with({"run", scene("capsule_shear"), "--out", out}, {"grid.nodes=[13,13,13]", "cells.0.vertices=200", "output.every_us=0",
                                                                 "output.history_every_us=5000", "time.end_us=" + end}),
            {});
    if (!more.empty()) succeed(folder, restarted(with({"run", scene("capsule_shear"), "--out", out}, more), out));
  };
  run("whole", "3200", {});
  run("parts", "1300",
      {"grid.nodes=[13,13,13]", "cells.0.vertices=200", "output.every_us=0", "output.history_every_us=5000", "time.end_us=3200"});
  CHECK(report(folder / "parts")["energy_fJ"] == report(folder / "whole")["energy_fJ"]);
}

TEST_CASE("cells that have grown in packing take up membrane viscosity at a restart") {
  const auto folder = fresh_folder("restart_viscous");
  const auto run = [&](const std::string& out, const std::string& end, const Words& more) {
    const Words common{"grid.nodes=[15,15,65]", "cell_types.0.vertices=300", "output.every_us=0",
                       "time.step_us=5",        "time.first_step_us=5",      "time.end_us=" + end};
    return with(with({"run", scene("single_file"), "--out", out}, common), more);
  };
  succeed(folder, run("out", "20", {}));
  succeed(folder, restarted(run("viscous", "60", {"cell_types.0.membrane_viscosity_N_s_per_m=1e-7"}), "out/checkpoint.h5"));
  const auto r = report(folder / "viscous");
  CHECK(r["energy_fJ"]["membrane_dissipation"] > 0);
  CHECK(r["errors"]["area_drift"] < 0.01);
}

TEST_CASE("a restart refuses another geometry, and says which other keys have changed") {
  static const auto folder = fresh_folder("restart_changes");
  static const bool ready = (succeed(folder, coarse_tube("good", {"time.end_us=2"})), true);
  REQUIRE(ready);
  const auto change = [](const std::string& setting) {
    return restarted(coarse_tube("out", {"time.end_us=3", setting}), "good/checkpoint.h5");
  };
  const auto refuse = [&](const std::string& setting, const std::string& key, const std::string& now, const std::string& before) {
    fail(folder, change(setting), 2,
         {"good/checkpoint.h5", "another scene", key + " = " + now, "in the checkpoint: " + before, "from its start"});
  };
  refuse("grid.diameter_um=11", "grid.diameter_um", "11", "10");
  refuse("grid.nodes=[17,17,27]", "grid.nodes", "[17, 17, 27]", "[17, 17, 25]");
  refuse("cells.0.vertices=400", "cells.0.vertices", "400", "500");
  auto moving = change("boundary.2.type=moving_wall");
  moving.insert(moving.end(), {"--set", "boundary.2.velocity_mm_per_s=[0,0,1]"});
  fail(folder, moving, 2, {"another scene", "boundary.2.type = \"moving_wall\" (in the checkpoint: \"wall\")"});
  const auto warn = [&](const std::string& setting, const std::string& key, const std::string& now, const std::string& before) {
    const auto outcome = succeed(folder, [&] {
      auto words = change(setting);
      words[3] = "out_" + key;
      return words;
    }());
    CHECK_THAT(outcome.output, Contains("warning: " + key + " = " + now + ", and it was " + before));
  };
  warn("fluid.kinematic_viscosity_um2_per_us=1.2", "fluid.kinematic_viscosity_um2_per_us", "1.2", "1.1");
  warn("cells.0.shear_modulus_uN_per_m=7", "cells.0.shear_modulus_uN_per_m", "7", "6.32");
  warn("cells.0.law=skalak", "cells.0.law", "\"skalak\"", "\"wlc-pow\"");
  warn("boundary.0.velocity_mm_per_s=2.5", "boundary.0.velocity_mm_per_s", "2.5", "2");
  const auto silent = succeed(folder, restarted(coarse_tube("silent", {"time.end_us=3", "output.every_us=1"}), "good/checkpoint.h5"));
  CHECK_THAT(silent.output, !Contains("until the checkpoint"));
}

#else
TEST_CASE("restarts on other ranks") { WARN("skipped: this build has no HDF5"); }
#endif
