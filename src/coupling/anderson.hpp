// Anderson acceleration of the interface's fixed point (Walker and Ni, SIAM J. Numer. Anal. 49, 2011), which for a
// partitioned coupling is the interface quasi-Newton method of Degroote et al. (Comput. Struct. 87, 2009).
#pragma once

#include "membrane/interface.hpp"

#include <vector>

namespace corpuscle {

/// Each step starts anew. Work vectors live as long as the object.
class AndersonAcceleration {
 public:
  /// @param vertices  of the interface
  /// @param depth     how many differences are remembered
  AndersonAcceleration(int vertices, int depth);

  void start() { recorded_ = -1; }
  /// The next guess, in place of the present one, whose residual (answer - guess) is given.
  void advance(const Components<double>& guess, const Components<double>& residual);

 private:
  std::vector<double> weights(int columns) const;

  int vertices_, depth_;
  int recorded_ = -1;  // differences so far in this step; -1 before the first guess
  InterfaceDifferences differences_;
  Components<double> previous_guess_, previous_residual_;
  Array<double> products_, weight_;
  HostMirror<Array<double>> products_host_, weight_host_;
  std::vector<double> gram_;  // [depth, depth] products of the residual differences
  std::vector<double> right_;
};

}  // namespace corpuscle
