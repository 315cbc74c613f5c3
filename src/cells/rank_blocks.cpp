#include "cells/rank_blocks.hpp"

#include <algorithm>
#include <cmath>

#include "coupling/periodic_frame.hpp"
#include "immersed/lattice.hpp"

namespace corpuscle {

std::vector<std::array<int, 3>> period_turns(const Grid& grid, int most) {
  const IndexSpace& index = grid.index();
  std::vector<std::array<int, 3>> turns;
  for (int far = 1; far <= most; ++far) {
    const int width = 2 * far + 1;
    for (int k = 0; k < width * width * width; ++k) {
      const std::array<int, 3> step{(k % width + far) % width - far, (k / width % width + far) % width - far,
                                    (k / width / width + far) % width - far};
      int furthest = 0;
      bool allowed = true;
      for (int d = 0; d < 3; ++d) {
        allowed = allowed && (step[d] == 0 || index.periodic[d]);
        furthest = std::max(furthest, std::abs(step[d]));
      }
      if (allowed && (furthest == far || (k == 0 && far == 1))) turns.push_back(step);
    }
  }
  return turns;
}

std::vector<Vec3> period_shifts(const Grid& grid, int most) {
  std::vector<Vec3> shifts;
  for (const auto& turns : period_turns(grid, most)) {
    Vec3 shift;
    for (int d = 0; d < 3; ++d)
      for (int m = 0; m < 3; ++m) shift[m] += turns[d] * grid.period(d)[m];
    shifts.push_back(shift);
  }
  return shifts;
}

RankBlocks::RankBlocks(const Grid& grid, int layers) : frame_(periodic_frame(grid)) {
  const Lattice lattice = make_lattice(grid.views());
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), lattice.x);
  const IndexSpace& index = lattice.index;
  const int rank = grid.comm().rank(), ranks = grid.comm().size();
  constexpr int numbers = 6 + 3 * samples;
  std::vector<double> all(static_cast<std::size_t>(numbers) * ranks, 0.0);
  double* mine = all.data() + static_cast<std::size_t>(numbers) * rank;
  for (int d = 0; d < 3; ++d) mine[d] = 1e300, mine[3 + d] = -1e300;
  int low[3], high[3];
  for (int d = 0; d < 3; ++d) {
    low[d] = std::max(lattice.lower[d], -layers);
    high[d] = std::min(lattice.upper[d], index.n[d] - 1 + layers);
  }
  for (int k = low[2]; k <= high[2]; ++k)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int i = low[0]; i <= high[0]; ++i)
        for (int d = 0; d < 3; ++d) {
          const double at = x(lattice.node(i, j, k), d);
          mine[d] = std::min(mine[d], at);
          mine[3 + d] = std::max(mine[3 + d], at);
        }
  for (int s = 0; s < samples; ++s) {
    int at[3];
    for (int d = 0; d < 3; ++d) at[d] = index.n[d] * (s >> d & 1 ? 3 : 1) / 4;
    for (int d = 0; d < 3; ++d) mine[6 + 3 * s + d] = x(lattice.node(at[0], at[1], at[2]), d);
  }
  grid.comm().sum(all.data(), static_cast<int>(all.size()));
  for (int r = 0; r < ranks; ++r) {
    const double* one = all.data() + static_cast<std::size_t>(numbers) * r;
    around_.push_back({{one[0], one[1], one[2]}, {one[3], one[4], one[5]}});
    whole_ = r == 0 ? around_[r] : joined(whole_, around_[r]);
    for (int s = 0; s < samples; ++s) samples_.push_back({one[6 + 3 * s], one[7 + 3 * s], one[8 + 3 * s]});
  }
}

int RankBlocks::owner(const Vec3& point) const {
  double least = 1e300;
  std::size_t nearest = 0;
  for (std::size_t s = 0; s < samples_.size(); ++s) {
    Vec3 away = point - samples_[s];
    for (int d = 0; d < 3; ++d) away -= std::round(dot(away, frame_.dual[d])) * frame_.period[d];
    const double distance = dot(away, away);
    if (distance < least) least = distance, nearest = s;
  }
  return static_cast<int>(nearest / samples);
}

bool RankBlocks::reaches(const SpaceBox& box, int rank) const { return overlap(box, around_[rank]); }

}  // namespace corpuscle
