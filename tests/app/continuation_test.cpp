// What a restart goes on from: the same files, the same run, a checkpoint that is named so that it can be found.
#include "program.hpp"

using namespace app;
using Catch::Contains;

#ifdef CORPUSCLE_HDF5

namespace {

/// A small channel between walls of which one moves: a hundredth of a second a step.
Words channel(const std::string& case_path, const std::string& out, const std::string& end, const Words& more = {}) {
  Words settings{"time.end_us=" + end, "output.every_us=1"};
  settings.insert(settings.end(), more.begin(), more.end());
  return with({"run", case_path, "--out", out}, settings);
}

Words small(const std::string& out, const std::string& end, const Words& more = {}) {
  Words settings{"grid.nodes=[5,5,5]"};
  settings.insert(settings.end(), more.begin(), more.end());
  return channel(scene("couette"), out, end, settings);
}

Words restarted(Words words, const std::string& checkpoint) {
  words.insert(words.end(), {"--restart", checkpoint});
  return words;
}

/// Nodes of the channel's box, of which one is moved by `shift`.
void write_nodes(const fs::path& path, double shift) {
  const hsize_t shape[4] = {5, 6, 5, 3};
  std::vector<double> nodes;
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 5; ++i) nodes.insert(nodes.end(), {1.0 * i, 2.0 * j, 1.0 * k});
  nodes[3 * (2 + 5 * (2 + 6 * 2)) + 1] += shift;
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(4, shape, nullptr);
  const hid_t set = H5Dcreate2(file, "nodes", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  REQUIRE(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, nodes.data()) >= 0);
  H5Dclose(set);
  H5Sclose(space);
  H5Fclose(file);
}

/// The channel with its grid from nodes.h5 beside the case.
std::string case_with_grid_file(const fs::path& folder) {
  auto text = contents(scene("couette"));
  const auto first = text.find("\n[grid]") + 1, last = text.find("[fluid]", first);
  text.replace(first, last - first, "[grid]\ngenerator = \"file\"\nfile = \"nodes.h5\"\n\n");
  std::ofstream(folder / "grid.toml") << text;
  return "grid.toml";
}

}  // namespace

TEST_CASE("a restart finds out that a surface or grid file holds something else, whatever its name") {
  const auto folder = fresh_folder("other_content");
  SECTION("a rigid body's surface") {
    succeed(folder, {"mesh", "--vertices", "200", "-o", "body.off"});
    std::ofstream(folder / "body.toml") << contents(scene("couette")) << "\n[[bodies]]\nshape = \"file\"\nfile = \"body.off\"\n"
                                        << "scale = 0.3\ncenter_um = [2, 5, 2]\n";
    succeed(folder, channel("body.toml", "out", "1"));
    fs::copy_file(folder / "body.off", folder / "same.off");
    std::istringstream lines(contents(folder / "same.off"));
    std::ofstream edited(folder / "body.off");
    std::string line;
    for (int n = 0; std::getline(lines, line); ++n)
      edited << (n == 2 ? std::to_string(std::stod(line)) + line.substr(line.find(' ')) : line) << "\n";
    edited.close();
    fail(folder, restarted(channel("body.toml", "out", "2"), "out"), 2,
         {"bodies.0.file = ", "body.off\" with other content", "another scene"});
    const auto moved = succeed(folder, restarted(channel("body.toml", "out", "2", {"bodies.0.file=same.off"}), "out"));
    CHECK_THAT(moved.output, !Contains("until the checkpoint"));
  }
  SECTION("a grid") {
    const auto name = case_with_grid_file(folder);
    write_nodes(folder / "nodes.h5", 0);
    succeed(folder, channel(name, "out", "1"));
    write_nodes(folder / "nodes.h5", 1e-9);
    write_nodes(folder / "same.h5", 0);
    fail(folder, restarted(channel(name, "out", "2"), "out"), 2, {"grid.file = ", "nodes.h5\" with other content"});
    succeed(folder, restarted(channel(name, "out", "2", {"grid.file=same.h5"}), "out"));
  }
}

TEST_CASE("a restart into a folder that holds another run is refused, and nothing there changes") {
  const auto folder = fresh_folder("two_runs");
  succeed(folder, small("one", "2"));
  succeed(folder, small("two", "6", {"fluid.kinematic_viscosity_um2_per_us=2"}));
  const auto listing = [&] {
    std::string all;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "two"))
      if (entry.is_regular_file() && entry.path().filename() != ".corpuscle.lock") all += entry.path().string() + contents(entry.path());
    return std::hash<std::string>()(all);
  };
  const auto before = listing();
  const auto onto = restarted(small("two", "4"), "one/checkpoint.h5");
  fail(folder, onto, 2, {"--out two", "another run", "one/checkpoint.h5", "--overwrite"});
  CHECK(listing() == before);
  // A checkpoint that somebody has put there is not of the results beside it either.
  fs::copy_file(folder / "one/checkpoint.h5", folder / "two/other.h5");
  fail(folder, restarted(small("two", "4"), "two/other.h5"), 2, {"another run"});
  auto own = restarted(small("one", "3"), "one");
  own.push_back("--overwrite");
  fail(folder, own, 2, {"--overwrite would remove one/checkpoint.h5"});

  // What is allowed: a new folder, the same checkpoint into it again, its own later ones, a copy, and --overwrite.
  for (int time = 0; time < 2; ++time) succeed(folder, restarted(small("branch", "4"), "one/checkpoint.h5"));
  succeed(folder, restarted(small("branch", "5"), "branch/checkpoint.h5"));
  fail(folder, restarted(small("one", "6"), "branch/checkpoint.h5"), 2, {"another run"});
  fs::create_directory(folder / "copied");
  for (const char* name : {"checkpoint.h5", "report.json"}) fs::copy_file(folder / "one" / name, folder / "copied" / name);
  succeed(folder, restarted(small("copied", "3"), "copied"));
  auto over = onto;
  over.push_back("--overwrite");
  succeed(folder, over);
  CHECK_FALSE(fs::exists(folder / "two/fields/step_000000001.h5"));
  CHECK(report(folder / "two")["simulated_us"] == 4);
}

TEST_CASE("a restart names what it cannot go on from, and says what is missing") {
  const auto folder = fresh_folder("restart_words");
  succeed(folder, small("out", "1"));
  fs::create_directory(folder / "empty");
  fail(folder, restarted(small("new", "2"), "empty"), 2, {"--restart empty", "holds no checkpoint.h5"});
  fail(folder, restarted(small("new", "2"), ""), 2, {"--restart", "empty"});
  fail(folder, small("", "2"), 2, {"--out", "empty"});
  CHECK_FALSE(fs::exists(folder / "new"));
  CHECK_FALSE(fs::exists(folder / "runs"));
  const auto whole = succeed(folder, restarted(small("out", "2"), "out"));
  CHECK_THAT(whole.output, !Contains("warning"));
  fs::remove(folder / "out/fields.h5");
  const auto without = succeed(folder, restarted(small("out", "3"), "out"));
  CHECK_THAT(without.output, Contains("warning: fields.h5 in out begins at 2 us"));
}

TEST_CASE("a restart of a cell that was put elsewhere, or stopped at the outflow, says so at once") {
  const auto folder = fresh_folder("restart_cell");
  const Words fast{"boundary.0.velocity_mm_per_s=40", "boundary.0.ramp_us=4", "time.end_us=100", "time.first_step_us=0"};
  const auto words = [&](const std::string& out, const Words& more) {
    auto all = fast;
    all.push_back("cells.0.center_um=[0,0,17.9]");
    all.insert(all.end(), more.begin(), more.end());
    return coarse_tube(out, all);
  };
  fail(folder, words("out", {}), 5, {"with a lower time.stop_before_outflow_um it can go on"});
  const long steps = report(folder / "out")["steps"];
  const auto history = contents(folder / "out/history.csv");
  fail(folder, restarted(words("out", {}), "out"), 2, {"reached the outflow", "to go on, lower time.stop_before_outflow_um, which is 3"});
  for (const char* setting : {"cells.0.center_um=[0,0,17.8]", "cells.0.axis=[0,1,1]", "cells.0.spin_deg=10"}) {
    const std::string key = std::string(setting).substr(0, std::string(setting).find('='));
    fail(folder, restarted(words("out", {setting}), "out"), 2, {"another scene", key + " = ", "in the checkpoint"});
  }
  CHECK(contents(folder / "out/history.csv") == history);
  fs::remove(folder / "out/history.csv");
  const auto on = start(folder, restarted(words("out", {"time.stop_before_outflow_um=2.8"}), "out"));
  INFO(on.output);
  CHECK(on.code == 5);
  CHECK_THAT(on.output, Contains("warning: history.csv in out begins at"));
  CHECK(report(folder / "out")["steps"].get<long>() > steps + 1);
}

#else
TEST_CASE("what restarts go on from") { WARN("skipped: this build has no HDF5"); }
#endif
