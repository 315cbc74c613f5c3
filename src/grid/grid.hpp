// One rank's block of the curvilinear grid: geometry, halo exchange, and facts about the whole grid.
#pragma once

#include "grid/generators.hpp"
#include "grid/geometry.hpp"
#include "parallel/halo.hpp"

#include <vector>

namespace corpuscle {

class Grid {
 public:
  /// @throws InputError  for more ranks than blocks, a cell of non-positive volume, or sides declared periodic that are
  ///                     not translates of each other.
  Grid(const Comm& comm, const NodeSource& source, const std::array<bool, 3>& periodic);

  const IndexSpace& index() const { return views_.index; }
  const GridViews& views() const { return views_; }
  const Comm& comm() const { return comm_; }
  Halo& halo() { return halo_; }
  const std::array<int, 3>& ranks_per_direction() const { return ranks_; }

  /// Node coordinates of the owned cells, [(n0 + 1) (n1 + 1) (n2 + 1), 3], i fastest; host memory, for output.
  const std::vector<double>& owned_nodes() const { return owned_nodes_; }
  /// Translation from one side of a periodic direction to the other, um.
  const Triple& period(int d) const { return period_[d]; }
  /// The node where all three directions begin, um.
  const Triple& corner() const { return corner_; }
  double total_volume() const { return total_volume_; }
  double mean_spacing() const { return mean_spacing_; }
  double smallest_spacing() const { return smallest_spacing_; }
  double largest_spacing() const { return largest_spacing_; }
  /// Ratio of the larger tangential to the normal coefficient of a face gradient, rms over the volume; 0 on an
  /// orthogonal grid. Not the maximum: a conformal tube is orthogonal but for the four cells at its corners.
  double skewness() const { return skewness_; }
  bool orthogonal() const { return skewness_ < negligible_skewness && skewed_share_ < 0.5; }

  /// Below this ratio the cross terms are left out. Measured on the conformal tube of 31 x 31 x 51 nodes: with and
  /// without them the developed velocity differs from the exact one by 0.23 % of its largest value at most.
  static constexpr double negligible_skewness = 0.03;
  /// At least half of the volume must be below this one. The ratio falls with the spacing squared in a conformal tube
  /// (0.0017 on average at 30 cells across), where leaving it out keeps second order; it stays in a sheared box, where
  /// twice the ratio would be the error of the mixed derivatives on any grid.
  static constexpr double negligible_typical_skewness = 0.003;

 private:
  void fill_nodes(const NodeSource& source);
  void check_volumes();
  void measure();

  Comm comm_;
  std::array<int, 3> ranks_{};
  GridViews views_;
  Halo halo_;
  std::array<Triple, 3> period_{};
  Triple corner_{};
  std::vector<double> owned_nodes_;
  double total_volume_ = 0, mean_spacing_ = 0, smallest_spacing_ = 0, largest_spacing_ = 0, skewness_ = 0, skewed_share_ = 0;
};

}  // namespace corpuscle
