// Time of every kernel of a scene's steps, and the bandwidth that the streaming ones reach, for perf/kernels:
//   kernel_times CASE.toml STEPS [section.key=value ...]
// Prints one JSON object. Bytes are counted from a kernel's definition: each array that it reads or writes passes once
// over its cells, neighbours come from cache.
#include <Kokkos_Core.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "coupling/flow_simulation.hpp"
#include "output/report.hpp"
#include "program.hpp"

using namespace corpuscle;

namespace {

using Clock = std::chrono::steady_clock;

struct Times {
  long launches = 0;
  double seconds = 0;
};
std::map<std::string, Times> times;
std::string running;
Clock::time_point began;

void begin(const char* label, std::uint32_t, std::uint64_t*) {
  running = label;
  began = Clock::now();
}
void end(std::uint64_t) {
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  Exec().fence();
#endif
  auto& t = times[running];
  ++t.launches;
  t.seconds += std::chrono::duration<double>(Clock::now() - began).count();
}

void watch(bool on) {
  namespace hooks = Kokkos::Tools::Experimental;
  hooks::set_begin_parallel_for_callback(on ? begin : nullptr);
  hooks::set_end_parallel_for_callback(on ? end : nullptr);
  hooks::set_begin_parallel_reduce_callback(on ? begin : nullptr);
  hooks::set_end_parallel_reduce_callback(on ? end : nullptr);
  hooks::set_begin_parallel_scan_callback(on ? begin : nullptr);
  hooks::set_end_parallel_scan_callback(on ? end : nullptr);
}

/// GB/s of a = b + s c, best of several passes (McCalpin's STREAM counts 24 bytes an entry).
double triad(int entries, int passes) {
  Array<double> a("corpuscle::perf::a", entries), b("corpuscle::perf::b", entries), c("corpuscle::perf::c", entries);
  double best = 1e300;
  for (int n = 0; n < passes; ++n) {
    const auto start = Clock::now();
    Kokkos::parallel_for(
        "corpuscle::perf::triad", Policy(0, entries), KOKKOS_LAMBDA(int i) { a(i) = b(i) + 0.4 * c(i); });
    Kokkos::fence();
    if (n > 0) best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return 24e-9 * entries / best;
}

/// Where a kernel runs: on the grid, or once on each of these multigrid levels: all but the pressure's coarsest, those of the
/// velocity, and those of the velocity but its coarsest.
enum class Where { grid, pressure, velocity, velocity_above };

/// Doubles that pass per cell (a float is half of one), and operations, of the streaming kernels.
struct Definition {
  double doubles, operations;
  Where where = Where::grid;
};
const std::map<std::string, Definition> definitions = {
    {"corpuscle::fluid::momentum_operator", {9, 75}},
    {"corpuscle::fluid::momentum_residual", {16, 90}},
    {"corpuscle::fluid::advance_velocity", {12.5, 22}},
    {"corpuscle::fluid::scaled_dot", {3.5, 9}},
    {"corpuscle::fluid::next_direction", {6, 12}},
    {"corpuscle::fluid::momentum_history", {13, 15}},
    {"corpuscle::fluid::convection", {12, 60}},
    {"corpuscle::fluid::pressure_gradient", {7, 90}},
    {"corpuscle::fluid::face_flux", {17, 40}},
    {"corpuscle::fluid::correct_flux", {4, 3}},
    {"corpuscle::fluid::correct_velocity", {10, 95}},
    {"corpuscle::fluid::update_pressure", {5, 6}},
    {"corpuscle::fluid::divergence", {4, 6}},
    {"corpuscle::velocity_multigrid::smooth", {8.5, 60, Where::velocity}},
    {"corpuscle::velocity_multigrid::smooth_from_zero", {6.5, 60, Where::velocity}},
    {"corpuscle::velocity_multigrid::residual", {7, 45, Where::velocity_above}},
    {"corpuscle::velocity_multigrid::restrict", {1.8, 3, Where::velocity_above}},
    {"corpuscle::velocity_multigrid::prolong", {4, 3, Where::velocity_above}},
    {"corpuscle::multigrid::smooth", {4.5, 20, Where::pressure}},
    {"corpuscle::multigrid::smooth_from_zero", {3.5, 20, Where::pressure}},
    {"corpuscle::multigrid::residual", {4, 15, Where::pressure}},
    {"corpuscle::multigrid::restrict", {0.6, 1, Where::pressure}},
    {"corpuscle::multigrid::prolong", {2, 1, Where::pressure}},
    {"corpuscle::multigrid::operator", {7.5, 33}},
    {"corpuscle::multigrid::advance", {10, 11}},
    {"corpuscle::multigrid::dot", {2, 2}},
};

/// Mean number of cells that a launch there passes over. Small levels are done by another kernel, all in one.
double cells_of(const FluidSolver& fluid, Where where) {
  auto cells = fluid.multigrid_cells();
  const std::size_t all = cells.size();
  while (cells.size() > 1 && all - cells.size() < SmallLevels<Array<CycleReal>>::most &&
         cells.back() <= SmallLevels<Array<CycleReal>>::most_cells)
    cells.pop_back();
  std::size_t levels = 1;
  if (where == Where::pressure) levels = cells.size() < all ? cells.size() : all - 1;
  if (where == Where::velocity) levels = fluid.velocity_levels();
  if (where == Where::velocity_above) levels = fluid.velocity_levels() - 1;
  levels = std::clamp<std::size_t>(levels, 1, cells.size());
  return std::accumulate(cells.begin(), cells.begin() + levels, 0.0) / static_cast<double>(levels);
}

nlohmann::json study(const std::string& path, int steps, const std::vector<std::string>& overrides) {
  const Case scene = read_case(path, overrides);
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  for (int n = 0; n < 5; ++n) simulation.step();
  const auto start = Clock::now();
  for (int n = 0; n < steps; ++n) simulation.step();
  const double plain = std::chrono::duration<double>(Clock::now() - start).count();
  watch(true);
  for (int n = 0; n < steps; ++n) simulation.step();
  watch(false);
  const double cells = simulation.grid().index().owned();
  nlohmann::json kernels = nlohmann::json::array();
  for (const auto& [label, t] : times) {
    nlohmann::json row{{"kernel", label},
                       {"launches_per_step", static_cast<double>(t.launches) / steps},
                       {"ms_per_step", 1e3 * t.seconds / steps},
                       {"share", t.seconds / plain}};
    const auto found = definitions.find(label);
    if (found != definitions.end()) {
      const double count = cells_of(simulation.fluid(), found->second.where);
      row["bytes_per_cell"] = 8 * found->second.doubles;
      row["operations_per_cell"] = found->second.operations;
      row["GB_per_s"] = 8e-9 * found->second.doubles * count * t.launches / t.seconds;
      row["Gflop_per_s"] = 1e-9 * found->second.operations * count * t.launches / t.seconds;
    }
    kernels.push_back(row);
  }
  const int vector = simulation.grid().index().size();
  return {{"backend", backend_name()},
          {"threads", thread_count()},
          {"case", path},
          {"cells", cells},
          {"steps", steps},
          {"ms_per_step", 1e3 * plain / steps},
          {"triad_GB_per_s", triad(20'000'000, 10)},
          {"triad_of_a_field_GB_per_s", triad(vector, 200)},
          {"kernels", kernels}};
}

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, 2, "CASE.toml STEPS [section.key=value ...]", [](int count, char** words) {
    std::printf("%s\n", study(words[1], std::atoi(words[2]), {words + 3, words + count}).dump(1).c_str());
  });
}
