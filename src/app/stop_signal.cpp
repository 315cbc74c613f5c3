#include "app/stop_signal.hpp"

#include <algorithm>
#include <csignal>
#include <ctime>
#include <iterator>
#include <tuple>
#include <utility>

namespace corpuscle {

namespace {

constexpr std::pair<int, const char*> taken[] = {{SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}, {SIGHUP, "SIGHUP"}, {SIGUSR1, "SIGUSR1"}};

volatile std::sig_atomic_t pending = 0;
volatile std::sig_atomic_t since_s = 0;

std::sig_atomic_t now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::sig_atomic_t>(now.tv_sec);
}

void take(int signal) {
  if (pending == 0) {
    since_s = now_s();
    pending = signal;
  } else if (now_s() - since_s > 1) {  // a launcher may send several at once
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

}  // namespace

StopSignal::StopSignal(const Comm& comm) : comm_(comm) {
  pending = 0;
  static_assert(std::size(taken) == std::tuple_size_v<decltype(before_)>);
  for (std::size_t n = 0; n < before_.size(); ++n) {
    struct sigaction action {};
    action.sa_handler = take;
    action.sa_flags = SA_RESTART;  // reads and writes of results go on
    sigaction(taken[n].first, nullptr, &before_[n]);
    if (before_[n].sa_handler != SIG_IGN) sigaction(taken[n].first, &action, nullptr);
  }
}

StopSignal::~StopSignal() {
  for (std::size_t n = 0; n < before_.size(); ++n) sigaction(taken[n].first, &before_[n], nullptr);
}

std::string StopSignal::asked() {
  constexpr double react_s = 0.5;
  double values[2] = {static_cast<double>(pending), 0};
  if (comm_.size() > 1) {
    if (++calls_ < interval_) return "";
    values[1] = std::chrono::duration<double>(Clock::now() - last_).count() / static_cast<double>(calls_);
    comm_.max(values, 2);
    last_ = Clock::now();
    calls_ = 0;
    interval_ = std::clamp(static_cast<long>(react_s / std::max(values[1], 1e-6)), 1L, 2 * interval_);
  }
  for (const auto& [signal, name] : taken)
    if (signal == static_cast<int>(values[0])) return name;
  return "";
}

}  // namespace corpuscle
