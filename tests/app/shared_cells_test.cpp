// Cells that are shared out over ranks, in the files of a run.
#include <cmath>
#include <fstream>

#include "program.hpp"

using namespace app;

namespace {

/// Capsules in rows between walls, in a flow along x.
fs::path write_case(const fs::path& folder, int cells) {
  std::ofstream out(folder / "rows.toml");
  out << "[time]\nstep_us = 10\nend_us = 60\n"
         "[grid]\ngenerator = \"box\"\nnodes = [25, 9, 13]\nlower_um = [0, 0, 0]\nupper_um = [12, 4, 6]\n"
         "[fluid]\nconvection = false\npressure_gradient_Pa_per_um = [-6, 0, -2]\n"
         "momentum_tolerance = 1e-12\ndivergence_tolerance = 1e-13\n";
  for (const char* side : {"i_min", "i_max", "j_min", "j_max", "k_min", "k_max"})
    out << "[[boundary]]\nside = \"" << side << "\"\ntype = \"" << (side[0] == 'j' ? "wall" : "periodic") << "\"\n";
  out << "[[cell_types]]\nname = \"large\"\nshape = \"sphere\"\nradius_um = 0.75\nvertices = 60\nlaw = \"neo-hookean\"\n"
         "[[cell_types]]\nname = \"small\"\nshape = \"sphere\"\nradius_um = 0.65\nvertices = 50\nlaw = \"neo-hookean\"\n";
  for (int n = 0; n < cells; ++n)
    out << "[[cells]]\ntype = \"" << (n % 3 == 0 ? "large" : "small") << "\"\ncenter_um = [" << 1 + 2.0 * (n % 6) << ", "
        << 1 + 2.0 * (n / 6 % 2) << ", " << 1.5 + 3.0 * (n / 12) << "]\n";
  out << "[coupling]\nscheme = \"force\"\n[output]\nfields = false\nevery_us = 30\n";
  return folder / "rows.toml";
}

#ifdef CORPUSCLE_HDF5
double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}
#endif

}  // namespace

TEST_CASE("of many cells the history has the means, and cells.h5 what each does") {
  const auto folder = fresh_folder("many_cells");
  const int cells = 18;
  const std::string name = write_case(folder, cells).string();
  succeed(folder, {"run", name, "--out", "one"}, {1, 1});
  const auto one = history(folder / "one");
  REQUIRE(one.lines.size() == 7);  // the start and six steps
  CHECK(report(folder / "one")["quantities"].dump().find("cell_0") == std::string::npos);
#ifdef CORPUSCLE_HDF5
  const std::string last = "step_000000006/";
  const auto centroid = data_set(folder / "one/cells.h5", last + "per_cell/centroid_um");
  REQUIRE(centroid.size() == 3 * cells);
  double mean = 0;
  for (int n = 0; n < cells; ++n) mean += centroid[3 * n] / cells;
  CHECK(mean == Approx(one.number(6, "centroid_x_um")).epsilon(1e-12));
  CHECK(mean > 6.05);  // they have moved
  const auto body = data_set(folder / "one/cells.h5", "body");
  for (std::size_t t = 1; t < body.size(); ++t) REQUIRE(body[t] >= body[t - 1]);
  CHECK(body.back() == cells - 1);
#ifdef CORPUSCLE_MPI
  succeed(folder, {"run", name, "--out", "two"}, {1, 2});
  for (const std::string set : {"triangles", "body"}) {
    INFO(set);
    CHECK(largest_difference(data_set(folder / "one/cells.h5", set), data_set(folder / "two/cells.h5", set)) == 0);
  }
  // Round-off, grown over six steps of solves to 1e-12.
  for (const std::string set : {"x_um", "velocity_um_per_us", "traction_kPa", "per_cell/area_um2", "per_cell/centroid_um"}) {
    INFO(set);
    CHECK(largest_difference(data_set(folder / "one/cells.h5", last + set), data_set(folder / "two/cells.h5", last + set)) < 1e-9);
  }
  // What two ranks wrote one goes on from, and four.
  for (int ranks : {1, 4}) {
    const std::string out = "from_two_on_" + std::to_string(ranks);
    succeed(folder, {"run", name, "--out", out, "--restart", "two/checkpoint.h5", "--set", "time.end_us=90"}, {1, ranks});
    CHECK(history(folder / out).number(0, "time_us") == 70);
  }
  const auto a = history(folder / "from_two_on_1"), b = history(folder / "from_two_on_4");
  CHECK(a.number(2, "centroid_x_um") == Approx(b.number(2, "centroid_x_um")).epsilon(1e-10));
#endif
#endif
}

TEST_CASE("check, a run and its report say what a population has become, and a restart keeps to it") {
  const auto folder = fresh_folder("populations");
  const std::string name = write_case(folder, 1).string();
  {
    std::ofstream more(name, std::ios::app);
    more << "[contact]\n[[populations]]\ntype = \"small\"\nhematocrit = 0.1\n";
  }
  for (const char* word : {"check", "run"}) {
    Words words{word, name};
    if (std::string(word) == "run") words.insert(words.end(), {"--out", "one"});
    const auto outcome = succeed(folder, words, {1, 1});
    CHECK_THAT(outcome.output, Catch::Contains("populations.0: 28 cells \"small\", hematocrit 0.09") && Catch::Contains("asked for 0.1") &&
                                   Catch::Contains("smallest gap between cells 0.1"));
  }
  const auto all = report(folder / "one");
  CHECK(all["populations"][0]["cells"] == 28);
  CHECK(all["populations"][0]["hematocrit"].get<double>() == Approx(0.1).margin(0.002));
  CHECK(all["tube_hematocrit"].get<double>() > all["populations"][0]["hematocrit"].get<double>());
  fail(folder, with({"check", name}, {"populations.0.hematocrit=0.75"}), 2, {"populations.0.hematocrit = 0.75", "do not fit"});
#ifdef CORPUSCLE_HDF5
  fail(folder, with({"run", name, "--out", "other", "--restart", "one/checkpoint.h5"}, {"time.end_us=90", "populations.0.seed=2"}), 2,
       {"another scene", "populations.0.seed = 2"});
  const auto outcome = succeed(folder, with({"run", name, "--out", "other", "--restart", "one/checkpoint.h5"}, {"time.end_us=90"}), {1, 1});
  CHECK_THAT(outcome.output, Catch::Contains("populations.0: 28 cells"));
#endif
}

TEST_CASE("few cells have lines of their own, whichever ranks have them") {
  const auto folder = fresh_folder("few_cells");
  const std::string name = write_case(folder, 5).string();
  succeed(folder, {"run", name, "--out", "one"}, {1, 1});
  const auto one = history(folder / "one");
  REQUIRE(one.lines.size() == 7 * 5);
  for (int n = 0; n < 5; ++n) CHECK(one.number(30 + n, "cell") == n);
#ifdef CORPUSCLE_MPI
  succeed(folder, {"run", name, "--out", "two"}, {1, 2});
  const auto two = history(folder / "two");
  REQUIRE(two.lines.size() == one.lines.size());
  for (const char* column : {"centroid_x_um", "velocity_z_mm_per_s", "area_um2", "elastic_energy_fJ", "diameter_um"})
    for (std::size_t n = 0; n < one.lines.size(); ++n) CHECK(one.number(n, column) == Approx(two.number(n, column)).margin(1e-9));
#endif
}

TEST_CASE("a cell that the flow goes past on both sides is measured along its own axis, not along what rounding moves it") {
  const auto folder = fresh_folder("cell_at_rest");
  succeed(folder,
          with({"run", scene("cell_shear"), "--out", "out"},
               {"grid.nodes=[13,13,11]", "cells.0.vertices=200", "cells.0.reference=shape", "cells.0.membrane_viscosity_N_s_per_m=1e-8",
                "time.end_us=1000", "output.every_us=0", "output.history_every_us=1000", "output.checkpoint_every_us=0"}));
  const auto lines = history(folder / "out");
  const std::size_t last = lines.lines.size() - 1;
  CHECK(lines.number(last, "length_um") < 4);
  CHECK(lines.number(last, "diameter_um") > 6);
}
