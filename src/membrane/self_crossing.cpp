#include "membrane/self_crossing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

#include "common/vec3.hpp"

namespace corpuscle {

namespace {

struct Box {
  Vec3 lower, upper;
  bool overlaps(const Box& b) const {
    for (int d = 0; d < 3; ++d)
      if (lower[d] > b.upper[d] || b.lower[d] > upper[d]) return false;
    return true;
  }
};

using Corners = std::array<Vec3, 3>;

/// Where the segment from p to q goes through the inside of triangle t. Volumes that rounding may have made do not count.
std::optional<Vec3> pierced(const Vec3& p, const Vec3& q, const Corners& t) {
  const Vec3 edge = q - p, normal = cross(t[1] - t[0], t[2] - t[0]);
  const double above = dot(p - t[0], normal), below = dot(q - t[0], normal);
  const double reach = std::max({norm(edge), norm(t[1] - t[0]), norm(t[2] - t[0])});
  const double rounding = 1e-12 * reach * reach * reach;
  if (std::abs(above) <= rounding || std::abs(below) <= rounding || (above > 0) == (below > 0)) return {};
  double side[3];
  for (int k = 0; k < 3; ++k) side[k] = dot(edge, cross(t[k] - p, t[(k + 1) % 3] - p));
  const bool positive = std::min({side[0], side[1], side[2]}) > rounding;
  const bool negative = std::max({side[0], side[1], side[2]}) < -rounding;
  if (!positive && !negative) return {};
  return p + (above / (above - below)) * edge;
}

/// Neighbours over the edge from a to b, with third corners c and d, that lie flat on each other.
bool folded_flat(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 edge = b - a, one = cross(edge, c - a), other = cross(edge, d - a);
  constexpr double flat = 1e-9;  // rad
  return dot(one, other) > 0 && norm(cross(one, other)) <= flat * norm(one) * norm(other);
}

class Search {
 public:
  explicit Search(const TriangleMesh& mesh) : mesh_(mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Corners k = corners(int(t));
      Box box{k[0], k[0]};
      for (const Vec3& p : k)
        for (int d = 0; d < 3; ++d) box.lower[d] = std::min(box.lower[d], p[d]), box.upper[d] = std::max(box.upper[d], p[d]);
      boxes_.push_back(box);
      for (int d = 0; d < 3; ++d) bin_ += (box.upper[d] - box.lower[d]) / (3.0 * double(mesh.triangles.size()));
    }
    bin_ *= 2;  // so that most triangles touch few bins
  }

  std::optional<Crossing> find() {
    fill_bins();
    std::optional<Crossing> found;
    for (std::size_t s = 0, e = 0; s < entries_.size(); s = e) {
      while (e < entries_.size() && entries_[e].bin == entries_[s].bin) ++e;
      for (std::size_t a = s; a < e; ++a)
        for (std::size_t b = a + 1; b < e; ++b) {
          const int i = entries_[a].triangle, j = entries_[b].triangle;
          if (!boxes_[i].overlaps(boxes_[j])) continue;
          if (found && std::tie(found->first, found->second) <= std::tie(i, j)) continue;
          if (const auto at = crossing(i, j)) found = Crossing{i, j, {at->x, at->y, at->z}};
        }
    }
    return found;
  }

 private:
  struct Entry {
    std::uint64_t bin;
    int triangle;
    bool operator<(const Entry& b) const { return std::tie(bin, triangle) < std::tie(b.bin, b.triangle); }
  };

  Corners corners(int t) const {
    Corners k;
    for (int c = 0; c < 3; ++c) {
      const Triple& p = mesh_.vertices[mesh_.triangles[t][c]];
      k[c] = {p[0], p[1], p[2]};
    }
    return k;
  }

  static double far_side(const Vec3& size) { return std::max({size.x, size.y, size.z}); }

  /// An upper bound for the bins that all triangles touch together.
  double count_entries() const {
    double count = 0;
    for (const Box& box : boxes_) {
      double own = 1;
      for (int d = 0; d < 3; ++d) own *= 2 + (box.upper[d] - box.lower[d]) / bin_;
      count += own;
    }
    return count;
  }

  void fill_bins() {
    if (boxes_.empty() || !(bin_ > 0)) return;
    Vec3 origin = boxes_[0].lower, far = origin;
    for (const Box& box : boxes_)
      for (int d = 0; d < 3; ++d) origin[d] = std::min(origin[d], box.lower[d]), far[d] = std::max(far[d], box.upper[d]);
    // Surfaces of unlike triangles: larger bins, until the large ones do not touch too many.
    const double most = 64.0 * double(boxes_.size()) + 4096;
    while (count_entries() > most || far_side(far - origin) > 1000 * bin_) bin_ *= 1.5;
    const auto place = [&](double x, int d) { return std::uint64_t((x - origin[d]) / bin_); };
    for (int t = 0; t < int(boxes_.size()); ++t) {
      std::uint64_t low[3], high[3];
      for (int d = 0; d < 3; ++d) low[d] = place(boxes_[t].lower[d], d), high[d] = place(boxes_[t].upper[d], d);
      for (std::uint64_t i = low[0]; i <= high[0]; ++i)
        for (std::uint64_t j = low[1]; j <= high[1]; ++j)
          for (std::uint64_t k = low[2]; k <= high[2]; ++k) entries_.push_back({(i * 1024 + j) * 1024 + k, t});
    }
    std::sort(entries_.begin(), entries_.end());
  }

  std::optional<Vec3> crossing(int i, int j) const {
    const auto &a = mesh_.triangles[i], &b = mesh_.triangles[j];
    const Corners ka = corners(i), kb = corners(j);
    int shared = 0, alone_a = 0, alone_b = 0;
    for (int k = 0; k < 3; ++k) {
      if (std::find(b.begin(), b.end(), a[k]) == b.end())
        alone_a = k;
      else
        ++shared;
      if (std::find(a.begin(), a.end(), b[k]) == a.end()) alone_b = k;
    }
    if (shared >= 2) {
      const Vec3 &from = ka[(alone_a + 1) % 3], &to = ka[(alone_a + 2) % 3];
      if (shared == 2 && folded_flat(from, to, ka[alone_a], kb[alone_b])) return 0.5 * (from + to);
      return {};
    }
    for (int k = 0; k < 3; ++k) {
      if (const auto at = pierced(ka[k], ka[(k + 1) % 3], kb)) return at;
      if (const auto at = pierced(kb[k], kb[(k + 1) % 3], ka)) return at;
    }
    return {};
  }

  const TriangleMesh& mesh_;
  std::vector<Box> boxes_;
  std::vector<Entry> entries_;
  double bin_ = 0;
};

/// By a billionth of its largest coordinate, the same each time: edges that met edges exactly, as those of a symmetric mesh do, go
/// past each other then or through each other's triangles.
TriangleMesh shaken(TriangleMesh mesh) {
  double largest = 0;
  for (const Triple& p : mesh.vertices)
    for (const double c : p) largest = std::max(largest, std::abs(c));
  std::uint64_t state = 1;
  for (Triple& p : mesh.vertices)
    for (double& c : p) {
      state = 6364136223846793005u * state + 1442695040888963407u;
      c += 1e-9 * largest * (static_cast<double>(state >> 11) * 0x1p-53 - 0.5);
    }
  return mesh;
}

}  // namespace

std::optional<Crossing> find_self_crossing(const TriangleMesh& mesh) {
  const auto crossing = Search(mesh).find();
  return crossing ? crossing : Search(shaken(mesh)).find();
}

}  // namespace corpuscle
