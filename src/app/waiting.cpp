#include "app/waiting.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

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

}  // namespace

void wait_briefly([[maybe_unused]] char** argv) {
#if defined(__linux__) && defined(_OPENMP)
  for (const char* name : variables)
    if (std::getenv(name)) return;
  const char* threads = std::getenv("OMP_NUM_THREADS");
  if (threads && std::string(threads) == "1") return;
  setenv("GOMP_SPINCOUNT", std::to_string(spins()).c_str(), 0);
  setenv("KMP_BLOCKTIME", "0", 0);
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
