// Scenes of membranes as forces that start where they should not: refused or warned of, with what helps.
#include <cmath>
#include <fstream>

#include "program.hpp"

using namespace app;
using Catch::Contains;

namespace {

Words both(Words all, const Words& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::string checked(const fs::path& folder, const std::string& name, const Words& overrides) {
  return succeed(folder, with({"check", scene(name)}, overrides)).output;
}

}  // namespace

TEST_CASE("a load that acts at once on viscous membranes is followed by the first steps") {
  const auto folder = fresh_folder("viscous_start");
  const auto way = [&](const Words& overrides) {
    const Words all{"grid.nodes=[13,13,13]",
                    "cell_types.0.vertices=300",
                    "cell_types.0.membrane_viscosity_N_s_per_m=5e-7",
                    "time.end_us=60",
                    "output.fields=false",
                    "output.cells=false",
                    "output.history_every_us=60"};
    succeed(folder, with({"run", scene("two_cells"), "--out", "out"}, both(all, overrides)));
    return report(folder / "out")["quantities"]["cell_0_centroid_z_um"].get<double>() + 1.6;
  };
  const double fine = way({"time.step_us=0.625", "time.first_step_us=0"});
  // What a late start adds to the way grows with the first steps, which are a sixteenth: with doubling a quarter at most.
  const double late = way({"time.first_step_us=0"}) / fine - 1, now = way({}) / fine - 1;
  INFO(late << " " << now);
  CHECK(late > 0.3);
  CHECK(std::abs(now) < 0.25 * late);
}

TEST_CASE("viscous membranes only resist, in steps shorter than the fluid takes to follow them too") {
  const auto folder = fresh_folder("short_viscous_steps");
  succeed(folder, {"run",   scene("two_cells"),
                   "--out", "out",
                   "--set", "grid.nodes=[13,13,13]",
                   "--set", "cell_types.0.vertices=300",
                   "--set", "cell_types.0.membrane_viscosity_N_s_per_m=1e-6",
                   "--set", "time.step_us=0.25",
                   "--set", "time.first_step_us=0.25",
                   "--set", "time.end_us=50",
                   "--set", "output.fields=false",
                   "--set", "output.cells=false",
                   "--set", "output.history_every_us=50"});
  const auto found = report(folder / "out");
  const auto energy = found["energy_fJ"];
  const double pushed = energy["pushed"], flow = energy["dissipation"], membranes = energy["membrane_dissipation"];
  INFO("pushed " << pushed << ", dissipated by the flow " << flow << " and by membranes " << membranes << " fJ");
  // What swings dissipates more than is put in, and membranes seem to give it: 700 and 400 times as much in these steps once.
  CHECK(pushed > 1e-3);
  CHECK(flow > 0.3 * pushed);
  CHECK(membranes > 0.1 * pushed);
  CHECK(flow + membranes == Approx(pushed).epsilon(0.03));
  CHECK(found["warnings"].empty());
}

TEST_CASE("energies do not depend on how often the history is written") {
  const auto folder = fresh_folder("energy_sampled");
  const auto energy = [&](const std::string& every) {
    succeed(folder, with({"run", scene("capsule_shear"), "--out", "out" + every},
                         {"grid.nodes=[13,13,13]", "cells.0.vertices=200", "time.end_us=5000", "output.every_us=0",
                          "output.history_every_us=" + every}));
    return report(folder / ("out" + every))["energy_fJ"];
  };
  const auto often = energy("0"), seldom = energy("5000");
  // Between samples of which there are a fourth or fewer the rates are taken to change evenly.
  for (const char* term : {"boundaries", "dissipation", "on_cells"})
    CHECK(seldom[term].get<double>() == Approx(often[term].get<double>()).epsilon(0.01));  // half of it once
}

TEST_CASE("cells beside a wall without contact, and deep in each other's repulsion, are warned of") {
  const auto folder = fresh_folder("bad_starts");
  const Words tube{"grid.nodes=[17,17,27]", "cells.0.vertices=300"};
  const std::string beside = "um from a wall";
  CHECK_THAT(checked(folder, "tube_real", both(tube, {"cells.0.center_um=[1.05,0,0]"})), Contains(beside) && Contains("add [contact]"));
  CHECK_THAT(checked(folder, "tube_real", tube), !Contains(beside));
  const Words pack{"grid.nodes=[21,21,25]", "cell_types.0.vertices=300", "populations.0.hematocrit=0.2"};
  const std::string pressed = "start pressed against";
  CHECK_THAT(checked(folder, "blood_tube", both(pack, {"contact.range_um=2"})), Contains(pressed) && Contains("contact.range_um"));
  CHECK_THAT(checked(folder, "blood_tube", pack), !Contains(pressed));
}

TEST_CASE("a mesh with triangles much smaller than what reference gives them to rest on is warned of") {
  const auto folder = fresh_folder("squeezed_start");
  succeed(folder, {"mesh", "--vertices", "300", "-o", "even.off"});
  std::ifstream even(folder / "even.off");
  std::ofstream graded(folder / "graded.off");
  std::string line;
  std::getline(even, line);
  graded << line << '\n';
  int vertices = 0, triangles = 0, edges = 0;
  even >> vertices >> triangles >> edges;
  graded << vertices << ' ' << triangles << ' ' << edges << '\n';
  for (int v = 0; v < vertices; ++v) {
    double x = 0, y = 0, z = 0;
    even >> x >> y >> z;
    const double towards_axis = std::hypot(x, y) / 4;
    graded << x * towards_axis << ' ' << y * towards_axis << ' ' << z << '\n';
  }
  graded << even.rdbuf();
  graded.close();
  const auto start = [&](const std::string& reference) {
    std::string text = contents(scene("relax"));
    const std::string built_in = "vertices = 500";
    text.replace(text.find(built_in), built_in.size(), "mesh = \"graded.off\"\nreference = \"" + reference + "\"");
    std::ofstream(folder / "graded.toml") << text;
    return succeed(folder, {"check", "graded.toml", "--set", "time.step_us=10"}).output;
  };
  CHECK_THAT(start("uniform"), Contains("start squeezed") && Contains("reference = \"shape\""));
  CHECK_THAT(start("shape"), !Contains("start squeezed"));
}

TEST_CASE("scenes of membranes as forces that cannot be are refused with what helps") {
  const auto folder = fresh_folder("refused_starts");
  const auto refused = [&](const std::string& name, const Words& overrides, const Words& parts) {
    fail(folder, with({"check", scene(name)}, overrides), 2, parts);
  };
  refused("tube_real", {"grid.nodes=[17,17,27]", "cells.0.vertices=300", "cells.0.center_um=[3,0,0]"},
          {"is outside the grid at the start", "center_um"});
  refused("two_cells", {"grid.nodes=[5,5,5]", "time.step_us=10"}, {"the grid is too coarse", "grid.nodes"});
  refused("blood_tube", {"grid.diameter_um=1"}, {"one cell has", "the whole grid", "larger grid"});
  refused("single_file", {"grid.nodes=[15,15,65]", "grid.diameter_um=4"},
          {"not even one of its cells fits", "um across", "grid.diameter_um, now 4"});
  refused("cell_shear", {"cells.0.dissipation=full"}, {"cells.0.dissipation", "would not turn", "\"central\""});
  const Words drawn{"cells.0.start_stretch = [2, 1, 1]", "area is 15 % off", "draw the cell out less"};
  refused("relax", {"cells.0.start_stretch=[2,1,1]"}, drawn);
#ifdef CORPUSCLE_MPI
  fail(folder, with({"check", scene("relax")}, {"cells.0.start_stretch=[2,1,1]"}), 2, drawn, {1, 2});
#endif
  refused("straight_tube",
          {"grid.nodes=[17,17,25]", "cells.0.shape=sphere", "cells.0.radius_um=2", "cells.0.reference=shape",
           "cells.0.start_stretch=[0.8,0.8,2]"},
          {"cells.0.start_stretch = [0.8, 0.8, 2]", "draw the cell out less"});
}

TEST_CASE("a gradient that nothing holds against is warned of") {
  const auto folder = fresh_folder("free_fluid");
  const auto check = [&](const Words& sides) {
    const Words common{"grid.nodes=[17,17,17]", "time.step_us=5", "fluid.pressure_gradient_Pa_per_um=[-0.1,0,0]", "cells.0.push_nN=[0,0,0]",
                       "cells.1.push_nN=[0,0,0]"};
    return succeed(folder, with(with({"check", scene("two_cells")}, common), sides)).output;
  };
  CHECK_THAT(check({}), Contains("nothing holds the fluid") && Contains("100 mm/s in every ms"));
  CHECK_THAT(check({"boundary.2.type=wall", "boundary.3.type=wall"}), !Contains("nothing holds the fluid"));
}

TEST_CASE("what is warned of before and during a run is in its report") {
  const auto folder = fresh_folder("told");
  const Words words = with({"run", scene("two_cells"), "--out", "out"}, {"grid.nodes=[13,13,13]", "cell_types.0.vertices=200",
                                                                         "time.step_us=2", "time.end_us=4", "output.fields=false"});
  const auto of_ratio = [&] {
    const auto whole = report(folder / "out");
    int found = 0;
    for (const auto& text : whole["told"]) found += text.get<std::string>().rfind("viscosity_ratio = 20: ", 0) == 0;
    return found;
  };
  succeed(folder, with(words, {"cell_types.0.viscosity_ratio=20"}));
  CHECK(of_ratio() == 1);
  succeed(folder, words);
  CHECK(of_ratio() == 0);
  // The coarser runs of error bars tell of themselves alone.
  auto bars = with(words, {"cell_types.0.viscosity_ratio=20", "time.end_us=8"});
  bars.push_back("--estimate-error=spacing");
  succeed(folder, bars);
  CHECK(of_ratio() == 1);
}

TEST_CASE("warnings name the keys of types where cells have types") {
  const auto folder = fresh_folder("named_types");
  succeed(folder,
          with({"run", scene("two_cells"), "--out", "out"}, {"grid.nodes=[13,13,13]", "cell_types.0.vertices=300", "time.step_us=2",
                                                             "time.end_us=4", "cells.0.start_stretch=[1.5,1,1]", "output.fields=false"}));
  const auto warnings = report(folder / "out")["warnings"];
  const auto found = std::find_if(warnings.begin(), warnings.end(), [](const auto& w) { return w["figure"] == "area_drift"; });
  REQUIRE(found != warnings.end());
  CHECK((*found)["key"] == "cell_types.0.area_modulus_uN_per_m");
  CHECK_THAT((*found)["message"].template get<std::string>(), Contains("cell_types.0.area_modulus") && !Contains("cells.0."));
}

TEST_CASE("warnings name the type of the cell whose area has drifted") {
  const auto folder = fresh_folder("drifted_types");
  std::stringstream text;
  text << std::ifstream(scene("two_cells")).rdbuf() << "\n[[cell_types]]\nname = \"other\"\nvertices = 300\nshear_modulus_uN_per_m = 5\n";
  const auto key = [&](const std::string& name, const Words& overrides) {
    std::ofstream(folder / (name + ".toml")) << text.str();
    succeed(folder, with({"run", name + ".toml", "--out", name}, both({"grid.nodes=[13,13,13]", "cell_types.0.vertices=300",
                                                                       "time.step_us=2", "time.end_us=4", "output.fields=false"},
                                                                      overrides)));
    const auto warnings = report(folder / name)["warnings"];
    for (const auto& w : warnings)
      if (w["figure"] == "area_drift") return w["key"].template get<std::string>();
    return std::string();
  };
  CHECK(key("second", {"cells.1.type=other", "cells.1.start_stretch=[1.5,1,1]"}) == "cell_types.1.area_modulus_uN_per_m");
  CHECK(key("first", {"cells.1.type=other", "cells.0.start_stretch=[1.5,1,1]"}) == "cell_types.0.area_modulus_uN_per_m");
}
