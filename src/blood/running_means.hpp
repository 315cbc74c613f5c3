// Means over time of several quantities, with their standard errors where samples are correlated.
#pragma once

#include <cstddef>
#include <vector>

namespace corpuscle {

/// Samples of one quantity, evenly spaced in time. Blocks of 1, 2, 4, ... samples in a row: the spread of their means tells
/// the error of the whole mean once blocks are longer than the correlation (Flyvbjerg & Petersen, J. Chem. Phys. 91, 461,
/// 1989). Whether they are is told by what neighbouring ones of the longest blocks have in common. No sample is kept: memory
/// grows with the logarithm of their number.
class RunningMean {
 public:
  static constexpr long least_blocks = 16;  // then an estimate is good to about 18 %

  void add(double value);
  long samples() const { return levels_.empty() ? 0 : levels_.front().blocks; }
  /// Not a number without samples.
  double mean() const;
  /// The largest standard error of the mean that the blocks tell: that, where error_known(), and else less than it is. Not a
  /// number with fewer than `least_blocks` samples.
  double least_error() const { return spread(false).error; }
  /// Whether the longest blocks know next to nothing of each other.
  bool error_known() const { return spread(false).known; }
  /// From when on samples know nothing of each other, in samples: half the factor by which the variance of the mean is larger
  /// than without correlation. And how many there would be without. Bounds where the error is one.
  double correlation() const;
  double effective_samples() const;
  /// Change from the first sample to the last along the straight line that fits best; not a number with fewer than two.
  double drift() const;
  /// Drift over what chance would give it: about one where nothing but chance drifts. Not a number where samples are too few
  /// to tell a drift from a slow fluctuation.
  double drift_over_chance() const;

  /// All of it, for checkpoints; appended.
  void append_state(std::vector<double>& state) const;
  /// @returns how many numbers of the state, from `at` on, were its own; 0, and nothing has changed, if they are not one
  std::size_t take_state(const std::vector<double>& state, std::size_t at);

 private:
  /// Sums over blocks of one length, of what is beyond the first sample: less is lost to rounding.
  struct Level {
    long blocks = 0;
    bool waiting = false;                                        // the last one, for the next, to make up a longer one
    double sum = 0, square = 0, trend = 0, steps = 0, last = 0;  // trend: times its number; steps: squares, from one to the next
  };
  struct Spread {
    double error;  // of the mean
    bool known;
  };
  static double slope(const Level& level);
  Spread spread(bool about_line) const;

  double origin_ = 0;  // the first sample
  std::vector<Level> levels_;
};

/// Of several quantities at once. A value that is not a number is no sample of its quantity.
class RunningMeans {
 public:
  explicit RunningMeans(int quantities = 0) : series_(quantities) {}

  /// A value of each quantity.
  void add(const std::vector<double>& values);
  int quantities() const { return static_cast<int>(series_.size()); }
  long samples() const { return samples_; }
  const RunningMean& of(int quantity) const { return series_[quantity]; }
  double mean(int quantity) const { return series_[quantity].mean(); }
  /// Standard error of the mean; not a number where it is not known.
  double error(int quantity) const;

  /// All of it, for checkpoints.
  std::vector<double> state() const;
  /// @returns false, and is as it was, if the state is not one of so many quantities
  bool set_state(const std::vector<double>& state);

 private:
  long samples_ = 0;
  std::vector<RunningMean> series_;
};

}  // namespace corpuscle
