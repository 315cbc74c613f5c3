// A module that a case does not ask for launches nothing and allocates nothing, no step allocates after the first ones,
// and everything that is launched or allocated has a label.
#include <catch2/catch.hpp>

#include <unistd.h>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "app/flow_output.hpp"
#include "app/modules.hpp"
#include "core/log.hpp"
#include "input/case.hpp"
#include "membrane/stretching.hpp"
#include "recorder.hpp"

using namespace corpuscle;
using needless::Recorder;

namespace {

/// Labels that belong to each module of list_modules(). A module without labels of its own is not listed: files
/// are written by the host.
const std::map<std::string, std::vector<std::string>> labels_of = {
    {"fluid", {"corpuscle::fluid::", "corpuscle::multigrid::", "corpuscle::grid::"}},
    {"convection", {"corpuscle::fluid::convection", "corpuscle::fluid::flux_old", "corpuscle::fluid::flux_extrapolated"}},
    {"immersed search", {"corpuscle::immersed::"}},
    {"rigid bodies", {"corpuscle::immersed::rigid_motion"}},
    {"membrane", {"corpuscle::membrane::"}},
    {"membrane viscosity", {"corpuscle::membrane::assemble_viscous", "corpuscle::membrane::viscous_solve"}},
    {"transfer of forces", {"corpuscle::transfer::"}},
    {"slip correction",
     {"corpuscle::transfer::add_slip", "corpuscle::transfer::limit_slip", "corpuscle::transfer::slip_power",
      "corpuscle::membrane::stiffening", "corpuscle::coupling::stiffening", "corpuscle::coupling::followed"}},
    {"sharp pressure", {"corpuscle::transfer::jump"}},
    {"viscosity ratio", {"corpuscle::transfer::inside", "corpuscle::fluid::excess"}},
    {"contact", {"corpuscle::contact::"}},
    {"blood statistics",
     {"corpuscle::blood::cell_flow", "corpuscle::blood::profile", "corpuscle::blood::core_edge", "corpuscle::blood::wall_force",
      "corpuscle::blood::find_bins", "corpuscle::blood::edge"}},
    {"packing", {"corpuscle::transfer::scale_forces"}},
    {"coupling",
     {"corpuscle::coupling::traction", "corpuscle::coupling::v_interface", "corpuscle::coupling::residual", "corpuscle::coupling::predict",
      "corpuscle::cells::measure_boxes"}},
    {"halo exchange between ranks", {"corpuscle::halo::pack", "corpuscle::halo::unpack", "corpuscle::halo::send"}},
    {"field output", {"corpuscle::output::gather"}},
};

struct Counts {
  std::map<std::string, int> kernels, allocations;
  int of(const std::string& prefix) const { return Recorder::matching(kernels, prefix) + Recorder::matching(allocations, prefix); }
};

void check_labels(const Counts& counts) {
  const auto labelled = [](const std::string& label) {
    // Kokkos and Kokkos Kernels name their own; an unnamed kernel is called by its type.
    // "[unlabeled]" is memory that Kokkos takes for its own threads; a view without a label has an empty one.
    for (const char* owner : {"corpuscle::", "Kokkos::", "KokkosBlas::", "[unlabeled]"})
      if (label.rfind(owner, 0) == 0) return true;
    return false;
  };
  for (const auto& [label, count] : counts.kernels) {
    INFO("kernel \"" << label << "\", " << count << " times");
    CHECK(labelled(label));
    CHECK(label.find("lambda") == std::string::npos);
  }
  for (const auto& [label, count] : counts.allocations) {
    INFO("view \"" << label << "\", " << count << " times");
    CHECK(labelled(label));
  }
}

void check_modules(const Case& scene, const Counts& counts) {
  const auto modules = list_modules(scene, 1);
  for (const auto& name : modules.left_out) {
    if (!labels_of.count(name)) continue;
    for (const auto& prefix : labels_of.at(name)) {
      INFO(name << " is left out, but \"" << prefix << "\" was launched or allocated");
      CHECK(counts.of(prefix) == 0);
    }
  }
  for (const auto& name : modules.active) {
    if (!labels_of.count(name)) continue;
    INFO(name << " is active, but none of its labels was seen: is the list in this test out of date?");
    int seen = 0;
    for (const auto& prefix : labels_of.at(name)) seen += counts.of(prefix);
    CHECK(seen > 0);
  }
}

std::string case_file(const std::string& name) { return CORPUSCLE_SOURCE_DIR "/cases/" + name + ".toml"; }

/// Set up and run a few steps with all output, then three more that must not allocate. @param second_cell_um  how far
/// ahead of the first a second cell is; 0: none
void check_flow(const std::string& name, std::vector<std::string> overrides, double second_cell_um = 0) {
  overrides.insert(overrides.end(),
                   {"time.step_us=1", "time.end_us=20", "output.every_us=2", "output.history_every_us=0", "output.checkpoint_every_us=0"});
  Case scene = read_case(case_file(name), overrides);
  if (second_cell_um > 0) {
    scene.cells.push_back(scene.cells[0]);
    scene.cells[1].center_um[2] += second_cell_um;
  }
  const auto folder = std::filesystem::temp_directory_path() / ("corpuscle_needless_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  Recorder recorder;
  recorder.start();
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  FlowOutput output({folder.string(), [] {}, [] {}, "", ""}, scene, simulation, timers, std::nullopt, std::chrono::steady_clock::now());
  output.after_step(true);
  for (int n = 0; n < 4; ++n) {
    simulation.step();
    output.after_step();
  }
  recorder.stop();
  const Counts all{Recorder::kernels(), Recorder::allocations()};
  recorder.start();
  for (int n = 0; n < 3; ++n) simulation.step();
  recorder.stop();
  const Counts steps{Recorder::kernels(), Recorder::allocations()};
  std::filesystem::remove_all(folder);

  INFO(name);
  check_labels(all);
  check_modules(scene, all);
  const bool periodic = std::any_of(scene.boundaries.begin(), scene.boundaries.end(),
                                    [](const BoundarySettings& side) { return side.type == BoundarySettings::Type::periodic; });
  const std::size_t bodies = scene.cells.size() + scene.bodies.size();
  const bool force = scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force;
  if (!force) CHECK((all.of("corpuscle::immersed::least_gap") > 0) == (bodies > 1 || (bodies == 1 && periodic)));
  CHECK(Recorder::matching(steps.kernels, "corpuscle::") > 0);
  for (const auto& [label, count] : steps.allocations) {
    INFO("view \"" << label << "\" was allocated " << count << " times in three steps");
    CHECK(count == 0);
  }
}

/// Kernels of the fourth step and bytes allocated up to then, of labels that begin with one of `prefixes`.
struct Price {
  int kernels = 0;
  double megabytes = 0;
};

Price price(const Case& scene, const std::vector<std::string>& prefixes) {
  Price price;
  Recorder recorder;
  recorder.start();
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  for (int n = 0; n < 3; ++n) simulation.step();
  recorder.stop();
  for (const auto& prefix : prefixes) price.megabytes += 1e-6 * Recorder::matching(Recorder::bytes(), prefix);
  recorder.start();
  simulation.step();
  recorder.stop();
  for (const auto& prefix : prefixes) price.kernels += Recorder::matching(Recorder::kernels(), prefix);
  return price;
}

Case small(const std::string& name, std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"grid.nodes=[17,17,25]", "time.step_us=1", "time.end_us=20"});
  return read_case(case_file(name), overrides);
}

/// A capsule that is a force, and nothing that a case can leave out.
Case bare_capsule(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"grid.nodes=[17,17,17]", "cells.0.vertices=162", "time.step_us=50", "time.end_us=1000"});
  return read_case(case_file("capsule_shear"), overrides);
}

}  // namespace

TEST_CASE("a step launches no more kernels than it needs", "[needless]") {
  // With all multigrid levels below 8192 cells in one launch, periodic halos in one, and one reduction for an iteration of the pressure's
  // solver. The bounds leave room for two or three iterations of it more (672 and 1428 launches before).
  const auto [name, overrides, step, launches, reductions] =
      GENERATE(std::tuple{"straight_tube", std::vector<std::string>{"time.step_us=4", "time.first_step_us=4"}, 20, 465, 38},
               std::tuple{"blood_tube", std::vector<std::string>{"time.step_us=10", "time.first_step_us=10"}, 4, 440, 50});
  std::vector<std::string> settings = overrides;
  settings.insert(settings.end(), {"time.end_us=1000", "output.history_every_us=0"});
  Timers timers(false);
  FlowSimulation simulation(Comm(), read_case(case_file(name), settings), timers);
  for (int n = 0; n < step; ++n) simulation.step();
  Recorder recorder;
  recorder.start();
  simulation.step();
  recorder.stop();
  INFO(name << ": " << Recorder::launches() << " launches, " << Recorder::reductions() << " reductions");
  if (std::getenv("CORPUSCLE_SHOW")) WARN(name << ": " << Recorder::launches() << " launches, " << Recorder::reductions() << " reductions");
  CHECK(Recorder::launches() <= launches);
  CHECK(Recorder::reductions() <= reductions);
  CHECK(Recorder::launches() > 50);
}

TEST_CASE("what is left out would have cost what the program says", "[needless]") {
  const auto check = [](const char* module, const std::vector<std::string>& labels, const Case& without, const Case& with) {
    const ModuleCost said = list_modules(without, 1).cost.at(module);
    const Price less = price(without, labels), more = price(with, labels);
    INFO(module << ": " << more.kernels - less.kernels << " kernels, " << more.megabytes - less.megabytes << " MB");
    CHECK(more.kernels - less.kernels == said.kernels);
    CHECK(more.megabytes - less.megabytes == Approx(said.megabytes).epsilon(0.01));
  };
  check("convection", {"corpuscle::fluid::convection", "corpuscle::fluid::extrapolate", "corpuscle::fluid::flux_"},
        small("tube_flow", {"fluid.convection=false"}), small("tube_flow", {}));
  check("membrane viscosity", {"corpuscle::membrane::"}, small("straight_tube", {"cells.0.membrane_viscosity_N_s_per_m=0"}),
        small("straight_tube", {}));

  check("slip correction",
        {"corpuscle::transfer::add_slip", "corpuscle::transfer::limit_slip", "corpuscle::membrane::stiffening",
         "corpuscle::coupling::stiffening", "corpuscle::coupling::followed"},
        bare_capsule({"coupling.slip=false"}), bare_capsule({"coupling.slip=true"}));

  Case sphere = small("tube_flow", {});
  sphere.bodies.emplace_back();
  sphere.bodies[0].radius_um = 2;
  sphere.bodies[0].velocity_um_per_us = {0, 0, 1e-3};
  sphere.fluid->repeat_projection = false;  // one projection a step, as the figure has it
  const Case tube = small("tube_flow", {});
  const ModuleCost least = list_modules(tube, 1).cost.at("immersed search");
  const Price search = price(sphere, {"corpuscle::immersed::"});
  const int repeated = Recorder::matching(Recorder::kernels(), "corpuscle::immersed::apply_velocity_rows");
  INFO("a sphere: " << search.kernels - repeated << " kernels, " << search.megabytes << " MB");
  CHECK(search.kernels - repeated >= least.kernels);
  CHECK(search.kernels - repeated < 1.3 * least.kernels);
  CHECK(search.megabytes >= least.megabytes);
  CHECK(search.megabytes < 2 * least.megabytes);
}

TEST_CASE("flows launch and allocate what they ask for, nothing else, and nothing new in a step", "[needless]") {
  const std::string tube = "grid.nodes=[17,17,25]";
  SECTION("tube flow") { check_flow("tube_flow", {tube}); }
  SECTION("tube flow without convection and fields") { check_flow("tube_flow", {tube, "fluid.convection=false", "output.fields=false"}); }
  SECTION("tube flow on a skewed grid") { check_flow("tube_flow", {tube, "grid.cross_section=elliptical"}); }
  SECTION("Couette flow") { check_flow("couette", {}); }
  SECTION("uniform flow") { check_flow("uniform_flow", {"grid.nodes=[17,17,25]"}); }
  SECTION("straight tube") { check_flow("straight_tube", {tube}); }
  SECTION("straight tube, membranes as forces") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0"});
  }
  SECTION("straight tube, viscous membranes as forces without slip") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "coupling.slip=false", "cells.0.membrane_viscosity_N_s_per_m=5e-7"});
  }
  SECTION("straight tube, membranes as forces, least of everything") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "coupling.slip=false", "fluid.convection=false",
                                 "cells.0.membrane_viscosity_N_s_per_m=0", "output.fields=false", "output.cells=false"});
  }
  SECTION("straight tube, membranes as forces, and cytosol") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "cells.0.viscosity_ratio=5"});
  }
  SECTION("straight tube, membranes as forces, and a pressure that jumps") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "coupling.pressure=sharp"});
  }
  SECTION("straight tube, membranes as forces that touch") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "contact.range_um=0.25"}, 3);
  }
  SECTION("straight tube, blood measured") {
    check_flow("straight_tube", {tube, "coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "blood.sample_every_us=1"});
  }
  SECTION("straight tube with two cells") { check_flow("straight_tube", {tube}, 10); }
  SECTION("straight tube, least of everything") {
    check_flow("straight_tube",
               {tube, "fluid.convection=false", "cells.0.membrane_viscosity_N_s_per_m=0", "output.fields=false", "output.cells=false"});
  }
  SECTION("straight tube, iterated coupling") {
    check_flow("straight_tube", {tube, "coupling.scheme=iterated", "coupling.tolerance=0.01"});
  }
  SECTION("cells as forces past a ball") { check_flow("obstacle", {"grid.nodes=[33,15,17]", "cell_types.0.vertices=300"}); }
  SECTION("curved tube") { check_flow("curved_tube", {"grid.nodes=[17,17,31]"}); }
}

namespace {

/// Kernels of three steps after the first four and bytes allocated in all of them, by label.
Counts counts_of(const Case& scene) {
  Recorder recorder;
  recorder.start();
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  for (int n = 0; n < 4; ++n) simulation.step();
  recorder.stop();
  const auto bytes = Recorder::bytes();
  recorder.start();
  for (int n = 0; n < 3; ++n) simulation.step();
  recorder.stop();
  return {Recorder::kernels(), bytes};
}

std::set<std::string> names_with(const std::map<std::string, int>& counts, const std::string& prefix) {
  std::set<std::string> names;
  for (const auto& [label, count] : counts)
    if (label.rfind(prefix, 0) == 0) names.insert(label);
  return names;
}

}  // namespace

TEST_CASE("what membranes as forces can do costs nothing where a scene does not ask for it", "[needless]") {
  const Case bare = bare_capsule({"coupling.slip=false"});
  const Counts least = counts_of(bare);
  for (const char* prefix : {"corpuscle::contact::", "corpuscle::blood::", "corpuscle::immersed::", "corpuscle::transfer::inside",
                             "corpuscle::transfer::add_slip", "corpuscle::transfer::limit_slip", "corpuscle::coupling::load",
                             "corpuscle::membrane::stiffening", "corpuscle::membrane::viscous", "corpuscle::fluid::excess"}) {
    INFO(prefix);
    CHECK(least.of(prefix) == 0);
  }

  SECTION("the fluid of one viscosity is that of a flow without cells") {
    Case empty = bare;
    empty.cells.clear();
    empty.coupling.reset();
    const Counts alone = counts_of(empty), tube = counts_of(small("tube_flow", {"fluid.convection=false"}));  // one that needs a projection
    for (const char* prefix : {"corpuscle::transfer::", "corpuscle::cells::", "corpuscle::membrane::", "corpuscle::coupling::",
                               "corpuscle::contact::", "corpuscle::blood::", "corpuscle::immersed::"}) {
      INFO(prefix);
      CHECK(alone.of(prefix) == 0);
    }
    for (const char* prefix : {"corpuscle::fluid::", "corpuscle::multigrid::"}) {
      std::set<std::string> known = names_with(alone.kernels, prefix);
      known.merge(names_with(tube.kernels, prefix));
      for (const auto& name : names_with(least.kernels, prefix)) {
        INFO(name);
        CHECK(known.count(name) == 1);
      }
      CHECK(Recorder::matching(least.allocations, prefix) == Recorder::matching(alone.allocations, prefix));
    }
  }
  SECTION("keys at the values that they have without being given") {
    const Counts given =
        counts_of(bare_capsule({"coupling.slip=false", "cells.0.viscosity_ratio=1", "cells.0.membrane_viscosity_N_s_per_m=0",
                                "cells.0.push_nN=[0,0,0]", "cells.0.start_stretch=[1,1,1]"}));
    CHECK(given.kernels == least.kernels);
    CHECK(given.allocations == least.allocations);
  }
  SECTION("a viscosity ratio brings its field and what fills it, and no more of the rest") {
    const Counts more = counts_of(bare_capsule({"coupling.slip=false", "cells.0.viscosity_ratio=5"}));
    CHECK(Recorder::matching(more.allocations, "corpuscle::transfer::inside") > 0);
    for (const char* prefix : {"corpuscle::membrane::", "corpuscle::coupling::", "corpuscle::contact::", "corpuscle::cells::"}) {
      INFO(prefix);
      CHECK(names_with(more.kernels, prefix) == names_with(least.kernels, prefix));
      CHECK(Recorder::matching(more.allocations, prefix) == Recorder::matching(least.allocations, prefix));
    }
  }
  SECTION("contact brings its lists, and no more of the rest") {
    const Counts more = counts_of(bare_capsule({"coupling.slip=false", "contact.range_um=0.25"}));
    CHECK(more.of("corpuscle::contact::") > 0);
    for (const char* prefix : {"corpuscle::membrane::", "corpuscle::fluid::", "corpuscle::multigrid::"}) {
      INFO(prefix);
      CHECK(Recorder::matching(more.allocations, prefix) == Recorder::matching(least.allocations, prefix));
    }
    CHECK(names_with(more.kernels, "corpuscle::fluid::") == names_with(least.kernels, "corpuscle::fluid::"));
  }
}

TEST_CASE("a run says of every cell, packed ones as well, what it has active and left out", "[needless]") {
  const auto is_active = [](const Case& scene, const std::string& module) {
    const auto list = list_modules(scene, 1);
    const auto has = [&](const std::vector<std::string>& names) { return std::count(names.begin(), names.end(), module) == 1; };
    CHECK(has(list.active) != has(list.left_out));
    return has(list.active);
  };
  Case blood = read_case(case_file("blood_shear"), {"coupling.slip=false"});
  for (const char* module : {"slip correction", "viscosity ratio", "membrane viscosity", "blood statistics"}) {
    INFO(module);
    CHECK_FALSE(is_active(blood, module));
  }
  for (const char* module : {"contact", "packing", "transfer of forces"}) {
    INFO(module);
    CHECK(is_active(blood, module));
  }
  blood.cell_types.at(0).cell.viscosity_ratio = 5;
  blood.cell_types.at(0).cell.membrane_viscosity_N_s_per_m = 5e-7;
  blood.coupling->slip = true;
  for (const char* module : {"slip correction", "viscosity ratio", "membrane viscosity"}) {
    INFO(module);
    CHECK(is_active(blood, module));
  }
  const Case flow = read_case(case_file("couette"), {});
  for (const char* module :
       {"transfer of forces", "slip correction", "viscosity ratio", "contact", "membrane", "coupling", "blood statistics"}) {
    INFO(module);
    CHECK_FALSE(is_active(flow, module));
  }
}

TEST_CASE("a sample of blood allocates nothing, and steps between samples launch nothing for it", "[needless]") {
  const Case scene = small("straight_tube", {"coupling.scheme=force", "cells.0.membrane_viscosity_N_s_per_m=0", "output.fields=false",
                                             "output.cells=false", "output.history_every_us=1000", "blood.sample_every_us=4"});
  const auto folder = std::filesystem::temp_directory_path() / ("corpuscle_needless_blood_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  FlowOutput output({folder.string(), [] {}, [] {}, "", ""}, scene, simulation, timers, std::nullopt, std::chrono::steady_clock::now());
  std::vector<int> launches;
  Recorder recorder;
  for (int n = 1; n <= 12; ++n) {
    simulation.step();
    recorder.start();
    output.after_step();
    recorder.stop();
    // Cells' shapes are measured with the energies, at every eighth step.
    launches.push_back(Recorder::matching(Recorder::kernels(), "corpuscle::blood::") -
                       Recorder::matching(Recorder::kernels(), "corpuscle::blood::measure_shapes"));
    INFO("step " << n);
    if (n > 4) CHECK(Recorder::matching(Recorder::allocations(), "corpuscle::blood::") == 0);
  }
  std::filesystem::remove_all(folder);
  CHECK(launches == std::vector<int>{0, 0, 0, launches[3], 0, 0, 0, launches[3], 0, 0, 0, launches[3]});
  CHECK(launches[3] > 0);
}

TEST_CASE("the laws of a scene's cells cost one launch each, and nothing where there is one", "[needless]") {
  using Law = CellSettings::Law;
  struct Launches {
    int forces, measures, cell_lists;
  };
  const auto launches = [](const std::vector<Law>& laws) {
    std::vector<CellSettings> cells(laws.size());
    for (std::size_t c = 0; c < laws.size(); ++c) {
      cells[c].vertices = 200;
      cells[c].law = laws[c];
      cells[c].center_um = {9.0 * static_cast<double>(c), 0, 0};
      cells[c].shear_modulus_uN_per_m = 5 + static_cast<double>(c);  // a type each
    }
    Recorder recorder;
    recorder.start();
    Membranes membranes(cells);
    membranes.compute_forces();
    recorder.stop();
    return Launches{Recorder::matching(Recorder::kernels(), "corpuscle::membrane::triangle_forces"),
                    Recorder::matching(Recorder::kernels(), "corpuscle::membrane::measure"),
                    Recorder::matching(Recorder::allocations(), "corpuscle::membrane::cells_law")};
  };
  for (Law law : {Law::wlc_pow, Law::neo_hookean, Law::skalak}) {
    const auto one = launches({law, law});
    CHECK(one.forces == 1);
    CHECK(one.measures == 1);
    CHECK(one.cell_lists == 0);
  }
  const auto two = launches({Law::wlc_pow, Law::skalak, Law::wlc_pow});
  CHECK(two.forces == 2);
  CHECK(two.measures == 1);
  CHECK(two.cell_lists == 2);
}

TEST_CASE("stretching has no grid, no search and no coupling", "[needless]") {
  const Case scene = read_case(case_file("stretch"), {"stretching.steps=1"});
  Recorder recorder;
  recorder.start();
  {
    Membranes membranes(scene.cells);
    stretch_cell(membranes, *scene.stretching);
  }
  recorder.stop();
  const Counts counts{Recorder::kernels(), Recorder::allocations()};
  check_labels(counts);
  check_modules(scene, counts);
  for (const char* prefix :
       {"corpuscle::fluid::", "corpuscle::multigrid::", "corpuscle::grid::", "corpuscle::halo::", "corpuscle::coupling::"}) {
    INFO(prefix);
    CHECK(counts.of(prefix) == 0);
  }
}
