// Steps that grow from a start at rest: when they begin, and what they buy.
#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "membrane/mesh.hpp"
#include "scenes.hpp"

namespace corpuscle {
namespace {

std::vector<double> times(const StepSchedule& schedule, long from = 0) {
  std::vector<double> all;
  for (long tick = from; tick <= schedule.end(); tick += schedule.ticks(tick)) all.push_back(schedule.time_us(tick));
  return all;
}

TriangleMesh after(Case scene, double step_us, double first_step_us, long* steps = nullptr) {
  scene.time = {step_us, scene.time.end_us, first_step_us};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  const long expected = simulation.steps_left();
  while (!simulation.done()) simulation.step();
  REQUIRE(simulation.time() == scene.time.end_us);
  REQUIRE(simulation.steps() == expected);
  if (steps) *steps = simulation.steps();
  return body_mesh(*simulation.surfaces(), 0);
}

double rms_distance(const TriangleMesh& a, const TriangleMesh& b) {
  double sum = 0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v)
    for (int m = 0; m < 3; ++m) sum += std::pow(a.vertices[v][m] - b.vertices[v][m], 2);
  return std::sqrt(sum / a.vertices.size());
}

}  // namespace

TEST_CASE("a schedule without first steps is uniform", "[coupling]") {
  for (const double first : {0.0, 0.3, 5.0}) {
    const StepSchedule schedule({0.3, 1.2, first});
    CHECK(times(schedule) == std::vector<double>{0, 0.3, 2 * 0.3, 3 * 0.3, 4 * 0.3});
    CHECK(schedule.steps_from(0) == 4);
    CHECK(schedule.lengths_us() == std::vector<double>{0.3});
  }
}

TEST_CASE("steps double from the first to the full length and meet every whole step", "[coupling]") {
  const StepSchedule schedule({4, 400, 1.5});  // the longest half of a half that is at most 1.5
  CHECK(schedule.lengths_us() == std::vector<double>{1, 2, 4});
  const auto all = times(schedule);
  CHECK(all.back() == 400);
  CHECK(schedule.steps_from(0) == static_cast<long>(all.size()) - 1);
  for (std::size_t n = 0; n + 1 < all.size(); ++n) {
    const double step = all[n + 1] - all[n];
    CHECK(step == (all[n] < 50 ? 1 : (all[n] < 100 ? 2 : 4)));
    CHECK(schedule.steps_from(schedule.tick_at(all[n])) == static_cast<long>(all.size() - 1 - n));
  }
  CHECK(schedule.tick_at(0.5) == -1);
  // From a time that no full step meets, as after a restart: no step is skipped, none overshoots.
  const auto later = times(schedule, schedule.tick_at(201));
  CHECK(std::vector<double>(later.begin(), later.begin() + 4) == std::vector<double>{201, 202, 204, 208});
  CHECK(later.back() == 400);
}

TEST_CASE("steps become short again at a sudden change of the inflow, and none reaches across it", "[coupling]") {
  const StepSchedule schedule({4, 400, 1}, {301.7, 200});
  CHECK(schedule.restarts_us() == std::vector<double>{200, 301});
  const auto all = times(schedule);
  CHECK(all.back() == 400);
  CHECK(schedule.steps_from(0) == static_cast<long>(all.size()) - 1);
  for (std::size_t n = 0; n + 1 < all.size(); ++n) {
    const double step = all[n + 1] - all[n], change = all[n] < 200 ? 0 : (all[n] < 301 ? 200 : 301);
    INFO("the step from " << all[n] << " us");
    CHECK((all[n] < 200) == (all[n + 1] <= 200));
    CHECK((all[n] < 301) == (all[n + 1] <= 301));
    CHECK(step <= std::max(1.0, (all[n] - change) / StepSchedule::steps_per_length));
    CHECK(schedule.steps_from(schedule.tick_at(all[n])) == static_cast<long>(all.size() - 1 - n));
  }
  // Full length is reached before and between the changes: 100 us after each.
  CHECK(schedule.step_us(schedule.tick_at(196)) == 4);
  CHECK(schedule.step_us(schedule.tick_at(200)) == 1);
  // A case that ends earlier takes the same steps up to there: a run may be stopped and carried on.
  const auto shorter = times(StepSchedule({4, 248, 1}, {200, 301.7}));
  CHECK(std::equal(shorter.begin(), shorter.end(), all.begin()));
  CHECK(StepSchedule({4, 400, 0}, {200}).restarts_us().empty());
}

TEST_CASE("a pulse and the end of a short ramp are sudden, a slow ramp and a sampled smooth course are not", "[coupling]") {
  using Table = std::vector<std::array<double, 2>>;
  const auto of = [](const Table& table, double ramp_us) {
    auto all = scenes::sides(BoundarySettings::Type::wall);
    all[4].time_table = table;
    all[4].ramp_us = ramp_us;
    return sudden_changes(all, 4);
  };
  CHECK(of({{0, 0}, {20, 1}, {200, 1}, {220, 2}, {400, 2}}, 0) == std::vector<double>{20, 200, 220});
  CHECK(of({{50, 1}, {60, 0}}, 0) == std::vector<double>{50, 60});
  CHECK(of({}, 20) == std::vector<double>{20});
  CHECK(of({}, 200).empty());
  CHECK(of({}, 0).empty());
  Table beat;
  for (int row = 0; row <= 200; ++row) beat.push_back({5.0 * row, 1 - std::cos(2 * std::acos(-1.0) * row / 200)});
  CHECK(of(beat, 0).empty());
}

TEST_CASE("an end that is no whole number of steps is refused", "[coupling]") {
  CHECK_THROWS_WITH(StepSchedule({4, 42, 1}), Catch::Contains("time.end_us") && Catch::Contains("use 4"));
}

TEST_CASE("steps that cannot be counted are refused, and first steps that would have to be longer than asked", "[coupling]") {
  using Catch::Contains;
  CHECK_THROWS_WITH(StepSchedule({1, 1e300, 0}), Contains("time.end_us = 1e+300") && Contains("raise time.step_us"));
  CHECK_THROWS_WITH(StepSchedule({1e-300, 1, 0}), Contains("1e-300 us") && Contains("raise time.step_us"));
  CHECK_THROWS_WITH(StepSchedule({4, 400, 1e-6}), Contains("time.first_step_us = 1e-06") && Contains("least"));
  CHECK_THROWS_WITH(StepSchedule({4, 4e12, 1e-4}), Contains("4e+16 steps of 0.0001 us") && Contains("time.first_step_us"));
  CHECK(StepSchedule({4, 400, 4.0 / (1 << 20)}).lengths_us().size() == 21);
  CHECK(StepSchedule({1, 1e15, 0}).end() == 1000000000000000);
}

TEST_CASE("short first steps take out the error of the start", "[coupling]") {
  const auto scene = scenes::tube_with_cell(17, 25, 100, CouplingSettings::Scheme::robin, 120);
  const auto reference = after(scene, 1, 0.25);
  long uniform_steps = 0, growing_steps = 0;
  const double uniform = rms_distance(after(scene, 4, 0, &uniform_steps), reference);
  const double half = rms_distance(after(scene, 2, 0), reference);
  const double growing = rms_distance(after(scene, 4, 1, &growing_steps), reference);
  INFO("rms distance: 4 us " << uniform << ", 2 us " << half << ", 1 to 4 us " << growing << " um; " << growing_steps << " steps");
  CHECK(uniform_steps == 30);
  CHECK(growing_steps == 95);  // 50 of 1 us after the end of the ramp, 20 before it, and 25 of 2 us
  CHECK(growing < half);
  CHECK(growing < 0.5 * uniform);
}

}  // namespace corpuscle
