#include "grid/tube_checks.hpp"

#include "common/vec3.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace corpuscle {

namespace {

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

/// Places along the centreline, found by where they are in space.
class Sections {
 public:
  Sections(const Centerline& line, double radius) : line_(line), radius_(radius) {
    constexpr int most = 50000;
    count_ = std::clamp(static_cast<int>(4 * line.length() / radius), 64, most);
    step_ = line.length() / count_;
    bin_ = radius + step_;
    for (int m = 0; m <= count_; ++m) {
      frames_.push_back(line.at(m * step_));
      const Triple& p = frames_.back().position;
      bins_[key(place(p[0]), place(p[1]), place(p[2]))].push_back(m);
    }
  }

  int count() const { return count_; }
  const Centerline::Frame& frame(int m) const { return frames_[m]; }

  /// Another place along the line whose cross-section holds the point, which belongs to that of place `own`; -1 if none.
  /// @param within  of the radius: nearer to that place's centre than this share
  int section_around(const Vec3& point, int own, double within) const {
    const std::int64_t at[3] = {place(point.x), place(point.y), place(point.z)};
    for (std::int64_t i = at[0] - 1; i <= at[0] + 1; ++i)
      for (std::int64_t j = at[1] - 1; j <= at[1] + 1; ++j)
        for (std::int64_t k = at[2] - 1; k <= at[2] + 1; ++k) {
          const auto found = bins_.find(key(i, j, k));
          if (found == bins_.end()) continue;
          for (int m : found->second)
            if (m < count_ && std::abs(m - own) * step_ > 0.5 * radius_ && holds(m, point, within)) return m;
        }
    return -1;
  }

 private:
  /// Whether the plane across the line goes through the point somewhere between places m and m + 1, near the line.
  bool holds(int m, const Vec3& point, double within) const {
    const auto &a = frames_[m], &b = frames_[m + 1];
    const Vec3 from = point - vec(a.position), to = point - vec(b.position);
    const double ahead = dot(from, vec(a.tangent)), behind = dot(to, vec(b.tangent));
    if (ahead < 0 || behind > 0) return false;
    const double s = ahead > behind ? ahead / (ahead - behind) : 0;
    return norm((1 - s) * from + s * to) < within * radius_;
  }
  std::int64_t place(double x) const { return static_cast<std::int64_t>(std::floor(x / bin_)); }
  static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    constexpr std::int64_t half = 1 << 20;
    return (std::uint64_t(i + half) << 42) | (std::uint64_t(j + half) << 21) | std::uint64_t(k + half);
  }

  const Centerline& line_;
  double radius_, step_ = 0, bin_ = 0;
  int count_ = 0;
  std::vector<Centerline::Frame> frames_;
  std::unordered_map<std::uint64_t, std::vector<int>> bins_;
};

std::string text(const Triple& p) { return fmt::format("({:.4g}, {:.4g}, {:.4g}) um", p[0], p[1], p[2]); }

double tightest_bend(const Centerline& line) {
  constexpr int samples = 4000;
  const double step = line.length() / samples;
  double sharpest = 0, where = 0;
  for (int m = 1; m < samples; ++m) {
    const double turn = norm(vec(line.at((m + 1) * step).tangent) - vec(line.at((m - 1) * step).tangent));
    if (turn > sharpest) sharpest = turn, where = m * step;
  }
  return where;
}

}  // namespace

void check_tube(const Centerline& line, double diameter_um) {
  constexpr double tightest = 0.95;  // radius of the tube over that of the bend
  const double radius = 0.5 * diameter_um;
  if (line.largest_curvature() * radius >= tightest)
    throw InputError(fmt::format(
        "grid: the centreline bends with a radius of {:.3g} um at {}, too tight for a tube of {:.3g} um diameter: the grid would "
        "fold. Use a radius of curvature above {:.3g} um (grid.points_um, grid.arc_radius_um, grid.helix_radius_um) or a smaller "
        "grid.diameter_um",
        1 / line.largest_curvature(), text(line.at(tightest_bend(line)).position), diameter_um, 1.1 * radius));

  // The tube runs through itself where points of one cross-section lie in another. Those on the rim count from a little
  // inside on, since the wall of a bent tube is known to the square of the step between places.
  constexpr int points = 16;
  constexpr double rim = 0.99;
  const Sections sections(line, radius);
  for (int m = 0; m <= sections.count(); ++m) {
    const auto& f = sections.frame(m);
    int other = sections.section_around(vec(f.position), m, 1);
    for (int p = 0; p < points && other < 0; ++p) {
      const double angle = 2 * std::acos(-1.0) * p / points;
      const Vec3 on_rim = vec(f.position) + radius * (std::cos(angle) * vec(f.normal) + std::sin(angle) * vec(f.binormal));
      other = sections.section_around(on_rim, m, rim);
    }
    if (other < 0) continue;
    throw InputError(fmt::format(
        "grid: the tube of {:.3g} um diameter runs through itself: its centreline comes back to {}, {:.3g} um from where it was at "
        "{}. Lead the centreline further apart (grid.points_um, grid.helix_pitch_um) or use a smaller grid.diameter_um",
        diameter_um, text(sections.frame(other).position), norm(vec(sections.frame(other).position) - vec(f.position)), text(f.position)));
  }
}

}  // namespace corpuscle
