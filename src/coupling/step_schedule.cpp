#include "coupling/step_schedule.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

StepSchedule::StepSchedule(const TimeSettings& settings) : shortest_(settings.step_us) {
  constexpr int most_doublings = 20;
  while (settings.first_step_us > 0 && shortest_ > settings.first_step_us * (1 + 1e-9) && doublings_ < most_doublings)
    shortest_ *= 0.5, ++doublings_;
  const long steps = std::llround(settings.end_us / settings.step_us);
  if (std::abs(static_cast<double>(steps) * settings.step_us - settings.end_us) > 1e-9 * settings.end_us)
    throw InputError(fmt::format("time.end_us = {} is not a whole number of steps of {} us (time.step_us); use {}",
                                 settings.end_us, settings.step_us, static_cast<double>(steps) * settings.step_us));
  end_ = steps << doublings_;
}

long StepSchedule::ticks(long tick) const {
  long length = 1;
  for (int n = 0; n < doublings_; ++n, length *= 2)
    if (tick < steps_per_length * 2 * length || tick % (2 * length) != 0) break;
  return length;
}

long StepSchedule::steps_from(long tick) const {
  const long longest = 1L << doublings_;
  long steps = 0;
  for (; tick < end_ && ticks(tick) < longest; ++steps) tick += ticks(tick);
  return steps + (end_ - std::min(tick, end_)) / longest;
}

std::vector<double> StepSchedule::lengths_us() const {
  std::vector<double> lengths;
  for (int n = 0; n <= doublings_; ++n) lengths.push_back(std::ldexp(shortest_, n));
  return lengths;
}

long StepSchedule::tick_at(double time_us) const {
  const long tick = std::llround(time_us / shortest_);
  return std::abs(this->time_us(tick) - time_us) <= 1e-9 * std::max(time_us, shortest_) ? tick : -1;
}

}  // namespace corpuscle
