// Node coordinates of the built-in grids. All lengths in um.
#pragma once

#include "input/case.hpp"

#include <functional>

namespace corpuscle {

/// Coordinates of node (i, j, k), 0 <= i <= cells[0] and so on.
struct NodeSource {
  std::array<int, 3> cells{};
  std::function<Triple(int, int, int)> node;
};

/// The generator that the case asks for.
/// @throws InputError  for a centreline that bends more tightly than the tube is wide, or an unreadable node file.
NodeSource make_node_source(const GridSettings& settings);

/// Point of the unit disk for (u, v) in [-1, 1]^2. The conformal map (through the lemniscate sine) keeps the grid
/// orthogonal everywhere but at the four corners; the elliptical one spaces the centre evenly and is skewed near them.
std::array<double, 2> square_to_disk(double u, double v, GridSettings::CrossSection map);

/// A smooth centreline with rotation-minimising frames, sampled densely and evenly in arc length.
class Centerline {
 public:
  explicit Centerline(const GridSettings& settings);
  struct Frame {
    Triple position, tangent, normal, binormal;
  };
  double length() const { return length_; }
  double largest_curvature() const { return curvature_; }
  /// Frame at arc length s, 0 <= s <= length().
  Frame at(double s) const;

 private:
  std::vector<Frame> frames_;
  double length_ = 0, curvature_ = 0;
};

}  // namespace corpuscle
