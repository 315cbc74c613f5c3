// What shells and scripts do: pipes in and out, background jobs, files edited while a run goes on, words misspelt.
#include "background.hpp"

using namespace app;
using Catch::Contains;

namespace {

Outcome shell(const fs::path& folder, const std::string& command) {
  const auto line = "cd " + quoted(folder.string()) + " && timeout 60 env" + without_mpi_environment() + " OMP_NUM_THREADS=1 bash -c " +
                    quoted(command) + " > screen.txt 2>&1 < /dev/null";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder / "screen.txt")};
}

std::string program() { return quoted(CORPUSCLE_PROGRAM) + " "; }

const std::string small = " --set grid.nodes=[5,5,5] --set time.end_us=2 ";

}  // namespace

TEST_CASE("a case comes from a pipe as from a file") {
  const auto folder = fresh_folder("pipe");
  fs::copy_file(CORPUSCLE_SOURCE_DIR "/cases/mills2004.csv", folder / "mills2004.csv");  // what a piped case names lies here
  for (const std::string name : {"couette", "stretch"}) {
    const auto outcome = shell(folder, program() + "check <(cat " + quoted(scene(name)) + ")" + (name == "couette" ? small : ""));
    INFO(outcome.output);
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.output, Contains("is valid"));
  }
  const auto run = shell(folder, "mkfifo p; cat " + quoted(scene("couette")) + " > p & " + program() + "run p --out out" + small);
  INFO(run.output);
  CHECK(run.code == 0);
  CHECK(report(folder / "out")["steps"] == 2);
}

TEST_CASE("a run goes on when nobody reads what it says") {
  const auto folder = fresh_folder("unread");
  const auto outcome =
      shell(folder, program() + "run " + quoted(scene("couette")) + small + "--out out 2> err.txt | exec 0<&-; exit ${PIPESTATUS[0]}");
  INFO(contents(folder / "err.txt"));
  CHECK(outcome.code == 0);
  CHECK(report(folder / "out")["steps"] == 2);
  CHECK_THAT(contents(folder / "err.txt"), Contains("can no longer be written"));
}

TEST_CASE("signals that a run was started to ignore do not stop it") {
  const auto folder = fresh_folder("ignored");
  Launch launch;
  launch.before = "trap '' HUP INT";
  Background run(folder, with({"run", scene("couette"), "--out", "out"}, {"grid.nodes=[5,5,5]", "time.end_us=100000"}), launch);
  REQUIRE(run.wait_until([&] { return fs::exists(folder / "out/fields/step_000000000.h5"); }));
  run.send(SIGHUP);
  run.send(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  CHECK_FALSE(run.wait_until([&] { return fs::exists(folder / "out/report.json"); }, std::chrono::milliseconds(200)));
  run.send(SIGTERM);
  const auto outcome = run.wait();
  INFO(outcome.output);
  CHECK(outcome.code == 4);
  CHECK(report(folder / "out")["stopped"] == "SIGTERM");
}

TEST_CASE("error bars are of the case as it was read, once for each kind, and a signal that ends them is named") {
  const auto folder = fresh_folder("bars");
  const auto text = contents(scene("couette"));
  const Words settings{"grid.nodes=[5,5,5]", "time.end_us=2000", "output.every_us=0"};
  const auto words = with({"run", "case.toml", "--out", "out", "--estimate-error=step,step"}, settings);
  std::ofstream(folder / "case.toml") << text;
  Background run(folder, words);
  REQUIRE(run.wait_until([&] { return fs::exists(folder / "out/fields.h5"); }));
  std::ofstream(folder / "case.toml") << "an edit that is under way";
  const auto outcome = run.wait();
  INFO(outcome.output);
  REQUIRE(outcome.code == 0);
  const auto bars = report(folder / "out")["error_estimate"];
  REQUIRE(bars.size() == 1);
  CHECK_FALSE(bars[0].contains("failed"));

  std::ofstream(folder / "case.toml") << text;
  Background second(folder, with({"run", "case.toml", "--out", "stopped", "--estimate-error=step"},
                                 {"grid.nodes=[5,5,5]", "time.end_us=6000", "output.every_us=0"}));
  REQUIRE(second.wait_until(
      [&] { return fs::exists(folder / "stopped/coarser_step/.corpuscle.run") || fs::exists(folder / "stopped/coarser_step"); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  second.send(SIGINT);
  const auto stopped = second.wait();
  INFO(stopped.output);
  CHECK(stopped.code == 4);
  CHECK_THAT(stopped.output, Contains("stopped by SIGINT before all error bars were there"));
  CHECK_THAT(report(folder / "stopped")["error_estimate"][0]["failed"].get<std::string>(), Contains("SIGINT"));
}

TEST_CASE("a command that does not exist is named, and suffixes are read in capitals as well") {
  const auto folder = fresh_folder("words");
  fail(folder, {"runn", scene("couette")}, 2, {"runn", "there is no such command", "did you mean 'run'?"});
  fail(folder, {"frobnicate"}, 2, {"frobnicate", "known: run, check, mesh"});
  succeed(folder, {"mesh", "--vertices", "200", "-o", "cell.OFF"});
  succeed(folder, {"mesh", "--vertices", "200", "-o", "cell.off"});
  CHECK(contents(folder / "cell.OFF") == contents(folder / "cell.off"));
}

TEST_CASE("run.sh is found through links, and its help names every option of a run") {
  const auto folder = fresh_folder("run_sh");
  fs::create_symlink(CORPUSCLE_SOURCE_DIR "/run.sh", folder / "run");
  const auto help = shell(folder, "./run --help");
  INFO(help.output);
  CHECK(help.code == 0);
  for (const char* option : {"--out", "--set", "--restart", "--overwrite", "--estimate-error"}) CHECK_THAT(help.output, Contains(option));
  // Beside it: a script that says where it was looked for.
  fs::create_directory(folder / "there");
  fs::copy_file(CORPUSCLE_SOURCE_DIR "/run.sh", folder / "there/run.sh");
  std::ofstream(folder / "there/setup.sh") << "#!/bin/sh\necho found; exit 9\n";
  fs::permissions(folder / "there/setup.sh", fs::perms::owner_all);
  fs::create_symlink("there/run.sh", folder / "linked.sh");
  const auto linked = shell(folder, "./linked.sh case.toml");
  CHECK(linked.code == 9);
  CHECK_THAT(linked.output, Contains("found"));
}
