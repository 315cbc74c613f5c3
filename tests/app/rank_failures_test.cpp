// One rank fails: all end soon, with the same code and one cause.
#include <chrono>

#include "background.hpp"

using namespace app;
using Catch::Contains;

#if defined(CORPUSCLE_MPI) && defined(CORPUSCLE_HDF5)

namespace {

Words busy_run(const std::string& out, const Words& more = {}) {
  Words settings{"time.end_us=400", "time.step_us=4", "time.first_step_us=0", "output.every_us=4", "output.checkpoint_every_us=4"};
  settings.insert(settings.end(), more.begin(), more.end());
  return coarse_tube(out, settings);
}

/// Limits the size of the files that one rank may write, in kB.
std::string small_files(int rank, int kb) {
  return "if [ $OMPI_COMM_WORLD_RANK = " + std::to_string(rank) + " ]; then ulimit -f " + std::to_string(kb) + "; fi";
}

template <class Work>
void within_20_s(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  CHECK(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < 20 + 10);  // and to start
}

}  // namespace

TEST_CASE("a file that one rank cannot write stops all ranks") {
  const auto folder = fresh_folder("rank_files");
  for (const int ranks : {2, 3}) {
    for (const int failing : {0, ranks - 1}) {
      INFO("rank " << failing << " of " << ranks);
      Launch launch{1, ranks};
      launch.before = small_files(failing, 100);
      within_20_s([&] { fail(folder, busy_run("out"), 3, {"broke down", "writing ", " failed: "}, launch); });
    }
  }
}

TEST_CASE("a file in the way stops all ranks, and the report says what happened") {
  const auto folder = fresh_folder("rank_obstacle");
  for (const int ranks : {2, 3}) {
    fs::remove_all(folder / "out");
    fs::create_directories(folder / "out/checkpoint.h5.part/in the way");
    within_20_s([&] {
      fail(folder, busy_run("out"), 3, {"at 8 us", "checkpoint.h5.part: cannot create this file", "Is a directory"}, {1, ranks});
    });
    CHECK_THAT(report(folder / "out")["broke_down"].get<std::string>(), Contains("checkpoint.h5.part"));
  }
}

TEST_CASE("a killed rank ends all ranks") {
  const auto folder = fresh_folder("rank_killed");
  for (const int ranks : {2, 3}) {
    Launch launch{1, ranks};
    launch.before = "if [ $OMPI_COMM_WORLD_RANK = 1 ]; then echo $$ > victim; fi";
    Background run(folder, busy_run("out", {"time.end_us=4000"}), launch);
    REQUIRE(run.wait_until([&] { return lines(folder / "out/history.csv") >= 3; }));
    const int victim = std::stoi(contents(folder / "victim"));
    within_20_s([&] {
      ::kill(victim, SIGKILL);
      CHECK(run.wait().code != 0);
    });
    fs::remove_all(folder / "out");
  }
}

#else
TEST_CASE("one rank fails") { WARN("skipped: this build has no MPI, or no HDF5"); }
#endif
