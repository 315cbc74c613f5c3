// What a restart takes from a checkpoint, and what it does where the checkpoint has none.
#include <catch2/catch.hpp>

#include "coupling/restart.hpp"
#include "scenes.hpp"

#include <fmt/format.h>

#include <functional>

namespace corpuscle {
namespace {

using Scheme = CouplingSettings::Scheme;

Case tube(double end_us) { return scenes::tube_with_cell(17, 25, 100, Scheme::robin, end_us); }

Case tube_with_sphere() {
  Case scene = tube(8);
  scene.cells.clear();
  scene.coupling.reset();
  scene.bodies = {scenes::sphere(2)};
  scene.bodies[0].velocity_um_per_us = {0, 0, 1e-2};
  return scene;
}

struct Run {
  explicit Run(const Case& scene) : simulation(Comm(), scene, timers) {}
  Timers timers;
  FlowSimulation simulation;
};

}  // namespace

TEST_CASE("a run goes on from its start, and from a step of half the length at least", "[coupling][restart]") {
  Run run(tube(8));
  run.simulation.resume({0, 0, 0});  // a checkpoint written before the first step
  CHECK(run.simulation.time() == 0);
  CHECK_THROWS_WITH(run.simulation.resume({4, 0.4, 4}), Catch::Contains("at most double"));
  run.simulation.resume({4, 0.5, 4});
  CHECK(run.simulation.time() == 4);
}

#ifdef CORPUSCLE_HDF5

namespace {

/// A run to `until` and its checkpoint, taken up by a run of another case.
void take_up(const Case& before, double until, const std::string& resolved_before, Run& after, const std::string& resolved_after,
             const std::function<void(FlowSimulation&)>& compare = {}) {
  const scenes::SharedFile file("restart");
  Run run(before);
  while (run.simulation.time() < until) run.simulation.step();
  CheckpointTexts texts;
  texts.resolved = resolved_before;
  texts.totals = "{}";
  write_checkpoint(file.path(), run.simulation, texts);
  read_checkpoint(file.path(), after.simulation, resolved_after, "");
  if (compare) compare(run.simulation);
}

const std::string plain = "title = \"a\"\n";

}  // namespace

TEST_CASE("convection begins at a restart with the fluxes that the flow has", "[coupling][restart][ranks]") {
  Case without = tube(8), with = tube(8);
  for (Case* scene : {&without, &with}) scene->cells.clear(), scene->coupling.reset();
  with.fluid->convection = FluidSettings::Convection::extrapolated;
  Run run(with);
  take_up(without, 4, plain, run, plain);
  const auto state = run.simulation.fluid().state();
  for (int d = 0; d < 3; ++d) {
    const auto now = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), state.flux[d]);
    const auto before = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), state.flux_old[d]);
    double difference = 0, largest = 0;
    const IndexSpace& index = run.simulation.grid().index();
    for (int i = 0; i < index.n[0]; ++i)
      for (int j = 0; j < index.n[1]; ++j)
        for (int k = 0; k < index.n[2]; ++k) {
          const int c = index.cell(i, j, k);
          difference = std::max(difference, std::abs(now(c) - before(c)));
          largest = std::max(largest, std::abs(now(c)));
        }
    CHECK(largest > 0);
    CHECK(difference == 0);
  }
}

TEST_CASE("a stiffer membrane takes its sub-steps from the first step after a restart on", "[coupling][restart]") {
  const auto resolved = [](double modulus) { return fmt::format("[[cells]]\nshear_modulus_uN_per_m = {}\n", modulus); };
  Case soft = tube(8), stiff = tube(8);
  stiff.cells[0].shear_modulus_uN_per_m *= 1000;
  Run run(stiff), fresh(stiff);
  take_up(soft, 4, resolved(6.32), run, resolved(6320));
  run.simulation.step();
  fresh.simulation.step();
  // Not to the same number: the cell has changed its shape a little by then.
  CHECK(run.simulation.statistics().substeps >= 0.8 * fresh.simulation.statistics().substeps);
  CHECK(fresh.simulation.statistics().substeps > 10);
}

TEST_CASE("a body's force is known right after a restart", "[coupling][restart]") {
  Run run(tube_with_sphere());
  double before = 0;
  const auto force = [](FlowSimulation& simulation) {
    simulation.coupling()->tractions_for_output();
    return simulation.immersed()->loads({simulation.rigid_bodies()->centre(0)})[0][0][2];
  };
  double at = 0;
  take_up(tube_with_sphere(), 4, plain, run, plain, [&](FlowSimulation& stopped) {
    before = force(stopped);
    at = stopped.rigid_bodies()->centre(0)[2];
  });
  CHECK(before != 0);
  CHECK(force(run.simulation) == before);
  CHECK(run.simulation.rigid_bodies()->centre(0)[2] == at);
}

#endif

}  // namespace corpuscle
