#include "coupling/step_schedule.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr int most_doublings = 20;
constexpr double most_ticks = 1e15;  // times are whole numbers of ticks, which a double holds with three digits to spare

/// Whether steps can be counted, before they are.
void check_counts(const TimeSettings& settings) {
  if (settings.first_step_us > 0 && settings.step_us > settings.first_step_us * std::ldexp(1 + 1e-9, most_doublings))
    throw InputError(
        fmt::format("time.first_step_us = {} is too short for steps of {} us (time.step_us): the least is a {}th "
                    "of them, {:.3g} us",
                    settings.first_step_us, settings.step_us, 1 << most_doublings, std::ldexp(settings.step_us, -most_doublings)));
  const double shortest = settings.first_step_us > 0 ? std::min(settings.step_us, settings.first_step_us) : settings.step_us;
  if (!(settings.end_us / shortest <= most_ticks))
    throw InputError(fmt::format(
        "time.end_us = {} is {:.3g} steps of {} us, and at most {:g} can be told apart: raise time.{}, "
        "or lower time.end_us",
        settings.end_us, settings.end_us / shortest, shortest, most_ticks, shortest < settings.step_us ? "first_step_us" : "step_us"));
}

}  // namespace

StepSchedule::StepSchedule(const TimeSettings& settings, const std::vector<double>& changes_us) : shortest_(settings.step_us), changes_{0} {
  check_counts(settings);
  while (settings.first_step_us > 0 && shortest_ > settings.first_step_us * (1 + 1e-9)) shortest_ *= 0.5, ++doublings_;
  const long steps = std::llround(settings.end_us / settings.step_us);
  if (std::abs(static_cast<double>(steps) * settings.step_us - settings.end_us) > 1e-9 * settings.end_us)
    throw InputError(fmt::format("time.end_us = {} is not a whole number of steps of {} us (time.step_us); use {}", settings.end_us,
                                 settings.step_us, static_cast<double>(steps) * settings.step_us));
  end_ = steps << doublings_;
  if (doublings_ == 0) return;
  for (double change : changes_us) {
    const long tick = std::lround(std::floor(change / shortest_ + 1e-9));
    if (tick > 0 && tick < end_) changes_.push_back(tick);
  }
  std::sort(changes_.begin(), changes_.end());
  changes_.erase(std::unique(changes_.begin(), changes_.end()), changes_.end());
}

long StepSchedule::ticks(long tick) const {
  const auto next = std::upper_bound(changes_.begin(), changes_.end(), tick);
  const long since = tick - *(next - 1), left = next == changes_.end() ? end_ - tick : *next - tick;
  long length = 1;
  for (int n = 0; n < doublings_; ++n, length *= 2)
    if (since < steps_per_length * 2 * length || tick % (2 * length) != 0 || left < 2 * length) break;
  return length;
}

long StepSchedule::steps_from(long tick) const {
  const long longest = 1L << doublings_;
  long steps = 0;
  for (; tick < end_ && (tick < changes_.back() || ticks(tick) < longest); ++steps) tick += ticks(tick);
  return steps + (end_ - std::min(tick, end_)) / longest;
}

std::vector<double> StepSchedule::lengths_us() const {
  std::vector<double> lengths;
  for (int n = 0; n <= doublings_; ++n) lengths.push_back(std::ldexp(shortest_, n));
  return lengths;
}

std::vector<double> StepSchedule::restarts_us() const {
  std::vector<double> times;
  for (std::size_t n = 1; n < changes_.size(); ++n) times.push_back(time_us(changes_[n]));
  return times;
}

long StepSchedule::tick_at(double time_us) const {
  const long tick = std::llround(time_us / shortest_);
  return std::abs(this->time_us(tick) - time_us) <= 1e-9 * std::max(time_us, shortest_) ? tick : -1;
}

std::vector<double> sudden_changes(const std::vector<BoundarySettings>& boundaries, double step_us) {
  // A pulse that doubles the flow within 20 us departs from its course by a tenth in a step of 4 us, and leaves such a step
  // an error of several percent; a ramp of 200 us by a fiftieth. Tables that sample a smooth course change by little from
  // row to row, and keep their long steps.
  constexpr double share = 0.03;
  std::vector<double> times;
  for (const auto& b : boundaries) {
    std::vector<std::array<double, 2>> course = b.time_table;
    if (b.ramp_us > 0) course = {{0, 0}, {b.ramp_us, 1}};
    double largest = 0;
    for (const auto& row : course) largest = std::max(largest, std::abs(row[1]));
    const auto rate = [&](std::size_t from) {  // constant before the first row and beyond the last
      return from + 1 < course.size() ? (course[from + 1][1] - course[from][1]) / (course[from + 1][0] - course[from][0]) : 0.0;
    };
    for (std::size_t n = 0; n < course.size(); ++n) {
      const double jump = rate(n) - (n > 0 ? rate(n - 1) : 0.0);
      if (course[n][0] > 0 && std::abs(jump) * step_us > share * largest) times.push_back(course[n][0]);
    }
  }
  return times;
}

}  // namespace corpuscle
