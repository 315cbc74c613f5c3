// Which rank a place belongs to, and which ranks' blocks a cell reaches into.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "grid/grid.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

/// How many periods along each direction the shifts are under which cells are seen: the identity first, then all by one period or
/// none along each direction, and then, up to `most`, all by more. And the shifts themselves, um.
std::vector<std::array<int, 3>> period_turns(const Grid& grid, int most = 1);
std::vector<Vec3> period_shifts(const Grid& grid, int most = 1);

struct SpaceBox {
  Vec3 lower, upper;
};

inline bool overlap(const SpaceBox& a, const SpaceBox& b) {
  for (int d = 0; d < 3; ++d)
    if (!(a.lower[d] <= b.upper[d] && a.upper[d] >= b.lower[d])) return false;
  return true;
}

/// The box around two.
inline SpaceBox joined(const SpaceBox& a, const SpaceBox& b) {
  SpaceBox both;
  for (int d = 0; d < 3; ++d) {
    both.lower[d] = std::min(a.lower[d], b.lower[d]);
    both.upper[d] = std::max(a.upper[d], b.upper[d]);
  }
  return both;
}

class RankBlocks {
 public:
  /// Every rank calls. @param layers  cells around a rank's own in which it must know of surfaces, at most the halo
  RankBlocks(const Grid& grid, int layers);

  /// The rank in whose block, or nearest to it, a point inside the domain lies, up to a cell or so where blocks differ in size.
  int owner(const Vec3& point) const;
  /// Whether a box reaches into a rank's block and layers.
  bool reaches(const SpaceBox& box, int rank) const;
  /// Around all blocks and their layers.
  const SpaceBox& whole() const { return whole_; }
  int ranks() const { return static_cast<int>(around_.size()); }

 private:
  static constexpr int samples = 8;  // of a block: the middles of its eighths

  std::vector<SpaceBox> around_;  // [rank] its cells and layers
  SpaceBox whole_;
  std::vector<Vec3> samples_;  // [rank * samples]
  PeriodicFrame frame_;
};

}  // namespace corpuscle
