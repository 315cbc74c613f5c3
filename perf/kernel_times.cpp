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

/// Doubles that pass per cell (a float is half of one), and operations, of the streaming kernels. `levels`: runs on every multigrid level but the
/// coarsest, once each.
struct Definition {
  double doubles, operations;
  bool levels;
};
const std::map<std::string, Definition> definitions = {
    {"corpuscle::fluid::momentum_step", {17, 75, false}},
    {"corpuscle::fluid::momentum_residual", {11, 66, false}},
    {"corpuscle::fluid::momentum_rhs", {12, 10, false}},
    {"corpuscle::fluid::momentum_history", {13, 15, false}},
    {"corpuscle::fluid::convection", {12, 60, false}},
    {"corpuscle::fluid::pressure_gradient", {7, 90, false}},
    {"corpuscle::fluid::face_flux", {17, 40, false}},
    {"corpuscle::fluid::correct_flux", {4, 3, false}},
    {"corpuscle::fluid::correct_velocity", {10, 95, false}},
    {"corpuscle::fluid::update_pressure", {5, 6, false}},
    {"corpuscle::fluid::divergence", {4, 6, false}},
    {"corpuscle::multigrid::smooth", {4.5, 20, true}},
    {"corpuscle::multigrid::smooth_from_zero", {3.5, 20, true}},
    {"corpuscle::multigrid::residual", {4, 15, true}},
    {"corpuscle::multigrid::restrict", {0.6, 1, true}},
    {"corpuscle::multigrid::prolong", {2, 1, true}},
    {"corpuscle::multigrid::operator", {6, 15, false}},
    {"corpuscle::multigrid::advance", {6.5, 6, false}},
    {"corpuscle::multigrid::dot", {1.5, 2, false}},
    {"corpuscle::multigrid::direction", {2.5, 2, false}},
};

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
  const auto level_cells = simulation.fluid().multigrid_cells();
  double smoothed = 0;  // mean over the levels that smooth
  for (std::size_t l = 0; l + 1 < level_cells.size(); ++l) smoothed += level_cells[l];
  if (level_cells.size() > 1) smoothed /= static_cast<double>(level_cells.size() - 1);
  nlohmann::json kernels = nlohmann::json::array();
  for (const auto& [label, t] : times) {
    nlohmann::json row{{"kernel", label},
                       {"launches_per_step", static_cast<double>(t.launches) / steps},
                       {"ms_per_step", 1e3 * t.seconds / steps},
                       {"share", t.seconds / plain}};
    const auto found = definitions.find(label);
    if (found != definitions.end()) {
      const double count = found->second.levels ? smoothed : cells;
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
