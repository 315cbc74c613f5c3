#include "populations/packing_walls.hpp"

#include <algorithm>
#include <cmath>

#include "immersed/triangle.hpp"

namespace corpuscle {

namespace {

constexpr double patch_um = 1;  // chords of this length lie 0.036 um off the wall of a tube of 7 um, on the fluid's side

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

/// Nodes beyond periodic sides too.
Vec3 node_of(const NodeSource& source, const PeriodicFrame& frame, const int (&index)[3]) {
  int at[3];
  Vec3 shift;
  for (int d = 0; d < 3; ++d) {
    const int n = source.cells[d];
    int turns = 0;
    if (frame.periodic[d] && (index[d] < 0 || index[d] > n)) turns = static_cast<int>(std::floor(double(index[d]) / n));
    at[d] = index[d] - turns * n;
    shift += double(turns) * frame.period[d];
  }
  return vec(source.node(at[0], at[1], at[2])) + shift;
}

/// Node numbers along a direction: every so many that they are about `patch` apart, and for periodic ones some beyond both ends.
std::vector<int> stations(const NodeSource& source, const PeriodicFrame& frame, int d, int (&at)[3], double patch, double beyond) {
  const int n = source.cells[d];
  double length = 0;
  for (int i = 0; i < n; ++i) {
    at[d] = i;
    const Vec3 a = node_of(source, frame, at);
    at[d] = i + 1;
    length += norm(node_of(source, frame, at) - a);
  }
  const int stride = std::clamp(static_cast<int>(patch * n / length), 1, n);
  const int more = frame.periodic[d] ? std::min(n, static_cast<int>(std::ceil(beyond * n / length)) + stride) : 0;
  std::vector<int> numbers;
  for (int i = 0; i < n; i += stride) numbers.push_back(i);
  numbers.push_back(n);
  if (more == 0) return numbers;
  std::vector<int> all;
  for (int i : numbers)
    if (i - n >= -more && i < n) all.push_back(i - n);
  all.insert(all.end(), numbers.begin(), numbers.end());
  for (int i : numbers)
    if (i > 0 && i <= more) all.push_back(i + n);
  return all;
}

}  // namespace

PackingWalls::PackingWalls(const GridSettings& grid, const NodeSource& source, const PeriodicFrame& frame, double reach)
    : frame_(frame), reach_(reach), width_(patch_um) {
  const bool plane = grid.generator == GridSettings::Generator::box;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2 && !frame.periodic[d]; ++end) add_side(source, d, end, plane ? 20 * width_ : patch_um);
  sort();
}

void PackingWalls::add_side(const NodeSource& source, int d, int end, double patch) {
  const int e = (d + 1) % 3, f = (d + 2) % 3;
  int at[3] = {source.cells[0] / 2, source.cells[1] / 2, source.cells[2] / 2};
  at[d] = end == 0 ? 0 : source.cells[d];
  int along[3] = {at[0], at[1], at[2]};
  const auto rows = stations(source, frame_, f, along, patch, 2 * (width_ + reach_));
  std::copy(at, at + 3, along);
  const auto columns = stations(source, frame_, e, along, patch, 2 * (width_ + reach_));
  const auto point = [&](int column, int row) {
    int index[3];
    index[d] = at[d], index[e] = column, index[f] = row;
    return node_of(source, frame_, index);
  };
  for (std::size_t r = 0; r + 1 < rows.size(); ++r)
    for (std::size_t c = 0; c + 1 < columns.size(); ++c) {
      const Vec3 x[4] = {point(columns[c], rows[r]), point(columns[c + 1], rows[r]), point(columns[c + 1], rows[r + 1]),
                         point(columns[c], rows[r + 1])};
      // Grids are right-handed, so that this points along +d.
      const Vec3 up = cross(x[2] - x[0], x[3] - x[1]), inward = end == 0 ? up : -up;
      add(x[0], x[1], x[2], inward);
      add(x[0], x[2], x[3], inward);
    }
}

void PackingWalls::add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& inward) {
  const Vec3 n = cross(b - a, c - a);
  const double length = norm(n);
  if (!(length > 0)) return;
  triangles_.push_back({a, b, c, (dot(n, inward) > 0 ? 1 / length : -1 / length) * n});
}

int PackingWalls::along(double x) const { return static_cast<int>(std::floor(x / width_)); }

void PackingWalls::sort() {
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Triangle& s = triangles_[t];
    int low[3], high[3];
    for (int d = 0; d < 3; ++d) {
      low[d] = along(std::min({s.a[d], s.b[d], s.c[d]}) - reach_);
      high[d] = along(std::max({s.a[d], s.b[d], s.c[d]}) + reach_);
    }
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i) bins_[key(i, j, k)].push_back(static_cast<int>(t));
  }
}

/// The same place within the domain.
Vec3 PackingWalls::home(const Vec3& p) const {
  Vec3 q = p;
  for (int d = 0; d < 3; ++d)
    if (frame_.periodic[d]) q -= std::floor(dot(p - frame_.origin, frame_.dual[d])) * frame_.period[d];
  return q;
}

bool PackingWalls::distance(const Vec3& point, double& value, Vec3& gradient) const {
  const Vec3 p = home(point);
  double least = reach_ * reach_;
  Vec3 away, inward;
  const auto bin = bins_.find(key(along(p.x), along(p.y), along(p.z)));
  if (bin == bins_.end()) return false;
  for (int t : bin->second) {
    const Triangle& s = triangles_[t];
    const double height = dot(p - s.a, s.normal);
    if (height * height > least) continue;
    const TrianglePoint at = closest_on_triangle(p, s.a, s.b, s.c);
    const Vec3 r = p - (at.weight[0] * s.a + at.weight[1] * s.b + at.weight[2] * s.c);
    const double square = dot(r, r);
    if (square > least) continue;
    const bool tied = square > least * (1 - 1e-9) - 1e-18;  // at an edge of several: their mean has the right sign
    inward = tied ? inward + s.normal : s.normal;
    least = std::min(least, square), away = r;
  }
  if (least >= reach_ * reach_) return false;
  const double distance = std::sqrt(least), length = norm(inward);
  const bool beyond = dot(away, inward) < 0;
  value = beyond ? -distance : distance;
  gradient = distance > 1e-9 ? ((beyond ? -1 : 1) / distance) * away : (1 / std::max(length, 1e-12)) * inward;
  return true;
}

bool PackingWalls::near(const Vec3& point, double radius) const {
  if (none()) return false;
  const Vec3 p = home(point);
  const double beyond = std::max(0.0, radius - reach_);  // bins know of sides within the reach
  int low[3], high[3];
  for (int d = 0; d < 3; ++d) low[d] = along(p[d] - beyond), high[d] = along(p[d] + beyond);
  for (int k = low[2]; k <= high[2]; ++k)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int i = low[0]; i <= high[0]; ++i)
        if (bins_.count(key(i, j, k))) return true;
  return false;
}

}  // namespace corpuscle
