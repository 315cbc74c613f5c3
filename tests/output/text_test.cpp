// history.csv and report.json, and what happens when they cannot be written.
#include <Kokkos_Core.hpp>
#include <sstream>
#include <thread>

#include "core/error.hpp"
#include "core/log.hpp"
#include "core/timers.hpp"
#include "folder.hpp"
#include "output/history.hpp"
#include "output/report.hpp"

using namespace corpuscle;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

HistorySample sample(double time, double z) {
  HistorySample s;
  s.time_us = time;
  s.cell = 0;
  s.centroid_um = Triple{0.1, -1.0 / 3, z};
  s.velocity_um_per_us = Triple{0, 0, 2e-3};
  s.area_um2 = 134;
  return s;
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

}  // namespace

TEST_CASE("history.csv has the columns of the scene and every digit", "[ranks]") {
  const auto folder = test::fresh_folder("history");
  const Comm comm;
  {
    HistoryWriter history(folder.string(), comm, {.cells = true, .more = {"flow_rate_um3_per_us"}});
    auto first = sample(0.1, 1.0 / 7);
    first.more = {0.25};
    history.write(first);
    HistorySample flow;
    flow.time_us = 0.2;
    history.write(flow);
  }
  comm.barrier();
  const auto text = lines(test::contents(folder / "history.csv"));
  REQUIRE(text.size() == 3);
  REQUIRE(text[0] ==
          "time_us,cell,centroid_x_um,centroid_y_um,centroid_z_um,velocity_x_mm_per_s,velocity_y_mm_per_s,"
          "velocity_z_mm_per_s,extent_x_um,extent_y_um,extent_z_um,area_um2,volume_um3,elastic_energy_fJ,"
          "flow_rate_um3_per_us");
  REQUIRE(text[1] == "0.10000000000000001,0,0.10000000000000001,-0.33333333333333331,0.14285714285714285,0,0,2,,,,134,,,0.25");
  REQUIRE(text[2] == "0.20000000000000001,,,,,,,,,,,,,,");
}

TEST_CASE("history.csv of stretching and of rigid bodies") {
  const auto folder = test::fresh_folder("columns");
  const Comm comm;
  HistoryWriter stretching(folder.string(), comm, {.stretching = true});
  auto s = sample(0, 0);
  s.axial_um = 9.5, s.transverse_um = 7, s.force_pN = 12.5;
  stretching.write(s);
  const auto pulled = lines(test::contents(folder / "history.csv"));
  REQUIRE_THAT(pulled[0], Catch::EndsWith("elastic_energy_fJ,axial_um,transverse_um,force_pN"));
  REQUIRE_THAT(pulled[1], Catch::EndsWith(",9.5,7,12.5"));

  HistoryWriter bodies(folder.string(), comm, {.bodies = true});
  HistorySample b;
  b.cell = 3;
  b.force_nN = Triple{1, 2, 3};
  b.torque_nN_um = Triple{4, 5, 6};
  bodies.write(b);
  REQUIRE(lines(test::contents(folder / "history.csv")).at(1) == "0,3,,,,,,,1,2,3,4,5,6");
}

TEST_CASE("a restart keeps the history up to its time and continues it", "[ranks]") {
  const auto folder = test::fresh_folder("history_restart");
  const Comm comm;
  const auto run = [&](int from, int to, std::optional<double> restart) {
    HistoryWriter history(folder.string(), comm, {.cells = true}, restart);
    for (int step = from; step <= to; ++step) history.write(sample(0.1 * step, step));
    comm.barrier();
  };
  run(0, 20, {});
  comm.barrier();
  const auto whole = test::contents(folder / "history.csv");
  comm.barrier();
  SECTION("after the last checkpoint, samples beyond it are dropped and written again") { run(8, 20, 0.1 * 7); }
  SECTION("a line cut short by a crash is dropped") {
    if (comm.root()) fs::resize_file(folder / "history.csv", whole.size() - 5);
    comm.barrier();
    run(20, 20, 5.0);
  }
  SECTION("a restart into an empty folder starts a new file") {
    if (comm.root()) fs::remove(folder / "history.csv");
    comm.barrier();
    run(0, 20, 0.0);
  }
  comm.barrier();
  REQUIRE(test::contents(folder / "history.csv") == whole);
}

TEST_CASE("a history with other columns is not continued") {
  const auto folder = test::fresh_folder("history_other");
  const Comm comm;
  { HistoryWriter history(folder.string(), comm, {.cells = true}); }
  const auto message = test::message_of<InputError>([&] { HistoryWriter(folder.string(), comm, {.bodies = true}, 1.0); });
  REQUIRE_THAT(message, Contains("history.csv") && Contains("columns") && Contains("--out"));
}

TEST_CASE("a full disk stops the history with the file and the amount written", "[ranks]") {
  const auto folder = test::fresh_folder("full");
  const Comm comm;
  if (comm.root()) fs::create_symlink("/dev/full", folder / "history.csv");
  comm.barrier();
  const auto message = test::message_of<ComputationError>([&] { HistoryWriter(folder.string(), comm, {}); });
  REQUIRE_THAT(message, Contains("history.csv") && Contains("No space left") && Contains("0 bytes"));
}

TEST_CASE("a folder that cannot be made or written is a wrong input") {
  const auto folder = test::fresh_folder("unwritable");
  std::ofstream(folder / "file") << "in the way";
  for (const auto& path : {folder / "file", folder / "file" / "below"}) {
    const auto message = test::message_of<InputError>([&] { prepare_folder(path.string()); });
    REQUIRE_THAT(message, Contains("--out " + path.string()) && Contains("cannot create this folder"));
  }
  prepare_folder((folder / "a" / "b").string());
  REQUIRE(fs::is_empty(folder / "a" / "b"));
  const auto message = test::message_of<InputError>([&] { HistoryWriter((folder / "file").string(), Comm(), {}); });
  REQUIRE_THAT(message, Contains("history.csv: cannot write this file"));
}

TEST_CASE("report.json holds the contract's entries", "[ranks]") {
  const auto folder = test::fresh_folder("report");
  const Comm comm;
  Report report;
  report.case_path = "cases/\xff.toml";  // not UTF-8: file names need not be
  report.active = {"fluid"};
  report.left_out = {"membrane"};
  report.steps = 3;
  report.wall_s = 1.5;
  report.wall_s_by_part = {{"momentum", 0.5 + comm.rank()}};
  report.momentum_iterations.add(4);
  report.momentum_iterations.add(7);
  report.errors["max_divergence"] = 1e-11;
  report.errors["scene"] = 0.25;
  report.extra["stability_margin"] = 2.0;
  write_report(folder.string(), comm, report);
  const auto json = nlohmann::json::parse(test::contents(folder / "report.json"));
  for (const char* key : {"case", "git", "backend", "ranks", "threads", "modules", "steps", "simulated_us", "wall_s", "wall_s_by_part",
                          "peak_rss_mb", "iterations", "errors"})
    REQUIRE(json.contains(key));
  REQUIRE(json["ranks"] == comm.size());
  REQUIRE(json["modules"]["left_out"][0] == "membrane");
  REQUIRE(json["wall_s_by_part"]["momentum"] == 0.5 + (comm.size() - 1));  // of the slowest rank
  REQUIRE(json["iterations"]["momentum"]["mean"] == 5.5);
  REQUIRE(json["iterations"]["momentum"]["max"] == 7);
  REQUIRE(json["iterations"]["coupling"].is_null());
  REQUIRE(json["errors"]["max_divergence"] == 1e-11);
  REQUIRE(json["errors"]["slip"].is_null());
  REQUIRE(json["errors"]["scene"] == 0.25);
  REQUIRE(json["stability_margin"] == 2.0);
  // A process that has started Kokkos and MPI takes some MB, and a test far less than 10 GB.
  REQUIRE(json["peak_rss_mb"] > 1.0);
  REQUIRE(json["peak_rss_mb"] < 10000.0 * comm.size());
}

TEST_CASE("parts of the wall time do not overlap") {
  Timers timers;
  const auto sleep = [](int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); };
  const auto began = std::chrono::steady_clock::now();
  for (int step = 0; step < 2; ++step) {
    const auto outer = timers.scope("outer");
    sleep(5);
    {
      const auto inner = timers.scope("inner");
      sleep(40);
    }
  }
  const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const auto seconds = timers.seconds();
  REQUIRE(seconds.at("inner") >= 0.08);  // sleeps last at least as long as asked for
  REQUIRE(seconds.at("outer") >= 0.01);
  REQUIRE(seconds.at("inner") + seconds.at("outer") <= whole);
}

TEST_CASE("the progress line") {
  REQUIRE(progress_text(123, 1000, 45.61, 80) == "12.3 %  123 of 1000 us  45.6 steps/s  1 min 20 s left");
  REQUIRE(progress_text(999.99, 1000, 2, 3700) == "99.9 %  999.99 of 1000 us  2 steps/s  1 h 1 min left");
  REQUIRE_THAT(progress_text(0, 1000, 0, -1), !Contains("left"));
  // On a narrow terminal the rate goes before the error does.
  REQUIRE(progress_text(123, 1000, 45.61, 80, "energy_balance 0.00041 of 0.05", 75) ==
          "12.3 %  123 of 1000 us  1 min 20 s left  energy_balance 0.00041 of 0.05");
  REQUIRE(progress_text(123, 1000, 45.61, 80, "energy_balance 0.00041 of 0.05", 30) == "12.3 %  123 of 1000 us  1 min ");
  REQUIRE_THAT(progress_text(10, 1000, 2, 80, "slip 0.1 of 0.15"), Contains("1 min 20 s left  slip 0.1 of 0.15"));
}
