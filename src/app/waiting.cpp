#include "app/waiting.hpp"

#include <unistd.h>

#if defined(__linux__) && defined(_OPENMP)
#include <omp.h>
#include <sched.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <vector>

namespace corpuscle {

namespace {

// By which the user may have chosen; either run time knows some of them.
constexpr const char* variables[] = {"OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME", "KMP_LIBRARY"};

/// Spinning is worth while for about as long as it takes to wake a thread. Measured on the tube with a cell, 2 threads on
/// two cores.
constexpr double spin_us = 20;

void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  __asm__ __volatile__("yield" ::: "memory");
#else
  __asm__ __volatile__("" ::: "memory");
#endif
}

/// How often a thread looks whether it may go on in `spin_us`: the pause in between is 5 to 45 ns, by processor.
long spins() {
  using Clock = std::chrono::steady_clock;
  constexpr int sample = 1000;
  double shortest_us = 1e30;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const auto start = Clock::now();
    for (int n = 0; n < sample; ++n) relax();
    shortest_us = std::min(shortest_us, std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  return std::clamp(static_cast<long>(spin_us * sample / std::max(shortest_us, 1e-3)), 100L, 20000L);
}

#if defined(__linux__) && defined(_OPENMP)
/// Where threads are to be bound (OMP_PROC_BIND, OMP_PLACES), the run time has bound this first one to its place already, and
/// the program started anew would take that place for the whole machine.
void give_back_places() {
  std::vector<int> processors;
  for (int place = 0; place < omp_get_num_places(); ++place) {
    std::vector<int> here(omp_get_place_num_procs(place));
    omp_get_place_proc_ids(place, here.data());
    processors.insert(processors.end(), here.begin(), here.end());
  }
  if (processors.empty()) return;
  const int count = *std::max_element(processors.begin(), processors.end()) + 1;
  cpu_set_t* set = CPU_ALLOC(count);
  if (!set) return;
  const auto bytes = CPU_ALLOC_SIZE(count);
  CPU_ZERO_S(bytes, set);
  for (const int processor : processors) CPU_SET_S(processor, bytes, set);
  sched_setaffinity(0, bytes, set);
  CPU_FREE(set);
}
#endif

}  // namespace

void wait_briefly([[maybe_unused]] char** argv) {
#if defined(__linux__) && defined(_OPENMP)
  for (const char* name : variables)
    if (std::getenv(name)) return;
  const char* threads = std::getenv("OMP_NUM_THREADS");
  if (threads && std::string(threads) == "1") return;
  setenv("GOMP_SPINCOUNT", std::to_string(spins()).c_str(), 0);
  setenv("KMP_BLOCKTIME", "0", 0);
  give_back_places();
  execv("/proc/self/exe", argv);  // if it fails, the run goes on as it is, and waits longer
  unsetenv("GOMP_SPINCOUNT");
#endif
}

std::string waiting_policy() {
  for (const char* name : variables)
    if (const char* value = std::getenv(name)) return std::string(name) + "=" + value;
  return "default";
}

}  // namespace corpuscle
