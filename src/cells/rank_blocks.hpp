// Which rank a place belongs to, and which ranks' blocks a cell reaches into.
#pragma once

#include <array>
#include <vector>

#include "grid/grid.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

/// How many periods along each direction the shifts are under which cells are seen: the identity first, then all by one period or
/// none along each direction. And the shifts themselves, um.
std::vector<std::array<int, 3>> period_turns(const Grid& grid);
std::vector<Vec3> period_shifts(const Grid& grid);

struct SpaceBox {
  Vec3 lower, upper;
};

inline bool overlap(const SpaceBox& a, const SpaceBox& b) {
  for (int d = 0; d < 3; ++d)
    if (!(a.lower[d] <= b.upper[d] && a.upper[d] >= b.lower[d])) return false;
  return true;
}

class RankBlocks {
 public:
  /// Every rank calls. @param layers  cells around a rank's own in which it must know of surfaces, at most the halo
  RankBlocks(const Grid& grid, int layers);

  /// The rank in whose block, or nearest to it, a point inside the domain lies, up to a cell or so where blocks differ in size.
  int owner(const Vec3& point) const;
  /// Whether a box reaches into a rank's block and layers.
  bool reaches(const SpaceBox& box, int rank) const;
  int ranks() const { return static_cast<int>(around_.size()); }

 private:
  static constexpr int samples = 8;  // of a block: the middles of its eighths

  std::vector<SpaceBox> around_;     // [rank] its cells and layers
  std::vector<Vec3> samples_;   // [rank * samples]
  PeriodicFrame frame_;
};

}  // namespace corpuscle
