// When each step of a run begins and how long it is.
#pragma once

#include "input/case.hpp"

#include <vector>

namespace corpuscle {

/// Steps of time.step_us, with time.first_step_us those at the start of that or less: the length doubles each time the run
/// has lasted `steps_per_length` of the next, so that a start from rest, where the flow and the membrane change fastest,
/// is resolved at the cost of few steps. The same begins anew at each sudden change of the inflow, and no step reaches
/// across one. Times are whole numbers of the shortest step (ticks), and depend on the case alone: a restarted run sees
/// the same ones.
class StepSchedule {
 public:
  /// @param changes_us  sudden changes of the inflow, in any order; see sudden_changes()
  /// @throws InputError  end_us is not a whole number of steps, or too many, or the first ones would be too short
  explicit StepSchedule(const TimeSettings& settings, const std::vector<double>& changes_us = {});

  double time_us(long tick) const { return static_cast<double>(tick) * shortest_; }
  /// Length of the step from `tick`, in ticks and in us.
  long ticks(long tick) const;
  double step_us(long tick) const { return static_cast<double>(ticks(tick)) * shortest_; }
  long end() const { return end_; }
  /// How many steps it takes from `tick` to the end.
  long steps_from(long tick) const;
  /// All lengths of steps, shortest first, us.
  std::vector<double> lengths_us() const;
  /// When steps become short again, us: the changes before the end, where short steps exist.
  std::vector<double> restarts_us() const;
  /// The tick at a time; -1 where there is none.
  long tick_at(double time_us) const;

  static constexpr long steps_per_length = 25;

 private:
  double shortest_ = 0;
  int doublings_ = 0;
  long end_ = 0;
  std::vector<long> changes_;  // last ticks before or at the changes, rising; the start is the first
};

/// Times at which the rate of a prescribed velocity jumps by so much that within a step of `step_us` the velocity comes to
/// differ by a share of its largest magnitude: corners of time tables, ends of ramps; not the start.
std::vector<double> sudden_changes(const std::vector<BoundarySettings>& boundaries, double step_us);

}  // namespace corpuscle
