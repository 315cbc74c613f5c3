// Wrong input: exit code 2, and a message that names what is wrong and what to do, whichever part of the program finds
// it.
#include "program.hpp"

using namespace app;
using Catch::Contains;

namespace {

/// The coarse tube with one thing wrong.
void refuse(const std::string& setting, const Words& parts) {
  const auto folder = fresh_folder("refused");
  const auto outcome = fail(folder, coarse_tube("out", {"time.end_us=4", setting}), 2, parts);
  INFO(outcome.output);
  REQUIRE_FALSE(fs::exists(folder / "out/report.json"));
}

// The mesh of a cell, whole or damaged: `spoil` gets the lines of the triangles.
template <class Spoil>
std::string mesh_file(const fs::path& folder, const std::string& name, const Spoil& spoil) {
  succeed(folder, {"mesh", "--vertices", "500", "-o", "whole.off"});
  std::istringstream in(contents(folder / "whole.off"));
  std::string line, vertices;
  std::getline(in, line);
  std::getline(in, line);
  for (int v = 0; v < 500 && std::getline(in, line); ++v) vertices += line + "\n";
  Words triangles;
  while (std::getline(in, line))
    if (!line.empty()) triangles.push_back(line);
  REQUIRE(triangles.size() == 996);
  spoil(triangles);
  std::ofstream out(folder / name);
  out << "OFF\n500 " << triangles.size() << " 0\n" << vertices;
  for (const auto& triangle : triangles) out << triangle << "\n";
  return (folder / name).string();
}

void open(Words& triangles) { triangles.pop_back(); }

void turn_inside_out(Words& triangles) {
  for (auto& triangle : triangles) {
    std::istringstream in(triangle);
    std::string count, a, b, c;
    in >> count >> a >> b >> c;
    triangle = count + " " + a + " " + c + " " + b;
  }
}

// The straight tube without the line that asks for the built-in mesh.
std::string case_for_mesh(const fs::path& folder) {
  auto text = contents(scene("straight_tube"));
  const auto at = text.find("vertices = 500\n");
  REQUIRE(at != std::string::npos);
  std::ofstream(folder / "mesh.toml") << text.erase(at, std::string("vertices = 500\n").size());
  return (folder / "mesh.toml").string();
}

// The tube flow with a body from a file.
std::string case_for_body(const fs::path& folder, const std::string& file) {
  std::ofstream(folder / "body.toml") << contents(scene("tube_flow")) << "\n[[bodies]]\nshape = \"file\"\nfile = \"" << file
                                      << "\"\ncenter_um = [0, 0, 0]\n";
  return (folder / "body.toml").string();
}

}  // namespace

TEST_CASE("wrong keys and values") {
  refuse("time.stp_us=1", {"--set time.stp_us=1", "unknown key", "did you mean 'step_us'?"});
  refuse("time.step=1", {"unknown key", "did you mean 'step_us'?", "unit"});
  refuse("time.step_us=\"fast\"", {"time.step_us = \"fast\"", "a number above 0"});
  refuse("fluid.density_pg_per_um3=-1", {"fluid.density_pg_per_um3 = -1", "a number above 0"});
  refuse("cells.0.vertices=50", {"cells.0.vertices = 50", "200 to 30000"});
  refuse("coupling.scheme=robbin", {"coupling.scheme", "did you mean \"robin\"?"});
  refuse("time.end_us=4.5", {"time.end_us = 4.5", "time.step_us", "use 5"});
}

TEST_CASE("an error is announced once") {
  const auto outcome = start(fresh_folder("once"), {"run", "nowhere.toml"});
  INFO(outcome.output);
  REQUIRE(outcome.output.find("error") == outcome.output.rfind("error"));
}

TEST_CASE("case files that cannot be read") {
  const auto folder = fresh_folder("case_files");
  for (const char* command : {"run", "check"}) {
    fail(folder, {command, "nowhere.toml"}, 2, {"nowhere.toml", "cannot read"});
    fail(folder, {command, "."}, 2, {"."});
  }
  std::ofstream(folder / "broken.toml") << "[time]\nstep_us = [\n";
  fail(folder, {"run", "broken.toml"}, 2, {"broken.toml:", "not valid TOML"});
}

TEST_CASE("cells where they cannot be") {
  SECTION("beyond the end of the grid") { refuse("cells.0.center_um=[0,0,200]", {"cells.0", "outside the grid", "center_um"}); }
  SECTION("through the end of the grid") { refuse("cells.0.center_um=[0,0,22]", {"cells.0", "outside the grid", "center_um"}); }
  SECTION("beside the tube") { refuse("cells.0.center_um=[40,0,0]", {"cells.0", "outside the grid", "center_um"}); }
  SECTION("through the wall") { refuse("cells.0.center_um=[3,0,0]", {"cells.0", "outside the grid", "center_um"}); }
  // The resting cell's radius is 3.9 um in a tube of 5 um: this leaves 0.5 um, less than one spacing of the coarse
  // grid.
  SECTION("too near to the wall") {
    refuse("cells.0.center_um=[0.6,0,0]", {"gap to the wall", "cells.0", "grid spacings", "center_um", "grid.nodes"});
  }
}

TEST_CASE("cells that overlap, or stand closer than the grid can resolve") {
  const auto folder = fresh_folder("two_cells");
  const auto two_cells = [&](const std::string& z) {
    const std::string text = contents(scene("straight_tube")), file = "two_" + z + ".toml";
    std::ofstream(folder / file) << text << "\n[[cells]]\ncenter_um = [0, 0, " << z << "]\nvertices = 500\n";
    return with({"run", (folder / file).string(), "--out", "out"},
                {"grid.nodes=[17,17,25]", "time.step_us=1", "time.end_us=2", "output.every_us=2"});
  };
#ifdef CORPUSCLE_MPI
  const std::vector<int> launches{1, 2};
#else
  const std::vector<int> launches{1};
#endif
  for (const int ranks : launches) {
    // Disks 2.55 um thick, grid spacing 1.9 um.
    fail(folder, two_cells("0.1"), 2, {"cells.0 and cells.1", "overlap", "center_um"}, {1, ranks});
    fail(folder, two_cells("2.0"), 2, {"surfaces cross", "cells.0 and cells.1 overlap", "center_um"}, {1, ranks});
    fail(folder, two_cells("3.5"), 2, {"gap between bodies", "cells.0 and cells.1", "grid spacings apart", "grid.nodes"}, {1, ranks});
    fail(folder, two_cells("5.5"), 2, {"cut off", "fluid nodes", "between two bodies", "grid.nodes"}, {1, ranks});
  }
  succeed(folder, two_cells("10"));
}

TEST_CASE("surfaces that are open are refused, those inside out turned with a word") {
  const auto folder = fresh_folder("surfaces");
  const auto whole = mesh_file(folder, "same.off", [](Words&) {});
  const auto open_mesh = mesh_file(folder, "open.off", open);
  const auto turned = mesh_file(folder, "turned.off", turn_inside_out);
  const Words settings{"grid.nodes=[17,17,25]", "time.step_us=1", "time.end_us=1"};
  const auto cell = [&](const std::string& file) {
    auto all = settings;
    all.push_back("cells.0.mesh=\"" + file + "\"");
    return with({"run", case_for_mesh(folder), "--out", "out"}, all);
  };
  const auto body = [&](const std::string& file) { return with({"run", case_for_body(folder, file), "--out", "out"}, settings); };
  succeed(folder, cell(whole));
  succeed(folder, body(whole));
  for (const auto& words : {cell(open_mesh), body(open_mesh)})
    fail(folder, words, 2, {"open.off", "open", "edge between vertices", "close the hole"});
  for (const auto& words : {cell(turned), body(turned)})
    CHECK_THAT(succeed(folder, words).output, Contains("its triangles faced inward: all are turned"));
  fail(folder, cell((folder / "missing.off").string()), 2, {"cells.0.mesh", "missing.off", "no file"});
}

TEST_CASE("check and run say what a surface file holds") {
  const auto folder = fresh_folder("said");
  // A disc of 5 x 1.5 um that lies on its side, in mm: two squares' corners and two poles.
  std::ofstream(folder / "lying.off") << "# of a drawing\nCOFF 6 8 12\n2.5e-3 0 0 9 9 9\n0 0 2.5e-3 9 9 9\n-2.5e-3 0 0 9 9 9\n"
                                         "0 0 -2.5e-3 9 9 9\n0 0.75e-3 0 9 9 9\n0 -0.75e-3 0 9 9 9\n3 1 0 4\n3 2 1 4\n3 3 2 4\n"
                                         "3 0 3 4\n3 0 1 5\n3 1 2 5\n3 2 3 5\n3 3 0 5\n";
  std::ofstream(folder / "lying.toml") << "[[cells]]\nmesh = \"lying.off\"\n[stretching]\nforce_pN = 1\nsteps = 1\n";
  fail(folder, {"check", "lying.toml"}, 2, {"lying.off", "0.005 um", "cells.scale = 1000 (a file in mm)"});
  const auto said = succeed(folder, with({"check", "lying.toml"}, {"cells.0.scale=1000"})).output;
  for (const char* part : {"cells.0: ", "6 vertices, 8 triangles", "extents 5 x 1.5 x 5 um", "area ", "volume 6.25 um3",
                           "with the axis (0, 1, 0)", "warning: cells.0: it is a disc whose axis (0, 1, 0) is 90 degrees"})
    CHECK_THAT(said, Contains(part));
}

TEST_CASE("check lists cell types with their laws and numbers, and what a sheet on a spheroid has come to") {
  const auto folder = fresh_folder("types");
  std::ofstream(folder / "types.toml")
      << contents(scene("straight_tube"))
      << "\n[[cell_types]]\nname = \"rbc\"\nvertices = 300\nreference = \"spheroid\"\n"
         "[[cell_types]]\nname = \"capsule\"\nshape = \"sphere\"\nradius_um = 2\nlaw = \"skalak\"\n"
         "skalak_c = 10\nbending_modulus_J = 0\n"
         "[[cells]]\ntype = \"rbc\"\ncenter_um = [0, 0, 10]\n[[cells]]\ntype = \"rbc\"\ncenter_um = [0, 0, -10]\n";
  const auto said = succeed(folder, with({"check", "types.toml"}, {"grid.nodes=[17,17,25]"})).output;
  for (const char* part : {"cell type \"rbc\": 300 vertices, biconcave, 7.82 um wide; wlc-pow, shear modulus 6.32 uN/m; 2 cells",
                           "cell type \"capsule\": 500 vertices, a sphere of radius 2 um; skalak, C = 10, shear modulus 6.32 uN/m; 0 cells",
                           "cells with keys of their own: 1", "cell_types.0.reference on a spheroid of reduced volume 0.95: at rest after"})
    CHECK_THAT(said, Contains(part));
}

TEST_CASE("scenes that cannot be are refused before anything runs") {
  const auto folder = fresh_folder("scenes");
  const auto tube = [&](const Words& settings) {
    Words all{"grid.nodes=[17,17,25]", "time.end_us=4"};
    all.insert(all.end(), settings.begin(), settings.end());
    return with({"check", scene("tube_flow")}, all);
  };
  auto two_inlets = contents(scene("tube_flow"));
  const auto at = two_inlets.find("type = \"outflow\"");
  REQUIRE(at != std::string::npos);
  two_inlets.replace(at, 16, "type = \"velocity_inlet\"\nvelocity_mm_per_s = 2\nprofile = \"parabolic\"\nramp_us = 20");
  std::ofstream(folder / "two_inlets.toml") << two_inlets;
  succeed(folder, tube({}));
  fail(folder, {"check", "two_inlets.toml"}, 2, {"do not conserve volume", "boundary.", "um3/us"});
  // 4 um along the axis of a cell that is 0.8 to 2.5 um thick.
  fail(folder, with({"check", scene("straight_tube")}, {"grid.nodes=[21,21,126]", "grid.length_um=500", "time.end_us=40"}), 2,
       {"cells.0: the grid is too coarse", "spacing over thickness", "grid.nodes"});
}

TEST_CASE("results that cannot be written") {
  const auto folder = fresh_folder("unwritable");
  std::ofstream(folder / "file") << "in the way\n";
  fail(folder, coarse_tube("file"), 2, {"--out file", "cannot create this folder"});
  fail(folder, coarse_tube("file/out"), 2, {"--out file/out", "cannot create this folder"});
}

TEST_CASE("a coupling that cannot be stable is refused with the reason") {
  refuse("coupling.scheme=loose", {"coupling", "M / (A dt)", "would diverge", "robin", "cells.0.mass_pg", "iterated"});
}

TEST_CASE("more ranks than the case can use") {
#ifdef CORPUSCLE_MPI
  const auto folder = fresh_folder("ranks");
  // Four cells a side are too few for two blocks of three.
  fail(folder, with({"run", scene("couette")}, {"grid.nodes=[5,5,5]", "time.end_us=2"}), 2,
       {"4 x 4 x 4 cells cannot be cut into 4 blocks", "fewer ranks", "grid.nodes"}, {1, 4});
  fail(folder, {"run", scene("stretch")}, 2, {"stretching", "one rank, not 2", "without mpirun"}, {1, 2});
#else
  WARN("skipped: this build has no MPI");
#endif
}

#ifdef CORPUSCLE_HDF5

TEST_CASE("checkpoints that do not fit") {
  static const auto folder = fresh_folder("checkpoints");
  static const bool ready = (succeed(folder, coarse_tube("good", {"time.end_us=2"})), true);
  REQUIRE(ready);
  const auto refuse_restart = [](Words words, const std::string& file, const Words& parts) {
    words.insert(words.end(), {"--restart", file});
    fail(folder, words, 2, parts);
  };
  const auto again = coarse_tube("out", {"time.end_us=4"});
  SECTION("no checkpoint at all") {
    std::ofstream(folder / "text.h5") << "not HDF5, and long enough to hold a signature\n";
    refuse_restart(again, "missing.h5", {"--restart missing.h5", "no such file"});
    refuse_restart(again, "text.h5", {"text.h5", "not an HDF5 file"});
    refuse_restart(again, "good/fields.h5", {"good/fields.h5", "not a checkpoint"});
  }
  SECTION("cut short") {
    fs::copy_file(folder / "good/checkpoint.h5", folder / "short.h5", fs::copy_options::overwrite_existing);
    fs::resize_file(folder / "short.h5", fs::file_size(folder / "short.h5") / 2);
    refuse_restart(again, "short.h5", {"short.h5", "cut short"});
  }
  SECTION("of another grid") {
    refuse_restart(coarse_tube("out", {"time.end_us=4", "grid.nodes=[17,17,27]"}), "good/checkpoint.h5",
                   {"[17, 17, 25]", "grid.nodes = [17, 17, 27]"});
  }
  SECTION("of another cell") {
    refuse_restart(coarse_tube("out", {"time.end_us=4", "cells.0.vertices=400"}), "good/checkpoint.h5",
                   {"good/checkpoint.h5", "cells.0.vertices = 400", "another scene"});
  }
  SECTION("with a cell, for a case without") {
    refuse_restart(with({"run", scene("tube_flow"), "--out", "out"}, {"grid.nodes=[17,17,25]"}), "good/checkpoint.h5",
                   {"good/checkpoint.h5", "another scene"});
  }
  SECTION("without a cell, for a case with one") {
    succeed(folder, with({"run", scene("tube_flow"), "--out", "plain"}, {"grid.nodes=[17,17,25]", "time.end_us=2"}));
    refuse_restart(again, "plain/checkpoint.h5", {"plain/checkpoint.h5", "number of [[cells]] = 1", "another scene"});
  }
  SECTION("of steps that this case's would be too long after") {
    refuse_restart(coarse_tube("out", {"time.end_us=4", "time.step_us=4", "time.first_step_us=0"}), "good/checkpoint.h5",
                   {"good/checkpoint.h5", "time.step_us"});
  }
  SECTION("at a time that is none of this case") {
    refuse_restart(coarse_tube("out", {"time.end_us=4.2", "time.step_us=0.6"}), "good/checkpoint.h5",
                   {"good/checkpoint.h5", "2 us", "time.step_us"});
  }
  SECTION("at the end already") { refuse_restart(coarse_tube("out", {"time.end_us=2"}), "good/checkpoint.h5", {"2 us", "time.end_us"}); }
  SECTION("for a stretching test") { refuse_restart({"run", scene("stretch")}, "good/checkpoint.h5", {"--restart", "stretching"}); }
}

#else
TEST_CASE("checkpoints that do not fit") { WARN("skipped: this build has no HDF5"); }
#endif
