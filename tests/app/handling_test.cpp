// What users and batch systems do to runs: stop them, kill them, start two in one folder, start the wrong thing beside
// good results. Nothing that was computed may be lost.
#include <map>

#include "background.hpp"

using namespace app;
using Catch::Contains;

namespace {

/// A run that takes a while, with all its outputs every 4 us.
Words long_run(const std::string& out, const std::string& end = "time.end_us=4000") {
  return coarse_tube(out, {end, "time.step_us=4", "time.first_step_us=0", "output.history_every_us=4", "output.every_us=4",
                           "output.checkpoint_every_us=4", "output.fields=[\"pressure\"]"});
}

Words restarted(Words words, const std::string& checkpoint) {
  words.insert(words.end(), {"--restart", checkpoint});
  return words;
}

/// The folder's history is the beginning of the run without a stop, and goes on to its end.
void require_continued(const fs::path& folder, const std::string& whole, const std::string& parts) {
  const auto all = contents(folder / whole / "history.csv"), found = contents(folder / parts / "history.csv");
  CHECK(found == all);
}

#ifdef CORPUSCLE_HDF5
/// Every array of a series, read through the file that links its times together; how many times there are.
int read_all(const fs::path& path) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  INFO(path);
  REQUIRE(file >= 0);
  int times = 0;
  Words groups;
  H5Literate(
      file, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<Words*>(out)->emplace_back(name);
        return 0;
      },
      &groups);
  for (const auto& group : groups) {
    if (group.rfind("step_", 0) != 0) continue;
    INFO(group);
    const auto set = group + (path.filename() == "cells.h5" ? "/x_um" : "/pressure_kPa");
    REQUIRE(H5Aexists_by_name(file, group.c_str(), "time_us", H5P_DEFAULT) > 0);
    REQUIRE(data_set(path, set).size() > 0);
    ++times;
  }
  H5Fclose(file);
  return times;
}
#endif

}  // namespace

#ifdef CORPUSCLE_HDF5

TEST_CASE("a signal ends a run with its step, a checkpoint and a report, and a restart goes on with the same bits") {
  const auto folder = fresh_folder("signals");
  succeed(folder, long_run("whole", "time.end_us=60"));
  const std::map<int, std::string> names{{SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}, {SIGHUP, "SIGHUP"}};
  for (const auto& [signal, name] : names) {
    fs::remove_all(folder / "parts");
    // The same case, but for a length that leaves time to be stopped in.
    Background run(folder, long_run("parts"));
    REQUIRE(run.wait_until([&] { return lines(folder / "parts/history.csv") >= 4; }));
    run.send(signal);
    const auto outcome = run.wait();
    INFO(name << ": " << outcome.output);
    REQUIRE(outcome.code == 4);
    CHECK_THAT(outcome.output, Contains("stopped") && Contains(name) && Contains("--restart parts/checkpoint.h5"));
    const auto r = report(folder / "parts");
    CHECK(r["stopped"] == name);
    CHECK(r["quantities"].contains("cell_0_speed_mm_per_s"));
    if (r["simulated_us"].get<double>() >= 60) continue;  // a fast machine
    succeed(folder, restarted(long_run("parts", "time.end_us=60"), "parts/checkpoint.h5"));
    require_continued(folder, "whole", "parts");
    CHECK_FALSE(report(folder / "parts").contains("stopped"));
  }
}

#ifdef CORPUSCLE_MPI
TEST_CASE("a signal that one rank gets stops all ranks") {
  const auto folder = fresh_folder("signals_ranks");
  Launch launch{1, 2};
  launch.before = "if [ $OMPI_COMM_WORLD_RANK = 1 ]; then echo $$ > second; fi";
  for (const int signal : {SIGTERM, SIGUSR1}) {
    fs::remove_all(folder / "out");
    Background run(folder, long_run("out"), launch);
    REQUIRE(run.wait_until([&] { return lines(folder / "out/history.csv") >= 3; }));
    if (signal == SIGTERM)
      ::kill(std::stoi(contents(folder / "second")), signal);  // as batch systems do
    else
      run.send(signal);  // mpirun hands this one on, and kills its processes a second after others
    const auto outcome = run.wait();
    INFO(signal << ": " << outcome.output);
    CHECK(outcome.code == 4);
    const auto r = report(folder / "out");
    CHECK(r["stopped"] == (signal == SIGTERM ? "SIGTERM" : "SIGUSR1"));
    succeed(folder,
            restarted(long_run("out", "time.end_us=" + std::to_string(4 + int(r["simulated_us"].get<double>()))), "out/checkpoint.h5"));
  }
}
#endif

TEST_CASE("a run killed at twenty moments: all that it has written opens, and it goes on with the same bits") {
  const auto folder = fresh_folder("killed");
  constexpr int kills = 20;
  const std::string end = "time.end_us=" + std::to_string(4 * 3 * kills);
  succeed(folder, long_run("whole", end));
  const auto checkpoint = folder / "parts/checkpoint.h5";
  const auto stamp = [&] {
    std::error_code none;
    return fs::last_write_time(checkpoint, none);
  };
  int killed = 0;
  for (; killed < kills; ++killed) {
    const auto words = fs::exists(checkpoint) ? restarted(long_run("parts", end), "parts/checkpoint.h5") : long_run("parts", end);
    const auto before = stamp();
    Background run(folder, words);
    REQUIRE(run.wait_until([&] { return fs::exists(checkpoint) && stamp() != before; }));
    std::this_thread::sleep_for(std::chrono::microseconds(1700 * ((7 * killed) % kills)));  // anywhere in the next step
    run.kill();
    INFO("kill " << killed << ": " << contents(folder / "screen.txt"));
    CHECK(read_all(folder / "parts/fields.h5") >= 1);
    CHECK(read_all(folder / "parts/cells.h5") >= 1);
    for (const char* name : {"fields.xdmf", "cells.xdmf"}) CHECK_THAT(contents(folder / "parts" / name), Catch::EndsWith("</Xdmf>\n"));
    if (lines(folder / "parts/history.csv") > 3 * kills) break;
  }
  CHECK(killed > 5);
  if (!fs::exists(folder / "parts/report.json")) succeed(folder, restarted(long_run("parts", end), "parts/checkpoint.h5"));
  require_continued(folder, "whole", "parts");
  for (const char* name : {"fields.xdmf", "cells.xdmf"}) CHECK(contents(folder / "whole" / name) == contents(folder / "parts" / name));
  CHECK(read_all(folder / "parts/fields.h5") == 3 * kills + 1);
}

TEST_CASE("a second run in a folder in use is refused, and the first goes on") {
  const auto folder = fresh_folder("in_use");
  Background first(folder, long_run("out"));
  REQUIRE(first.wait_until([&] { return lines(folder / "out/history.csv") >= 3 && fs::exists(folder / "out/checkpoint.h5"); }));
  fs::create_directory(folder / "beside");
  for (const auto& words : {long_run("../out"), restarted(long_run("../out"), "../out/checkpoint.h5")})
    fail(folder / "beside", words, 2, {"--out ../out", "another run is writing there", "choose another folder"});
  first.send(SIGTERM);
  CHECK(first.wait().code == 4);
  succeed(folder, restarted(long_run("out", "time.end_us=" + std::to_string(4 + int(report(folder / "out")["simulated_us"].get<double>()))),
                            "out/checkpoint.h5"));
}

TEST_CASE("a run that is refused leaves the results beside it as they are") {
  const auto folder = fresh_folder("refused_beside");
  succeed(folder, long_run("out", "time.end_us=8"));
  std::map<std::string, std::string> before;
  for (const auto& entry : fs::directory_iterator(folder / "out"))
    if (entry.is_regular_file() && entry.path().filename().string()[0] != '.') before[entry.path().filename()] = contents(entry.path());
  const auto require_kept = [&](Words words, const Words& parts, bool overwrite) {
    Launch launch;
    launch.overwrite = overwrite;
    fail(folder, words, 2, parts, launch);
    for (const auto& [name, text] : before) {
      INFO(name);
      CHECK(contents(folder / "out" / name) == text);
    }
  };
  require_kept(long_run("out", "time.end_us=8"), {"--out out", "holds the results of an earlier run", "--overwrite", "--restart"}, false);
  require_kept(long_run("out", "cells.0.center_um=[0,0,200]"), {"outside the grid"}, true);
  require_kept(long_run("out", "coupling.scheme=loose"), {"would diverge"}, true);
  require_kept(restarted(long_run("out", "cells.0.vertices=400"), "out/checkpoint.h5"), {"cells.0.vertices = 400"}, false);
  require_kept(restarted(long_run("out", "time.end_us=8"), "out/checkpoint.h5"), {"already at 8 us"}, false);
  require_kept(restarted(long_run("out", "time.end_us=8"), "missing.h5"), {"missing.h5"}, false);
  succeed(folder, long_run("out", "time.end_us=4"));  // with --overwrite
  CHECK(lines(folder / "out/history.csv") == 3);
  CHECK(report(folder / "out")["steps"] == 1);
}

#else
TEST_CASE("signals, kills and folders") { WARN("skipped: this build has no HDF5, so it has no checkpoints"); }
#endif

TEST_CASE("every run without --out has a folder of its own, and runs/latest leads to the last") {
  const auto folder = fresh_folder("numbered");
  const auto words = with({"run", scene("couette")}, {"time.end_us=1"});
  for (const char* name : {"couette-001", "couette-002", "couette-003"}) {
    const auto outcome = succeed(folder, words);
    CHECK_THAT(outcome.output, Contains(std::string("results in runs/") + name));
    CHECK(fs::exists(folder / "runs" / name / "report.json"));
    CHECK(fs::read_symlink(folder / "runs/latest") == name);
  }
  fail(folder, with(words, {"grid.nodes=[3,3,3]"}), 2, {"grid.nodes"});
  CHECK_FALSE(fs::exists(folder / "runs/couette-004"));
}

TEST_CASE("a cell that reaches the outflow ends the run there, with everything written") {
  const auto folder = fresh_folder("outflow");
  // A flow a hundred times the case's, and the cell's front 5 um from the end.
  const auto fast = [](const std::string& out, double z, int speed = 200) {
    return coarse_tube(out, {"cells.0.center_um=[0,0," + std::to_string(z) + "]", "boundary.0.velocity_mm_per_s=" + std::to_string(speed),
                             "boundary.0.ramp_us=4", "time.end_us=100", "output.history_every_us=4", "time.first_step_us=0"});
  };
#ifdef CORPUSCLE_MPI
  const std::vector<int> launches{1, 2};
#else
  const std::vector<int> launches{1};
#endif
  for (const int ranks : launches) {
    const auto outcome =
        fail(folder, fast("out", 16), 5, {"a cell reached the outflow", "cells.0", "um from an outflow at", " us"}, {1, ranks});
    CHECK_THAT(outcome.output, !Contains("outside the grid"));
    const auto r = report(folder / "out");
    CHECK_THAT(r["stopped"].get<std::string>(), Contains("a cell reached the outflow"));
    const auto h = history(folder / "out");
    const double last = h.number(h.lines.size() - 1, "time_us");
    CHECK(last == r["simulated_us"].get<double>());
    CHECK(last < 100);
    // The front, half an extent ahead of the middle, is about 3 um from z = 22.5: within a step's way of 0.3 um.
    const double front = h.number(h.lines.size() - 1, "centroid_z_um") + 0.5 * h.number(h.lines.size() - 1, "extent_z_um");
    CHECK(front == Approx(19.5).margin(0.7));
#ifdef CORPUSCLE_HDF5
    REQUIRE(fs::exists(folder / "out/checkpoint.h5"));
    CHECK(data_set(folder / "out/checkpoint.h5", "numbers").size() > 0);
    CHECK(read_all(folder / "out/cells.h5") == 2);
#endif
  }
  // Nearer at the start: told, and stopped half way, not refused.
  const auto near = fail(folder, fast("near", 20.9, 40), 5, {"warning: cells.0", "disturbs the flow", "a cell reached the outflow"});
  CHECK_THAT(near.output, !Contains("outside the grid"));
}
