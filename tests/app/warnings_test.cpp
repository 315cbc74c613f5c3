// Error figures that are bad are said so, with the key that helps; good runs are left in peace.
#include <cmath>

#include "app/figure_levels.hpp"
#include "app/run_totals.hpp"
#include "program.hpp"

using namespace app;
using namespace corpuscle;
using Catch::Contains;

namespace {

Words figures_of(const nlohmann::json& warnings) {
  Words names;
  for (const auto& w : warnings) names.push_back(w["figure"]);
  return names;
}

const FigureScales moving{2e-3, 10, false};

/// A tube of 10 um with a held sphere of 0.7 of its diameter, on 13 x 13 x 17 nodes.
const char* tight_sphere = R"([time]
step_us = 4
end_us = 16
[grid]
generator = "straight_tube"
nodes = [13, 13, 17]
diameter_um = 10
length_um = 24
[fluid]
convection = false
[[boundary]]
side = "k_min"
type = "velocity_inlet"
velocity_mm_per_s = 1
profile = "parabolic"
[[boundary]]
side = "k_max"
type = "outflow"
[[boundary]]
side = "i_min"
type = "wall"
[[boundary]]
side = "i_max"
type = "wall"
[[boundary]]
side = "j_min"
type = "wall"
[[boundary]]
side = "j_max"
type = "wall"
[[bodies]]
shape = "sphere"
radius_um = 3.5
center_um = [0, 0, 0]
)";

}  // namespace

TEST_CASE("bad figures become warnings with their key, good ones do not") {
  const nlohmann::json bad = {{"slip", 0.26},      {"energy_balance", 0.4},   {"flux_correction", 1.0},
                              {"splitting", 0.01}, {"max_divergence", 7e-11}, {"coupling_residual", nullptr}};
  const auto warnings = judge(bad, moving);
  CHECK(figures_of(warnings) == Words{"flux_correction", "splitting", "slip", "energy_balance"});
  CHECK(warnings[1]["key"] == "time.step_us");
  CHECK(warnings[1]["value"] == 0.01);
  CHECK_THAT(warnings[2]["message"].get<std::string>(), Contains("slip = 0.26, more than 0.15") && Contains("grid.nodes"));
  // The tube with a cell at 400 us, and the poorest of the good runs of a held sphere.
  const nlohmann::json good = {{"area_drift", 0.0064},
                               {"coupling_residual", 0.03},
                               {"energy_balance", 0.012},
                               {"energy_balance_coupling", 0.003},
                               {"flux_correction", 0.0022},
                               {"max_divergence", 7.2e-11},
                               {"slip", 0.11},
                               {"splitting", 4e-4},
                               {"volume_drift", 1.2e-6},
                               {"least_wall_spacings", 3.1},
                               {"traction_fallbacks", 0.0}};
  CHECK(judge(good, moving).empty());
  CHECK(figures_of(judge({{"least_body_spacings", 1.2}}, moving)) == Words{"least_body_spacings"});
  CHECK(figures_of(judge({{"slip", std::nan("")}}, moving)) == Words{"slip"});
}

TEST_CASE("slip is judged over the run, not by the first steps of a sudden start") {
  RunTotals totals;
  totals.add({1, 0, 4e-4, 1e-3});  // the fluid has not yet followed
  for (int n = 1; n < 40; ++n) totals.add({1.0 + n, 0, 5e-5, 1e-3});
  CHECK(totals.slip() == Approx((4e-4 + 39 * 5e-5) / 40 / 1e-3));
  CHECK(judge({{"slip", totals.slip()}}, moving).empty());
  CHECK(totals.slip_speed == 4e-4);
  // A pause is none of the flow: what slips while it lasts is judged by the flow that there is.
  totals.add({1000, 0, 1e-12, 1e-9});
  CHECK(totals.slip() > 0.05);
  totals.add({1001, 0, std::nan(""), 1e-3});
  CHECK(figures_of(judge({{"slip", totals.slip()}}, moving)) == Words{"slip"});
  // Totals of before there was a mean are read, and count from there on.
  auto old = nlohmann::json::parse(to_text(RunTotals()));
  old.erase("slip_um"), old.erase("way_um");
  CHECK(totals_from(old.dump()).slip() == 0);
}

TEST_CASE("what membranes as forces leave of the energy is judged by their own good runs") {
  FigureScales forces = moving;
  forces.forces = true;
  const nlohmann::json errors = {{"energy_balance", 0.22}};
  CHECK(judge(errors, moving).empty());
  CHECK(figures_of(judge(errors, forces)) == Words{"energy_balance"});
  CHECK(figures_of(judge({{"energy_balance", 0.4}, {"energy_balance_coupling", 0.4}}, forces)) ==
        Words{"energy_balance", "energy_balance_coupling"});
  CHECK(judge({{"energy_balance", 0.02}}, forces).empty());
  // Only where there is contact is its range a remedy.
  for (const bool contact : {false, true}) {
    forces.contact = contact;
    const auto warnings = judge(errors, forces);
    REQUIRE(warnings.size() == 1);
    CHECK((warnings[0]["message"].get<std::string>().find("contact.range_um") != std::string::npos) == contact);
  }
}

TEST_CASE("a share of nothing is no warning") {
  const nlohmann::json still = {
      {"slip", 0.5}, {"energy_balance", 0.9}, {"flux_correction", 1.0}, {"splitting", 0.3}, {"convection_over_viscosity", 0.2}};
  CHECK(judge(still, {0, 0, false}).empty());
  CHECK(figures_of(judge(still, {0, 0, true})) == Words{"convection_over_viscosity"});
}

TEST_CASE("a held sphere on a grid too coarse for its gap warns, on the screen and in the report") {
  const auto folder = fresh_folder("warnings");
  std::ofstream(folder / "tight.toml") << tight_sphere;
  const auto outcome = succeed(folder, {"run", "tight.toml", "--out", "out", "--set", "output.fields=false"});
  const auto r = report(folder / "out");
  const auto names = figures_of(r["warnings"]);
  REQUIRE(std::count(names.begin(), names.end(), "slip") == 1);
  REQUIRE(std::count(names.begin(), names.end(), "least_wall_spacings") == 1);
  for (const auto& w : r["warnings"]) {
    const std::string message = w["message"];
    INFO(message);
    CHECK_THAT(message, Contains(w["key"].get<std::string>()));
    std::string screen = outcome.output;
    CHECK_THAT(screen, Contains(message));
    screen.erase(0, screen.find(message) + 1);
    CHECK_THAT(screen, !Contains(message));  // once
  }
  // The force is the momentum balance's, with that of the tractions beside it.
  const auto h = history(folder / "out");
  const auto last = h.lines.size() - 1;
  CHECK(r["quantities"]["body_0_force_z_nN"] == Approx(h.number(last, "balance_force_z_nN")));
  CHECK(r["quantities"]["body_0_traction_force_z_nN"] == Approx(h.number(last, "force_z_nN")));
}

TEST_CASE("a coarse tube with a cell has nothing to warn of but its coarseness") {
  const auto folder = fresh_folder("no_warnings");
  succeed(folder, coarse_tube("out", {"time.end_us=30"}));
  for (const auto& w : report(folder / "out")["warnings"]) {
    INFO(w["message"].get<std::string>());
    CHECK(w["key"] == "grid.nodes");
  }
}

TEST_CASE("the sheet of a capsule may grow where a red cell would burst") {
  const auto folder = fresh_folder("capsule");
  // Soft and fast: 10 % more area is left behind at 190 us, at 230 us it folds.
  auto text = contents(scene("straight_tube"));
  const auto at = text.find("[[cells]]");
  REQUIRE(at != std::string::npos);
  text.replace(at, text.find("\n\n", at) - at,
               "[[cells]]\nshape = \"sphere\"\nradius_um = 3\nvertices = 200\nlaw = \"neo-hookean\"\nshear_modulus_uN_per_m = 0.2\n"
               "center_um = [0, 0, 0]");
  std::ofstream(folder / "capsule.toml") << text;
  succeed(folder,
          with({"run", "capsule.toml", "--out", "out"}, {"grid.nodes=[17,17,25]", "boundary.0.velocity_mm_per_s=10", "time.step_us=1",
                                                         "time.end_us=210", "output.every_us=210", "output.fields=false"}));
  const auto found = history(folder / "out");
  CHECK(found.number(found.lines.size() - 1, "area_um2") > 1.12 * found.number(0, "area_um2"));
  CHECK(found.number(found.lines.size() - 1, "volume_um3") == Approx(found.number(0, "volume_um3")).epsilon(1e-4));
  CHECK(report(folder / "out")["errors"]["area_drift"].is_null());
}

TEST_CASE("a cell that is alone but near its own image is warned of as two cells are") {
  const auto folder = fresh_folder("own_image");
  const auto scene_of = [&](double side) {
    std::ofstream out(folder / "alone.toml");
    out << "[time]\nstep_us = 10\nend_us = 10\n[grid]\ngenerator = \"box\"\nnodes = [17, 17, 17]\n[fluid]\nconvection = false\n"
        << "[[cells]]\ncenter_um = [0, 0, 0]\nvertices = 300\n[coupling]\nscheme = \"force\"\n";
    for (const char* name : {"i_min", "i_max", "j_min", "j_max", "k_min", "k_max"})
      out << "[[boundary]]\nside = \"" << name << "\"\ntype = \"periodic\"\n";
    out.close();
    const std::string half = std::to_string(side / 2);
    return start(folder, with({"check", "alone.toml"}, {"grid.lower_um=[-" + half + ",-" + half + ",-" + half + "]",
                                                        "grid.upper_um=[" + half + "," + half + "," + half + "]"}))
        .output;
  };
  CHECK_THAT(scene_of(8.2), Contains("cells.0 is 0.41") && Contains("um from its own image") && Contains("add [contact]"));
  CHECK_THAT(scene_of(12), !Contains("own image"));
  CHECK_THAT(start(folder, with({"check", "alone.toml"},
                                {"grid.lower_um=[-6,-6,-6]", "grid.upper_um=[6,6,6]", "output.fields=[\"wall_shear_stress\"]"}))
                 .output,
             Contains("output.fields") && Contains("no side is a wall"));
}

TEST_CASE("membrane viscosity that drives instead of resisting is told") {
  const auto folder = fresh_folder("driven");
  // Two cells that start deep in their aggregation.
  succeed(folder,
          with({"run", scene("two_cells"), "--out", "out"},
               {"grid.nodes=[17,17,17]", "cell_types.0.vertices=300", "cell_types.0.membrane_viscosity_N_s_per_m=5e-7", "time.step_us=2.5",
                "time.first_step_us=2.5", "time.end_us=100", "output.every_us=0", "contact.aggregation_energy_fJ_per_um2=1e-3",
                "cells.0.center_um=[0.1,0.2,-1.35]", "cells.1.center_um=[0.1,0.2,1.35]"}));
  const auto driven = report(folder / "out");
  CHECK(driven["errors"]["membrane_drive"] > 0.1);
  const auto names = figures_of(driven["warnings"]);
  CHECK(std::count(names.begin(), names.end(), "membrane_drive") == 1);
}

TEST_CASE("what a grid does not resolve of two fluids, a gap that growing cells do not keep, and samples that no run has are told") {
  const auto folder = fresh_folder("told_at_start");
  const auto checked = [&](const std::string& name, const std::vector<std::string>& settings) {
    return start(folder, with({"check", scene(name)}, settings)).output;
  };
  const std::vector<std::string> coarse = {"grid.nodes=[17,17,17]", "cells.0.vertices=300"};
  const auto capsule = [&](const std::string& ratio) {
    return checked("capsule_shear", {coarse[0], coarse[1], "cells.0.viscosity_ratio=" + ratio});
  };
  CHECK_THAT(capsule("0.3"), Contains("viscosity_ratio = 0.3") && Contains("a third as viscous"));
  CHECK_THAT(capsule("11"), Contains("viscosity_ratio = 11") && Contains("more than ten times"));
  CHECK_THAT(capsule("5"), !Contains("resist the flow too much"));
  const std::vector<std::string> file = {"grid.nodes=[15,15,33]", "grid.length_um=14", "cell_types.0.vertices=300"};
  const auto single = [&](const std::string& more) { return checked("single_file", {file[0], file[1], file[2], more}); };
  CHECK_THAT(single("populations.0.gap_um=1"), Contains("gap_um = 1 is asked for") && Contains("keep what contact leaves them"));
  CHECK_THAT(single("blood.sample_every_us=1e9"), Contains("blood.sample_every_us") && Contains("no sample, of those"));
}
