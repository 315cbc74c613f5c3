// How far apart a grid's nodes are, place by place and whichever way one looks: for checks before the first step.
#pragma once

#include "grid/grid.hpp"

#include <array>
#include <vector>

namespace corpuscle {

/// Means of the squares of the steps from node to node: n^T S_d n is the square of how far a step along index direction d
/// leads along the unit vector n, and the sum of the three that of the spacing of nodes along n.
struct NodeSteps {
  std::array<std::array<double, 6>, 3> square{};  // xx, yy, zz, xy, yz, zx of S_d, um2

  /// n^T S_d n, um2
  double along(int d, const Triple& n) const;
  /// um
  double spacing(const Triple& n) const;
};

class SpacingMap {
 public:
  /// Collective.
  explicit SpacingMap(const Grid& grid);

  /// Box around the grid, um.
  const Triple& lower() const { return lower_; }
  const Triple& upper() const { return upper_; }

  /// Mean over the part of the grid near a box, or over all of it where the box lies outside.
  NodeSteps near(const Triple& lower, const Triple& upper) const;

 private:
  static constexpr int bins = 16;     // a direction of the box around the grid
  static constexpr int columns = 19;  // of a bin: how many cells, and their sums of the three tensors
  int bin(double x, int d) const;

  Triple lower_{}, upper_{};
  std::vector<double> sums_;  // [bins^3 * columns], x fastest
};

}  // namespace corpuscle
