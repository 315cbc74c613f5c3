// The same question gets the same answer: again, after a restart, on other numbers of threads and ranks.
#include <cmath>
#include <cstring>
#include <map>

#include "common/extremes.hpp"
#include "program.hpp"

using namespace app;

namespace {

/// Size of a column's quantity, for relative differences.
double scale(const std::string& column) {
  if (column.find("velocity") != std::string::npos) return 2;      // mm/s: the mean flow
  if (column == "area_um2" || column == "volume_um3") return 100;  // of a cell: 133 and 92
  return column.find("_um") != std::string::npos ? 10 : 1;         // um: the tube; else energy, 2.6 fJ, and ratios
}

/// Largest difference of each column over its scale.
std::map<std::string, double> differences(const History& a, const History& b) {
  REQUIRE(a.names == b.names);
  REQUIRE(a.lines.size() == b.lines.size());
  std::map<std::string, double> largest;
  for (std::size_t n = 0; n < a.lines.size(); ++n)
    for (const auto& name : a.names) {
      const double difference = std::abs(a.number(n, name) - b.number(n, name)) / scale(name);
      largest[name] = std::max(largest[name], std::isfinite(difference) ? difference : 1e300);
    }
  return largest;
}

#ifdef CORPUSCLE_HDF5
constexpr const char* state_sets[] = {"velocity",  "velocity_old",         "pressure",       "flux_i", "flux_j", "flux_k",
                                      "membranes", "classified_positions", "history_levels", "numbers"};

/// The states in two checkpoints are the same to the last bit. @param cut  the cell cuts the grid
void require_same_state(const fs::path& a, const fs::path& b, bool cell, bool cut = true) {
  for (const std::string name : state_sets) {
    if ((!cell && name == "membranes") || (!(cell && cut) && name == "classified_positions")) continue;
    const auto x = data_set(a, name), y = data_set(b, name);
    REQUIRE(x.size() == y.size());
    std::size_t different = 0;
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      different += std::memcmp(&x[i], &y[i], sizeof x[i]) != 0;
      largest = corpuscle::larger(largest, std::abs(x[i] - y[i]));
    }
    INFO(name << ": " << different << " of " << x.size() << " numbers differ, by up to " << largest);
    CHECK(different == 0);
  }
}

/// Run to 12 us in one go, and to 6 us and from there; history and final state must be the same bits.
void require_same_after_restart(const fs::path& folder, const std::string& name, const Words& settings, bool cell, bool cut = true) {
  const auto words = [&](const std::string& out, const std::string& end) {
    auto all = settings;
    all.insert(all.end(), {"grid.nodes=[17,17,25]", "time.step_us=1", "output.history_every_us=1", "output.checkpoint_every_us=6", end});
    return with({"run", name, "--out", out}, all);
  };
  succeed(folder, words("whole", "time.end_us=12"));
  succeed(folder, words("parts", "time.end_us=6"));
  fs::copy_file(folder / "parts/checkpoint.h5", folder / "half.h5");
  auto second = words("parts", "time.end_us=12");
  second.insert(second.end(), {"--restart", "parts/checkpoint.h5"});
  succeed(folder, second);
  require_same_state(folder / "whole/checkpoint.h5", folder / "parts/checkpoint.h5", cell, cut);
  if (!cell) return;
  CHECK(history(folder / "parts").lines.size() == 13);
  const bool same = contents(folder / "whole/history.csv") == contents(folder / "parts/history.csv");
  for (const auto& [column, difference] : differences(history(folder / "whole"), history(folder / "parts")))
    if (!same && difference > 0) WARN(column << " differs by " << difference << " of its scale");
  CHECK(same);
}
#endif

}  // namespace

TEST_CASE("the same command gives the same bits") {
  for (int threads = 1; threads <= (host_threads ? 2 : 1); ++threads) {
    const auto folder = fresh_folder("repeated");
    for (const char* out : {"first", "second"}) succeed(folder, coarse_tube(out, {"time.end_us=8"}), {threads, 1});
    REQUIRE(report(folder / "first")["threads"] == threads);
    const auto text = contents(folder / "first/history.csv");
    REQUIRE(history(folder / "first").lines.size() == 9);
    CHECK(text == contents(folder / "second/history.csv"));
#ifdef CORPUSCLE_HDF5
    require_same_state(folder / "first/checkpoint.h5", folder / "second/checkpoint.h5", true);
#endif
  }
}

TEST_CASE("threads and ranks agree") {
  const auto folder = fresh_folder("agreement");
  // The linear solvers stop at 1e-8 of the velocity and far below for the divergence, at residuals that depend on the
  // order of sums. Measured: 5e-11.
  constexpr double tolerance = 1e-9;
  const Words settings{"time.end_us=10", "output.fields=false"};
  succeed(folder, coarse_tube("one", settings));
  const auto one = history(folder / "one");
  const auto compare = [&](const std::string& out, const Launch& launch) {
    succeed(folder, coarse_tube(out, settings), launch);
    const auto r = report(folder / out);
    REQUIRE(r["ranks"] == launch.ranks);
    REQUIRE(r["threads"] == launch.threads);
    CHECK(r["errors"]["max_divergence"].get<double>() < 1e-10);
    for (const auto& [column, difference] : differences(one, history(folder / out))) {
      INFO(out << ": " << column);
      CHECK(difference < tolerance);
    }
  };
  if (host_threads)
    compare("two threads", {2, 1});
  else
    WARN("skipped: threads, because this build has none on the host");
#ifdef CORPUSCLE_MPI
  compare("two ranks", {1, 2});
  compare("four ranks", {1, 4});
#else
  WARN("skipped: ranks, because this build has no MPI");
#endif
}

TEST_CASE("cells with cytosol that touch move the same on two threads") {
  if (!host_threads) return;
  const auto folder = fresh_folder("threads_of_cells");
  const auto run = [&](const std::string& out, int threads) {
    succeed(folder,
            with({"run", scene("two_cells"), "--out", out},
                 {"grid.nodes=[17,17,17]", "cell_types.0.vertices=200", "cell_types.0.viscosity_ratio=5",
                  "cell_types.0.membrane_viscosity_N_s_per_m=1e-7", "cells.0.center_um=[0.1,0.2,-1.3]", "cells.1.center_um=[0.1,0.2,1.3]",
                  "fluid.momentum_tolerance=1e-12", "fluid.divergence_tolerance=1e-12", "time.step_us=5", "time.end_us=200",
                  "output.every_us=0"}),
            {threads, 1});
    return history(folder / out);
  };
  for (const auto& [column, difference] : differences(run("one", 1), run("two", 2))) {
    INFO(column);
    CHECK(difference < 1e-8);  // of the order of sums, and residuals of the solvers at 1e-12
  }
  CHECK(report(folder / "two")["contact"]["smallest_gap_um"] < 0.4);
}

#ifdef CORPUSCLE_HDF5

// Twelve steps lie within the inlet's ramp, so boundary values change between the stored time levels.
TEST_CASE("a restart goes on with the same bits") {
  const auto folder = fresh_folder("restart");
  SECTION("flow without a cell") { require_same_after_restart(folder, scene("tube_flow"), {}, false); }
  SECTION("cell, default coupling") { require_same_after_restart(folder, scene("straight_tube"), {}, true); }
  SECTION("cell without membrane viscosity, steady inlet") {
    require_same_after_restart(folder, scene("straight_tube"), {"cells.0.membrane_viscosity_N_s_per_m=0", "boundary.0.ramp_us=0"}, true);
  }
  SECTION("cell, steps that grow") { require_same_after_restart(folder, scene("straight_tube"), {"time.first_step_us=0.0625"}, true); }
  SECTION("cell, steps that are short again after the end of the inlet's ramp") {
    require_same_after_restart(folder, scene("straight_tube"), {"time.first_step_us=0.25", "boundary.0.ramp_us=4"}, true);
  }
  SECTION("cell as a force") {
    require_same_after_restart(folder, scene("straight_tube"), {"coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0"}, true,
                               false);
  }
  SECTION("cell as a force, with a pressure that jumps") {
    require_same_after_restart(folder, scene("straight_tube"), {"coupling.scheme=force", "coupling.pressure=sharp"}, true, false);
  }
  SECTION("cell as a force, with cytosol and membrane viscosity") {
    require_same_after_restart(folder, scene("straight_tube"), {"coupling.scheme=force", "cells.0.viscosity_ratio=5"}, true, false);
  }
  SECTION("cell, iterated coupling") { require_same_after_restart(folder, scene("straight_tube"), {"coupling.scheme=iterated"}, true); }
  SECTION("cell, iterated coupling with Aitken's relaxation") {
    require_same_after_restart(
        folder, scene("straight_tube"),
        {"coupling.scheme=iterated", "coupling.acceleration=aitken", "coupling.robin_in_iterated=false", "cells.0.mass_pg=30"}, true);
    // A step starts from the factor of the one before, 0.05 here, or from a half where that was larger: then nothing would show.
    CHECK(data_set(folder / "half.h5", "coupling")[0] < 0.5);
  }
}

TEST_CASE("a restart may go on with steps of another length") {
  const auto folder = fresh_folder("restart_step");
  succeed(folder, coarse_tube("whole", {"time.end_us=24"}));
  const auto whole = history(folder / "whole");
  for (const char* step : {"0.5", "2"}) {
    succeed(folder, coarse_tube("parts", {"time.end_us=12"}));
    auto words = coarse_tube("parts", {"time.end_us=24", std::string("time.step_us=") + step});
    words.insert(words.end(), {"--restart", "parts/checkpoint.h5"});
    succeed(folder, words);
    const auto parts = history(folder / "parts");
    const auto last = parts.lines.size() - 1, whole_last = whole.lines.size() - 1;
    INFO("step " << step);
    REQUIRE(parts.number(last, "time_us") == 24);
    // The cell lags behind the inlet's ramp, which ends at 20 us, by about a step.
    for (const char* name : {"centroid_z_um", "velocity_z_mm_per_s"})
      CHECK(parts.number(last, name) == Approx(whole.number(whole_last, name)).epsilon(0.08));
    CHECK(report(folder / "parts")["errors"]["max_divergence"].get<double>() < 1e-10);
  }
}

TEST_CASE("a restart keeps the history before it and adds what follows") {
  const auto folder = fresh_folder("restart_history");
  succeed(folder, coarse_tube("out", {"time.end_us=4", "output.checkpoint_every_us=3"}));
  fs::copy_file(folder / "out/checkpoint.h5", folder / "at_4.h5");
  const auto before = contents(folder / "out/history.csv");
  auto words = coarse_tube("out", {"time.end_us=6"});
  words.insert(words.end(), {"--restart", "at_4.h5"});
  succeed(folder, words);
  const auto after = contents(folder / "out/history.csv");
  REQUIRE(after.substr(0, before.size()) == before);
  const auto h = history(folder / "out");
  REQUIRE(h.lines.size() == 7);
  for (int n = 0; n < 7; ++n) REQUIRE(h.number(n, "time_us") == n);
}

#else
TEST_CASE("a restart goes on with the same bits") { WARN("skipped: this build has no HDF5"); }
#endif
