// What samples make of a flow with cells: the stress on walls, and means and errors in the report's units.
#include <catch2/catch.hpp>

#include <functional>

#include "../coupling/scenes.hpp"
#include "blood/blood_sampler.hpp"
#include "core/units.hpp"
#include "coupling/energy_balance.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

using Type = BoundarySettings::Type;

/// Between walls at these speeds along x, 4 um apart, a capsule beside the upper one, within the kernel's reach, pushed along it.
Case beside_wall(double lower, double upper, double push_nN = 0) {
  Case scene;
  scene.time = {5, 100};
  scene.grid = GridSettings();
  scene.grid->nodes = {13, 9, 13};
  scene.grid->upper_um = {6, 4, 6};
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-12;
  scene.boundaries = sides(Type::periodic);
  for (int end = 0; end < 2; ++end) {
    scene.boundaries[2 + end].type = Type::moving_wall;
    scene.boundaries[2 + end].velocity = Triple{end == 0 ? lower : upper, 0, 0};
  }
  CellSettings cell;
  cell.shape = CellSettings::Shape::sphere;
  cell.radius_um = 1;
  cell.vertices = 100;
  cell.law = CellSettings::Law::neo_hookean;
  cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
  cell.center_um = {3, 2.75, 3};
  cell.push_nN = {push_nN, 0, 0};
  scene.cells = {cell};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.coupling->slip = false;
  scene.blood = BloodSettings{};
  return scene;
}

struct Sheared {
  explicit Sheared(const Comm& comm, const Case& scene) : simulation(comm, scene, timers), sampler(scene, simulation) {
    for (int n = 0; n < 4; ++n) simulation.step();
    CHECK(std::isnan(sampler.sample().relative_viscosity));  // cells are pushed
    viscosity = sampler.drag_of_walls();
  }
  Timers timers;
  FlowSimulation simulation;
  BloodSampler sampler;
  double viscosity = 0;
};

double error_of(const RunningMeans& means, int quantity) {
  CHECK(means.of(quantity).error_known());
  return means.of(quantity).least_error();
}

}  // namespace

TEST_CASE("walls that shear blood feel what its cells have on them through the kernel", "[blood][ranks]") {
  constexpr double speed = 4e-3, push = -0.02, volume = 6 * 4 * 6, rate = 2 * speed / 4;
  Sheared run(Comm(), beside_wall(-speed, speed, push));
  EnergyBalance energy(run.simulation);
  energy.sample(0);
  // What walls that move at the same speed both ways give is their mean stress times the rate of shear.
  const double power = energy.state().rates.boundaries, viscosity = run.simulation.fluid().viscosity();
  CHECK(run.viscosity == Approx(power / (viscosity * rate * rate * volume)).epsilon(1e-6));
  const double on_sides = run.simulation.coupling()->energy_of_cells(run.simulation.last_step_us()).on_sides;
  CHECK(std::abs(Comm().sum(on_sides)) > 1e-3 * power);
  if (Comm().size() > 1) CHECK(run.viscosity == Approx(Sheared(Comm::alone(), beside_wall(-speed, speed, push)).viscosity).epsilon(1e-8));
  // One wall at rest: as for an observer who moves with it.
  CHECK(Sheared(Comm(), beside_wall(0, 2 * speed, push)).viscosity == Approx(run.viscosity).epsilon(0.01));
  // Turned round by their course in time.
  Case back = beside_wall(-speed, speed, -push);
  for (int side : {2, 3}) back.boundaries[side].time_table = {{0, -1}, {1000, -1}};
  const Sheared other(Comm(), back);
  CHECK(other.viscosity == Approx(run.viscosity).epsilon(0.01));
  CHECK_FALSE(other.sampler.report().contains("relative_apparent_viscosity"));
}

TEST_CASE("reported means and errors have the samples' values, in the report's units", "[blood]") {
  const bool driven = GENERATE(false, true);
  Case scene = driven ? beside_wall(0, 0) : beside_wall(-4e-3, 4e-3);
  if (driven) scene.fluid->pressure_gradient_Pa_per_um = {-2, 0, 0};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  BloodSampler sampler(scene, simulation);
  // As a checkpoint has them, but for the samples: 256, of which sixteen in a row are by turns larger and smaller than
  // those before, so that their error is known.
  constexpr int settings = 6;
  enum { hematocrit, mean_speed, cell_speed, discharge, drag, wall_rate, layer, first_bin };
  std::vector<double> state = sampler.state();
  const int quantities = static_cast<int>(state.at(settings + 1)), bins = static_cast<int>(sampler.profile().hematocrit.size());
  REQUIRE(quantities == first_bin + 2 * bins);
  RunningMeans means(quantities);
  for (int n = 0; n < 256; ++n) {
    std::vector<double> values;
    for (int q = 0; q < quantities; ++q) values.push_back(1e-3 * (q + 2 + (7 * n + 3 * q) % 16 / 16.0 + 0.1 * (n / 16 % 2)));
    means.add(values);
  }
  const auto samples = means.state();
  state.resize(settings);
  state.insert(state.end(), samples.begin(), samples.end());
  sampler.resume(state, {});
  REQUIRE(sampler.samples() == 256);
  const auto report = sampler.report();
  INFO(report.dump(1));
  const auto number = [&](const char* key) { return report.at(key).get<double>(); };
  const double viscosity = simulation.fluid().viscosity();
  if (driven) {
    CHECK(number("mean_speed_mm_per_s") == Approx(means.mean(mean_speed) / units::mm_per_s));
    CHECK(number("mean_speed_error_mm_per_s") == Approx(error_of(means, mean_speed) / units::mm_per_s));
    CHECK(number("cell_speed_error_mm_per_s") == Approx(error_of(means, cell_speed) / units::mm_per_s));
    CHECK(number("relative_apparent_viscosity_error") ==
          Approx(number("relative_apparent_viscosity") * error_of(means, mean_speed) / means.mean(mean_speed)));
  } else {
    const double relative = means.mean(drag) / (viscosity * means.mean(wall_rate));
    CHECK(number("relative_apparent_viscosity") == Approx(relative));
    CHECK(number("relative_apparent_viscosity_error") == Approx(error_of(means, drag) / (viscosity * means.mean(wall_rate)) +
                                                                relative * error_of(means, wall_rate) / means.mean(wall_rate)));
  }
  CHECK(number("cell_free_layer_error_um") == Approx(error_of(means, layer)));
  const auto profile = sampler.profile();
  for (int b = 0; b < bins; ++b) {
    CHECK(profile.hematocrit_error[b] == Approx(error_of(means, first_bin + b)));
    CHECK(profile.velocity_mm_per_s[b] == Approx(means.mean(first_bin + bins + b) / units::mm_per_s));
    CHECK(profile.velocity_error_mm_per_s[b] == Approx(error_of(means, first_bin + bins + b) / units::mm_per_s));
  }
}

TEST_CASE("samples of another flow or other settings are no part of a restart's means", "[blood]") {
  const Case scene = beside_wall(-4e-3, 4e-3);
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  BloodSampler before(scene, simulation);
  const auto none = before.state();
  before.sample();
  const auto some = before.state();
  const auto samples_of = [&](const Case& next, const std::vector<double>& state, const std::vector<std::string>& changed) {
    BloodSampler after(next, simulation);
    after.resume(state, changed);
    return after.samples();
  };
  CHECK(samples_of(scene, some, {}) == 1);
  CHECK(samples_of(scene, some, {"time.step_us", "fluid.momentum_tolerance"}) == 1);
  CHECK(samples_of(scene, some, {"fluid.pressure_gradient_Pa_per_um"}) == 0);
  CHECK(samples_of(scene, some, {"boundary.2.velocity_mm_per_s"}) == 0);
  CHECK(samples_of(scene, none, {"cells.0.shear_modulus_uN_per_m"}) == 0);
  for (const auto& change : std::vector<std::function<void(BloodSettings&)>>{
           [](BloodSettings& b) { b.from_us = 600; }, [](BloodSettings& b) { b.sample_every_us = 77; },
           [](BloodSettings& b) { b.bins = 3; }, [](BloodSettings& b) { b.layer_window_um = 3; }}) {
    Case other = scene;
    change(*other.blood);
    CHECK(samples_of(other, some, {}) == 0);
  }
}

TEST_CASE("what drives a flow between walls or through a tube is told from walls that carry it", "[blood]") {
  const auto guided = [](const Case& scene) {
    std::array<bool, 3> periodic{};
    for (int s = 0; s < 6; ++s)
      if (scene.boundaries[s].type == Type::periodic) periodic[s / 2] = true;
    Grid grid(Comm(), make_node_source(*scene.grid), periodic);
    FluidSolver fluid(grid, *scene.fluid, scene.boundaries, &*scene.grid);
    return *find_guided_flow(scene, fluid);
  };
  const auto slit = [&](double lower, double upper, double gradient) {
    Case scene = beside_wall(lower, upper);
    scene.fluid->pressure_gradient_Pa_per_um = {gradient, 0, 0};
    return guided(scene);
  };
  const std::string both = "both moving walls and a pressure gradient drive the flow";
  CHECK(slit(0, 0, -1).driven);
  CHECK(slit(0, 0, -1).gradient > 0);
  CHECK(slit(-1e-3, 1e-3, 0).sheared);
  for (const auto& carried : {slit(2e-3, 2e-3, -1), slit(-2e-3, -2e-3, -1), slit(0, 2e-3, -1)}) {
    CHECK_FALSE(carried.driven);
    CHECK_FALSE(carried.sheared);
    CHECK(carried.gradient == 0);
    CHECK(carried.no_viscosity == both);
  }
  Case tube = beside_wall(0, 0);
  tube.grid = GridSettings();
  tube.grid->generator = GridSettings::Generator::straight_tube;
  tube.grid->nodes = {9, 9, 9};
  tube.grid->diameter_um = tube.grid->length_um = 6;
  tube.fluid->pressure_gradient_Pa_per_um = {0, 0, -1};
  tube.boundaries = sides(Type::wall);
  tube.boundaries[4].type = tube.boundaries[5].type = Type::periodic;
  CHECK(guided(tube).driven);
  CHECK(guided(tube).gradient > 0);
  for (int s = 0; s < 4; ++s) tube.boundaries[s].type = Type::moving_wall, tube.boundaries[s].velocity = Triple{0, 0, 1e-3};
  CHECK_FALSE(guided(tube).driven);
  CHECK(guided(tube).gradient == 0);
  CHECK(guided(tube).no_viscosity == "the tube's wall moves");
}
