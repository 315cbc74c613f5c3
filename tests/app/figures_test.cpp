// Figures and warnings say what is so, whatever a run stores, and are left out where there is nothing to say.
#include <cmath>

#include "app/figure_levels.hpp"
#include "membrane/stretching.hpp"
#include "program.hpp"

using namespace app;
using Catch::Contains;

namespace {

/// The tube without bodies on a few nodes.
Words plain_tube(const std::string& out, const Words& overrides) {
  Words settings{"grid.nodes=[7,7,17]", "time.step_us=4", "time.end_us=40", "output.fields=false"};
  settings.insert(settings.end(), overrides.begin(), overrides.end());
  return with({"run", scene("tube_flow"), "--out", out}, settings);
}

bool has(const nlohmann::json& figures, const std::string& name) { return figures.contains(name) && !figures[name].is_null(); }

}  // namespace

TEST_CASE("what a run stores changes none of its figures and warnings") {
  const auto folder = fresh_folder("stores");
  const Words scene{"time.end_us=24", "time.step_us=2", "time.first_step_us=0", "output.fields=false", "output.history_every_us=0"};
  const auto run = [&](const char* every) {
    auto words = scene;
    words.push_back(std::string("output.every_us=") + every);
    succeed(folder, coarse_tube("out", words));
    return report(folder / "out");
  };
  const auto little = run("0"), much = run("2");
  CHECK(little["errors"] == much["errors"]);
  CHECK(little["warnings"] == much["warnings"]);
  // Seen at the start, where the pressure lags behind the flow most.
  CHECK(little["errors"]["splitting_max"] > 2 * little["errors"]["splitting"].get<double>());
  CHECK(has(little["errors"], "slip_max"));
}

TEST_CASE("the errors against Poiseuille's flow are those of a flow that is one") {
  const auto folder = fresh_folder("references");
  const auto errors = [&](const Words& overrides) {
    succeed(folder, plain_tube("out", overrides));
    return report(folder / "out")["errors"];
  };
  const auto good = errors({});
  CHECK(has(good, "poiseuille_velocity"));
  CHECK(has(good, "poiseuille_gradient"));
  const auto few = errors({"grid.nodes=[7,7,6]"});
  CHECK(has(few, "poiseuille_velocity"));
  CHECK_FALSE(has(few, "poiseuille_gradient"));
  for (const char* changed : {"boundary.0.velocity_mm_per_s=0", "boundary.0.velocity_mm_per_s=-1", "boundary.0.ramp_us=100"}) {
    INFO(changed);
    const auto none = errors({changed});
    CHECK_FALSE(has(none, "poiseuille_velocity"));
    CHECK_FALSE(has(none, "poiseuille_gradient"));
  }
  // A table that has come to its last value is known again.
  CHECK(has(errors({"boundary.0.ramp_us=0", "boundary.0.time_table=[[0,0],[20,0.5]]"}), "poiseuille_velocity"));
  // A flow that only slides along the inlet has no driving pressure.
  errors({"boundary.0.velocity_mm_per_s=[2,0,0]", "boundary.0.profile=uniform"});
  CHECK_FALSE(has(report(folder / "out")["quantities"], "driving_pressure_Pa"));
}

TEST_CASE("Couette's flow is compared once its wall's speed is constant") {
  const auto folder = fresh_folder("couette");
  const auto text = contents(scene("couette"));
  const auto at = text.find("type = \"moving_wall\"");
  REQUIRE(at != std::string::npos);
  const auto with_table = [&](const std::string& table) {
    auto changed = text;
    changed.insert(at, "time_table = " + table + "\n");
    std::ofstream(folder / "couette.toml") << changed;
    succeed(folder, with({"run", "couette.toml", "--out", "out"},
                         {"grid.nodes=[5,9,5]", "time.step_us=10", "time.end_us=200", "output.fields=false"}));
    return report(folder / "out")["errors"];
  };
  CHECK_FALSE(has(with_table("[[0, 1], [400, 3]]"), "couette_velocity"));
  CHECK(with_table("[[0, 1], [50, 0.5]]")["couette_velocity"] < 0.02);
}

TEST_CASE("a stretching test is judged by what it is") {
  using namespace corpuscle;
  FigureScales stretching;
  stretching.stretching = true;
  const auto names = [&](const nlohmann::json& errors) {
    Words all;
    for (const auto& w : judge(errors, stretching)) all.push_back(w["key"]);
    return all;
  };
  CHECK(names({{"volume_drift", 0.684}}) == Words{"cells.0.volume_modulus_Pa"});
  CHECK(names({{"volume_drift", 0.006}, {"experiment_points", 13}, {"experiment_interpolation_um", 0.05}}).empty());
  CHECK(names({{"experiment_points", 0}}) == Words{"stretching.force_pN"});
  CHECK(names({{"experiment_interpolation_um", 2.0}}) == Words{"stretching.steps"});

  const auto folder = fresh_folder("stretching");
  const auto run = [&](const Words& overrides) {
    auto words =
        with({"run", scene("stretch"), "--out", "out"}, {"cells.0.vertices=200", "stretching.tolerance=0.01", "output.cells=false"});
    succeed(folder, with(words, overrides));
    return report(folder / "out");
  };
  std::ofstream(folder / "strong.csv") << "force_pN,transverse_um,axial_um,transverse_lo_um,transverse_hi_um,axial_lo_um,axial_hi_um\n"
                                          "90,6,10,5,7,9,11\n";
  const auto weak = run({"stretching.force_pN=5", "stretching.steps=2", "stretching.experiment=" + (folder / "strong.csv").string()});
  CHECK(weak["errors"]["experiment_points"] == 0);
  CHECK_FALSE(has(weak["errors"], "experiment_axial_rms_um"));
  CHECK(weak["warnings"].size() == 1);
  const auto one = run({"stretching.steps=1", "stretching.force_pN=100"});
  CHECK(has(one["errors"], "experiment_axial_rms_um"));
  REQUIRE(one["warnings"].size() == 1);
  CHECK(one["warnings"][0]["key"] == "stretching.steps");
}

TEST_CASE("a Robin coefficient far above its default is said") {
  const auto folder = fresh_folder("robin");
  const auto check = [&](const char* value) {
    return succeed(folder, with({"check", scene("straight_tube")},
                                {"grid.nodes=[17,17,25]", std::string("coupling.robin_coefficient_pg_per_um2_per_us=") + value}))
        .output;
  };
  CHECK_THAT(check("200"), Contains("warning: coupling.robin_coefficient_pg_per_um2_per_us = 200 is") && Contains("times its default"));
  CHECK_THAT(check("6"), !Contains("times its default"));
  CHECK_THAT(corpuscle::judge({{"coupling_residual", 0.9}}, {1e-3, 1, false})[0]["message"].get<std::string>(),
             Contains("coupling.robin_coefficient_pg_per_um2_per_us"));
}

TEST_CASE("a cell in a flow that comes to rest is measured along one axis") {
  // What drift is left is none to go by, however slow the flow has become: its length was 2.9, 6.3 and 2.9 um in turn.
  const auto folder = fresh_folder("one_axis");
  succeed(folder, with({"run", scene("relax"), "--out", "out"},
                       {"grid.nodes=[17,17,17]", "cells.0.vertices=250", "cells.0.start_stretch=[1.5,0.7,1]",
                        "cells.0.membrane_viscosity_N_s_per_m=0", "time.step_us=50", "time.end_us=4500", "output.every_us=0",
                        "output.history_every_us=250"}));
  const auto samples = history(folder / "out");
  REQUIRE(samples.lines.size() > 15);
  for (std::size_t n = 1; n < samples.lines.size(); ++n)
    CHECK(std::abs(samples.number(n, "length_um") - samples.number(n - 1, "length_um")) < 0.5);  // 0.1 at most, and 3.4 across
}

TEST_CASE("a cell is at the outflow when it is, whatever the speed that shear modulus over viscosity is") {
  const auto folder = fresh_folder("outflow");
  const auto outcome = start(folder, coarse_tube("out", {"time.end_us=3", "fluid.kinematic_viscosity_um2_per_us=1e-9"}));
  INFO(outcome.output);
  CHECK(outcome.code == 0);
  CHECK(report(folder / "out")["errors"]["slip"] > 1e-3);  // a share of the flow's speed, not of that one
  fail(folder, coarse_tube("out", {"time.end_us=40", "time.stop_before_outflow_um=21.2"}), 5,
       {"the limit is", "time.stop_before_outflow_um"});
}

TEST_CASE("figures of a flow at rest are not shares of round-off") {
  const auto folder = fresh_folder("still");
  succeed(folder, coarse_tube("out", {"time.end_us=3", "boundary.0.velocity_mm_per_s=0"}));
  const auto still = report(folder / "out");
  CHECK(still["errors"]["slip"] < 1e-3);  // of what counts as rest
  CHECK(still["errors"]["coupling_residual"] < 1e-3);
}

TEST_CASE("cells too near to an inlet or a symmetry side are refused at the start") {
  const auto folder = fresh_folder("near_sides");
  const auto tube = [&](const char* center) {
    return with({"check", scene("straight_tube")},
                {"grid.nodes=[17,17,25]", "grid.length_um=20", std::string("cells.0.center_um=") + center});
  };
  fail(folder, tube("[0,0,-8.4]"), 2, {"gap to a side", "cells.0", "an inlet (k_min)", "are needed", "center_um"});
  succeed(folder, tube("[0,0,0]"));
  const auto uniform = [&](const char* center) {
    return with({"check", scene("uniform_flow")}, {"grid.nodes=[17,17,49]", std::string("cells.0.center_um=") + center});
  };
  fail(folder, uniform("[1.09,0,0]"), 2, {"gap to a side", "a symmetry side (i_max)", "center_um"});
  succeed(folder, uniform("[0,0,0]"));
}

TEST_CASE("the time that is foreseen counts surfaces and their sub-steps") {
  const auto folder = fresh_folder("foreseen");
  const auto seconds = [&](const char* vertices) {
    const auto said =
        succeed(folder, with({"check", scene("straight_tube")}, {"grid.nodes=[17,17,25]", std::string("cells.0.vertices=") + vertices}))
            .output;
    const auto at = said.find(" steps, about ");
    REQUIRE(at != std::string::npos);
    return std::stod(said.substr(at + 14));
  };
  // Eight times the vertices take eight times as many sub-steps: a small part of the time becomes most of it.
  CHECK(seconds("4000") > 3 * seconds("500"));
}

TEST_CASE("the worst figure is the one nearest to where it is bad, or furthest beyond") {
  using corpuscle::worst_figure;
  corpuscle::FigureScales scales;
  scales.speed_um_per_us = 1, scales.energy_fJ = 1, scales.forces = true;
  CHECK(worst_figure({}, scales).empty());
  CHECK_THAT(worst_figure({{"volume_drift", 5e-5}, {"area_drift", 0.01}, {"energy_balance", 0.02}}, scales),
             Contains("volume_drift 5e-05 of 0.0001"));
  CHECK_THAT(worst_figure({{"volume_drift", 5e-5}, {"area_drift", 0.08}, {"energy_balance", 0.02}}, scales), Contains("area_drift 0.08"));
  CHECK_THAT(worst_figure({{"least_wall_spacings", 1.0}, {"volume_drift", 1e-4}}, scales), Contains("least_wall_spacings 1 of 2"));
  CHECK_THAT(worst_figure({{"volume_drift", 0.0}, {"crossings", 1}}, scales), Contains("crossings"));
  CHECK_THAT(worst_figure({{"volume_drift", std::nan("")}, {"area_drift", 0.08}}, scales), Contains("volume_drift"));
  CHECK_THAT(worst_figure({{"volume_drift", 0.0}, {"crossings", 0}}, scales), Contains("0"));
}
