// Signals that ask a run to end: it finishes its step and writes what it has.
#pragma once

#include "parallel/comm.hpp"

#include <signal.h>

#include <array>
#include <chrono>
#include <string>

namespace corpuscle {

/// Takes SIGTERM, SIGINT, SIGHUP and SIGUSR1 (which mpirun hands on without killing) while it lives, but not those that the
/// process was started to ignore (nohup, a script's background job). A second one, a second or more after the first, ends
/// the process at once.
class StopSignal {
 public:
  explicit StopSignal(const Comm& comm);
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Name of the signal that any rank has got, or an empty text. All ranks call between steps and hear the same; they ask
  /// each other about twice a second, or after every step where these take longer.
  std::string asked();

 private:
  using Clock = std::chrono::steady_clock;
  Comm comm_;
  Clock::time_point last_ = Clock::now();
  long calls_ = 0, interval_ = 1;
  std::array<struct sigaction, 4> before_{};
};

}  // namespace corpuscle
