// How threads wait for each other, which decides how much other work on the machine costs.
#include <signal.h>

#include <chrono>

#include "program.hpp"

using namespace app;
using Catch::Contains;

#ifdef KOKKOS_ENABLE_OPENMP

namespace {

/// As a user starts the program, who has said nothing about waiting.
Launch plainly(int threads, const std::string& more = "") {
  return {.threads = threads, .waiting = "-u OMP_WAIT_POLICY -u GOMP_SPINCOUNT -u KMP_BLOCKTIME " + more};
}

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

const Words short_stretch{"stretching.steps=1", "cells.0.vertices=200", "stretching.tolerance=0.01"};

/// A process that never waits, as long as this lives.
class BusyProcess {
 public:
  BusyProcess() : child_(fork()) {
    for (volatile bool counts = true; child_ == 0 && counts;) {
    }
  }
  ~BusyProcess() {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  BusyProcess(const BusyProcess&) = delete;
  BusyProcess& operator=(const BusyProcess&) = delete;

 private:
  pid_t child_;
};

}  // namespace

TEST_CASE("waiting is set before the run time of the threads starts") {
  const auto folder = fresh_folder("waiting");
  const auto words = with({"run", scene("stretch"), "--out", "out"}, short_stretch);
  const auto outcome = succeed(folder, words, plainly(2, "OMP_DISPLAY_ENV=VERBOSE"));
  const std::string waiting = report(folder / "out")["waiting"];
  REQUIRE_THAT(waiting, Contains("GOMP_SPINCOUNT="));
  const std::string spins = waiting.substr(waiting.find('=') + 1);
  CHECK(std::stol(spins) >= 100);
  CHECK(std::stol(spins) <= 20000);
  // What GNU's run time has taken from the environment, on the screen once for each start of the program.
  if (count(outcome.output, "GOMP_SPINCOUNT") > 0) {
    CHECK_THAT(outcome.output, Contains("GOMP_SPINCOUNT = '" + spins + "'"));
    CHECK(count(outcome.output, "OPENMP DISPLAY ENVIRONMENT BEGIN") == 2);
  }
}

TEST_CASE("threads bound to processors keep all of them") {
  const auto folder = fresh_folder("waiting_bound");
  const auto words = with({"run", scene("stretch"), "--out", "out"}, short_stretch);
  const auto outcome = succeed(folder, words, plainly(2, "OMP_PROC_BIND=true OMP_DISPLAY_ENV=VERBOSE"));
  // Places as they were found at either start of the program; only GNU's run time lists them.
  std::vector<std::string> places;
  const std::string key = "OMP_PLACES = '";
  for (auto at = outcome.output.find(key); at != std::string::npos; at = outcome.output.find(key, at + 1))
    places.push_back(outcome.output.substr(at, outcome.output.find('\n', at) - at));
  if (places.size() > 1) CHECK(places.front() == places.back());
}

TEST_CASE("what the user says about waiting holds") {
  const auto folder = fresh_folder("waiting_of_user");
  const auto words = with({"run", scene("stretch"), "--out", "out"}, short_stretch);
  for (const char* own : {"GOMP_SPINCOUNT=12345", "OMP_WAIT_POLICY=passive"}) {
    fs::remove_all(folder / "out");
    const auto outcome = succeed(folder, words, plainly(2, std::string(own) + " OMP_DISPLAY_ENV=VERBOSE"));
    CHECK(report(folder / "out")["waiting"] == own);
    if (count(outcome.output, "GOMP_SPINCOUNT") > 0) CHECK(count(outcome.output, "OPENMP DISPLAY ENVIRONMENT BEGIN") == 1);
  }
  fs::remove_all(folder / "out");
  succeed(folder, words, plainly(1));
  CHECK(report(folder / "out")["waiting"] == "default");  // one thread waits for no other
}

#ifdef CORPUSCLE_MPI
TEST_CASE("ranks of several threads are started as by the launcher") {
  const auto folder = fresh_folder("waiting_ranks");
  auto launch = plainly(2);
  launch.ranks = 2;
  succeed(folder, with({"run", scene("tube_flow"), "--out", "out"}, {"grid.nodes=[9,9,13]", "time.step_us=1", "time.end_us=2"}), launch);
  const auto r = report(folder / "out");
  CHECK(r["ranks"] == 2);
  CHECK_THAT(r["waiting"].get<std::string>(), Contains("GOMP_SPINCOUNT="));
}
#endif

TEST_CASE("beside a busy process two threads are not much slower than one") {
  const auto folder = fresh_folder("busy");
  const BusyProcess other;
  double one = 1e30, two = 1e30;  // the fastest of several: there may be yet more work on the machine
  for (int n = 0; n < 3; ++n)
    for (const int threads : {1, 2}) {
      fs::remove_all(folder / "out");
      succeed(folder, coarse_tube("out", {"time.first_step_us=0", "time.end_us=10", "output.fields=false"}), plainly(threads));
      double& fastest = threads == 1 ? one : two;
      fastest = std::min(fastest, report(folder / "out")["wall_s"].get<double>());
    }
  INFO("one thread " << one << " s, two threads " << two << " s");
  // Two threads that spin until the other comes take 5 to 10 times as long as one here, on two cores.
  CHECK(two < 3 * one);
}

#else
TEST_CASE("how threads wait") { WARN("skipped: this build has no threads on the host"); }
#endif
