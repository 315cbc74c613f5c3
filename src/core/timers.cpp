#include "core/timers.hpp"

#include <Kokkos_Core.hpp>
#include <algorithm>

namespace corpuscle {

void Timers::charge() {
  if (wait_) Kokkos::fence();
  const auto now = Clock::now();
  if (!running_.empty()) parts_[running_.back()].seconds += std::chrono::duration<double>(now - since_).count();
  since_ = now;
}

void Timers::start(const char* part) {
  charge();
  const auto found = std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.name == part; });
  running_.push_back(found - parts_.begin());
  if (found == parts_.end()) parts_.push_back({part, 0});
  Kokkos::Profiling::pushRegion(std::string("corpuscle::") + part);
}

void Timers::stop() {
  charge();
  running_.pop_back();
  Kokkos::Profiling::popRegion();
}

std::map<std::string, double> Timers::seconds() const {
  std::map<std::string, double> seconds;
  for (const auto& part : parts_) seconds[part.name] = part.seconds;
  return seconds;
}

}  // namespace corpuscle
