// When each step of a run begins and how long it is.
#pragma once

#include "input/case.hpp"

#include <vector>

namespace corpuscle {

/// Steps of time.step_us, with time.first_step_us those at the start of that or less: the length doubles each time the run
/// has lasted `steps_per_length` of the next, so that a start from rest, where the flow and the membrane change fastest,
/// is resolved at the cost of few steps. Times are whole numbers of the shortest step (ticks): a restarted run sees the
/// same ones.
class StepSchedule {
 public:
  /// @throws InputError  end_us is not a whole number of steps
  explicit StepSchedule(const TimeSettings& settings);

  double time_us(long tick) const { return static_cast<double>(tick) * shortest_; }
  /// Length of the step from `tick`, in ticks and in us.
  long ticks(long tick) const;
  double step_us(long tick) const { return static_cast<double>(ticks(tick)) * shortest_; }
  long end() const { return end_; }
  /// How many steps it takes from `tick` to the end.
  long steps_from(long tick) const;
  /// All lengths of steps, shortest first, us.
  std::vector<double> lengths_us() const;
  /// The tick at a time; -1 where there is none.
  long tick_at(double time_us) const;

  static constexpr long steps_per_length = 25;

 private:
  double shortest_ = 0;
  int doublings_ = 0;
  long end_ = 0;
};

}  // namespace corpuscle
