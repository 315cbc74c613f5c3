// Means over time of several quantities, with their standard errors where samples are correlated.
#pragma once

#include <vector>

namespace corpuscle {

/// Blocks of 1, 2, 4, ... samples in a row: the spread of their means tells the error of the whole mean once blocks are
/// longer than the correlation (Flyvbjerg & Petersen, J. Chem. Phys. 91, 461, 1989). The error is the largest of the
/// estimates from lengths with at least `least_blocks` blocks. No sample is kept: memory grows with the logarithm of
/// their number.
class RunningMeans {
 public:
  static constexpr long least_blocks = 16;  // then an estimate is good to about 18 %

  explicit RunningMeans(int quantities = 0)
      : quantities_(quantities), origin_(quantities, 0.0), trend_(quantities, 0.0) {}

  /// A value of each quantity.
  void add(const std::vector<double>& values);
  int quantities() const { return quantities_; }
  long samples() const { return levels_.empty() ? 0 : levels_.front().blocks; }
  /// Not a number without samples.
  double mean(int quantity) const;
  /// Standard error of the mean; not a number with fewer than `least_blocks` samples.
  double error(int quantity) const;
  /// Change from the first sample to the last along the straight line that fits best; not a number with fewer than two.
  double drift(int quantity) const;
  /// Drift over what chance would give it: about one where nothing but chance drifts.
  double drift_over_chance(int quantity) const;

  /// All of it, for checkpoints.
  std::vector<double> state() const;
  /// @returns false, and is as it was, if the state is not one of so many quantities
  bool set_state(const std::vector<double>& state);

 private:
  /// Sums over blocks of one length, of what is beyond the first sample: less is lost to rounding.
  struct Level {
    long blocks = 0;
    bool waiting = false;
    std::vector<double> sum, square, half;  // half: a block that waits for the next to make up a longer one
  };

  int quantities_;
  std::vector<double> origin_, trend_;  // the first sample; sums of what is beyond it times its number
  std::vector<Level> levels_;
};

}  // namespace corpuscle
