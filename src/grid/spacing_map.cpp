#include "grid/spacing_map.hpp"

#include "common/vec3.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

}  // namespace

double NodeSteps::along(int d, const Triple& n) const {
  double sum = 0;
  for (int m = 0; m < 6; ++m) sum += (m < 3 ? 1 : 2) * square[d][m] * n[pairs[m][0]] * n[pairs[m][1]];
  return sum;
}

double NodeSteps::spacing(const Triple& n) const { return std::sqrt(along(0, n) + along(1, n) + along(2, n)); }

SpacingMap::SpacingMap(const Grid& grid) : sums_(std::size_t(bins) * bins * bins * columns, 0) {
  const auto& nodes = grid.owned_nodes();
  double corners[6];
  for (int m = 0; m < 3; ++m) corners[m] = corners[3 + m] = -1e300;
  for (std::size_t e = 0; e < nodes.size(); ++e) {
    const int m = static_cast<int>(e % 3);
    corners[m] = std::max(corners[m], -nodes[e]), corners[3 + m] = std::max(corners[3 + m], nodes[e]);
  }
  grid.comm().max(corners, 6);
  for (int m = 0; m < 3; ++m) lower_[m] = -corners[m], upper_[m] = corners[3 + m];

  const IndexSpace& index = grid.index();
  const auto node = [&](int i, int j, int k) {
    const double* x = nodes.data() + 3 * (i + (index.n[0] + 1) * (j + std::size_t(index.n[1] + 1) * k));
    return Vec3{x[0], x[1], x[2]};
  };
  // Enough cells for means: of a large grid not every one.
  constexpr double enough = 3e5;
  const int step = std::max(1, static_cast<int>(std::cbrt(index.owned() / enough)));
  for (int k = 0; k < index.n[2]; k += step)
    for (int j = 0; j < index.n[1]; j += step)
      for (int i = 0; i < index.n[0]; i += step) {
        Vec3 centre, tangent[3];
        for (int m = 0; m < 8; ++m) {
          const int offset[3] = {m & 1, (m >> 1) & 1, (m >> 2) & 1};
          const Vec3 x = node(i + offset[0], j + offset[1], k + offset[2]);
          centre += 0.125 * x;
          for (int d = 0; d < 3; ++d) tangent[d] += (offset[d] ? 0.25 : -0.25) * x;
        }
        double* own = sums_.data() + columns * (bin(centre.x, 0) + bins * (bin(centre.y, 1) + bins * std::size_t(bin(centre.z, 2))));
        own[0] += 1;
        for (int d = 0; d < 3; ++d)
          for (int m = 0; m < 6; ++m) own[1 + 6 * d + m] += tangent[d][pairs[m][0]] * tangent[d][pairs[m][1]];
      }
  grid.comm().sum(sums_.data(), static_cast<int>(sums_.size()));
}

int SpacingMap::bin(double x, int d) const {
  return std::clamp(static_cast<int>(bins * (x - lower_[d]) / (upper_[d] - lower_[d])), 0, bins - 1);
}

NodeSteps SpacingMap::near(const Triple& lower, const Triple& upper) const {
  int low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = bin(lower[d], d), high[d] = bin(upper[d], d);
  double total[columns] = {};
  const auto add = [&](int i, int j, int k) {
    const double* own = sums_.data() + columns * (i + bins * (j + std::size_t(bins) * k));
    for (int m = 0; m < columns; ++m) total[m] += own[m];
  };
  for (int k = low[2]; k <= high[2]; ++k)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int i = low[0]; i <= high[0]; ++i) add(i, j, k);
  if (total[0] == 0)
    for (int k = 0; k < bins; ++k)
      for (int j = 0; j < bins; ++j)
        for (int i = 0; i < bins; ++i) add(i, j, k);
  NodeSteps steps;
  for (int d = 0; d < 3; ++d)
    for (int m = 0; m < 6; ++m) steps.square[d][m] = total[1 + 6 * d + m] / total[0];
  return steps;
}

}  // namespace corpuscle
