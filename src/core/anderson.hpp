// Anderson acceleration of a fixed point (Walker and Ni, SIAM J. Numer. Anal. 49, 2011), which for a partitioned coupling
// is the interface quasi-Newton method of Degroote et al. (Comput. Struct. 87, 2009).
#pragma once

#include "common/differences.hpp"

#include <functional>
#include <vector>

namespace corpuscle {

/// Work vectors live as long as the object.
class AndersonAcceleration {
 public:
  /// @param entries  of the unknown, on this rank
  /// @param depth    how many differences are remembered
  /// @param sum      sums so many values over all ranks, in place; none where every rank has the whole unknown
  AndersonAcceleration(int entries, int depth, std::function<void(double*, int)> sum = nullptr);

  /// Forget the iterates so far.
  void start() { recorded_ = -1; }
  /// The next guess, in place of the present one, whose residual (answer - guess) is given.
  void advance(const Array<double>& guess, const Array<double>& residual);

 private:
  std::vector<double> weights(int columns) const;

  int depth_;
  std::function<void(double*, int)> sum_;
  int recorded_ = -1;  // differences so far; -1 before the first guess
  IterateDifferences differences_;
  Array<double> previous_guess_, previous_residual_;
  Array<double> products_, weight_;
  HostMirror<Array<double>> products_host_, weight_host_;
  std::vector<double> gram_;  // [depth, depth] products of the residual differences
  std::vector<double> right_;
};

}  // namespace corpuscle
