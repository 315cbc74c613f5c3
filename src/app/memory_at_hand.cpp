// The memory that a process may still take: the machine's, less where a control group or a limit of the process allows less.
#include "app/estimate.hpp"

#include <sys/resource.h>

#include <Kokkos_Core.hpp>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

namespace corpuscle {

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity(), bytes_per_mb = 1024 * 1024;

/// The number after `key` in a file of lines "key number"; with no key, the first number. Unlimited where there is none:
/// such a file may say "max".
double number_in(const std::string& path, const std::string& key = "") {
  std::ifstream in(path);
  double value = unlimited;
  if (key.empty()) return in >> value ? value : unlimited;
  for (std::string name; in >> name;)
    if (name == key) return in >> value ? value : unlimited;
  return unlimited;
}

double or_zero(double value) { return value == unlimited ? 0 : value; }

/// What is left of a control group's memory; cached files give way.
double left_in(const std::string& folder, bool second) {
  const double limit = number_in(folder + (second ? "/memory.max" : "/memory.limit_in_bytes"));
  const double used = or_zero(number_in(folder + (second ? "/memory.current" : "/memory.usage_in_bytes")));
  const double cached = or_zero(number_in(folder + "/memory.stat", second ? "inactive_file" : "total_inactive_file"));
  return limit - used + cached;
}

/// The least that is left in this process's control groups and those above them, of either version.
double left_in_groups() {
  double least = unlimited;
  std::ifstream in("/proc/self/cgroup");
  for (std::string line; std::getline(in, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool unified = controllers.empty();
    if (!unified && controllers.find("memory") == std::string::npos) continue;
    const std::string root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
    for (std::string group = line.substr(second + 1);; group.erase(group.rfind('/'))) {
      least = std::min(least, left_in(root + (group == "/" ? "" : group), unified));
      if (group.empty() || group.rfind('/') == std::string::npos) break;
    }
  }
  return least;
}

double left_of_process() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return unlimited;
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return static_cast<double>(limit.rlim_cur) - 4096 * pages;
}

double left_on_machine() {
  const double kilobytes = number_in("/proc/meminfo", "MemAvailable:");
  return kilobytes == unlimited ? unlimited : 1024 * kilobytes;
}

double left_on_device() {
#if defined(KOKKOS_ENABLE_CUDA)
  std::size_t left = 0, all = 0;
  if (cudaMemGetInfo(&left, &all) == cudaSuccess) return static_cast<double>(left);
#elif defined(KOKKOS_ENABLE_HIP)
  std::size_t left = 0, all = 0;
  if (hipMemGetInfo(&left, &all) == hipSuccess) return static_cast<double>(left);
#endif
  return unlimited;
}

}  // namespace

double memory_at_hand_mb() { return std::min({left_on_machine(), left_in_groups(), left_of_process(), left_on_device()}) / bytes_per_mb; }

}  // namespace corpuscle
