// What Kokkos launches and allocates, by label, as its profiling hooks see it.
#pragma once

#include <Kokkos_Core.hpp>

#include <cstring>
#include <map>
#include <string>

namespace needless {

/// Counts between start() and stop(). One at a time: Kokkos has one set of hooks.
class Recorder {
 public:
  void start() {
    kernels().clear();
    reductions() = 0;
    allocations().clear();
    bytes().clear();
    namespace hooks = Kokkos::Tools::Experimental;
    hooks::set_begin_parallel_for_callback(launch);
    hooks::set_begin_parallel_reduce_callback(reduce);
    hooks::set_begin_parallel_scan_callback(launch);
    hooks::set_allocate_data_callback(allocate);
  }
  void stop() {
    namespace hooks = Kokkos::Tools::Experimental;
    hooks::set_begin_parallel_for_callback(nullptr);
    hooks::set_begin_parallel_reduce_callback(nullptr);
    hooks::set_begin_parallel_scan_callback(nullptr);
    hooks::set_allocate_data_callback(nullptr);
  }

  /// Launches by kernel label; allocations by view label.
  static std::map<std::string, int>& kernels() {
    static std::map<std::string, int> counts;
    return counts;
  }
  static std::map<std::string, int>& allocations() {
    static std::map<std::string, int> counts;
    return counts;
  }

  /// Launches that end in a number, and all.
  static int& reductions() {
    static int count = 0;
    return count;
  }
  static int launches() { return matching(kernels(), ""); }

  /// Bytes of the memory that kernels use, by view label: not those of copies that the host reads.
  static std::map<std::string, int>& bytes() {
    static std::map<std::string, int> counts;
    return counts;
  }

  /// How many of `counts` have a label that begins with `prefix`.
  static int matching(const std::map<std::string, int>& counts, const std::string& prefix) {
    int sum = 0;
    for (const auto& [label, count] : counts)
      if (label.rfind(prefix, 0) == 0) sum += count;
    return sum;
  }

 private:
  static void launch(const char* label, std::uint32_t, std::uint64_t*) { ++kernels()[label]; }
  static void reduce(const char* label, std::uint32_t, std::uint64_t*) { ++kernels()[label], ++reductions(); }
  static void allocate(Kokkos::Tools::SpaceHandle space, const char* label, const void*, std::uint64_t size) {
    ++allocations()[label];
    if (std::strcmp(space.name, Kokkos::DefaultExecutionSpace::memory_space::name()) == 0) bytes()[label] += static_cast<int>(size);
  }
};

}  // namespace needless
