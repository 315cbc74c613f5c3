#include "membrane/surface_shape.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr double pi = 3.14159265358979323846;

/// Position, in entries, at which the increasing table reaches `value`.
double inverse(const std::vector<double>& table, double value) {
  const auto upper = std::upper_bound(table.begin(), table.end(), value);
  if (upper == table.begin()) return 0;
  if (upper == table.end()) return double(table.size() - 1);
  const auto lower = upper - 1;
  return double(lower - table.begin()) + (value - *lower) / (*upper - *lower);
}

}  // namespace

/// The latitude further by a small angle (its tangent is taken for it), between the poles.
RevolvedShape::Latitude RevolvedShape::turned(const Latitude& from, double angle) {
  const double s = from.sin + angle * from.cos, c = from.cos - angle * from.sin;
  if (s <= 0) return {0, c < 0 ? -1.0 : 1.0};
  const double scale = 1 / std::sqrt(s * s + c * c);
  return {scale * s, scale * c};
}

void RevolvedShape::tabulate() {
  const int entries = 4001;
  share_.assign(entries, 0);
  const double step = pi / (entries - 1);
  for (int e = 1; e < entries; ++e) {
    const Meridian m = meridian(latitude((e - 0.5) * step));
    share_[e] = share_[e - 1] + 2 * pi * m.r * std::hypot(m.dr, m.dz) * step;
    volume_ -= pi * m.r * m.r * m.dz * step;
  }
  area_ = share_.back();
  for (double& s : share_) s /= area_;
  // The meridian by its direction from the centre, of which it is a function since the surface is star-like.
  std::vector<double> bearing(entries);
  for (int e = 0; e < entries; ++e) {
    const Meridian m = meridian(latitude(e * step));
    bearing[e] = 1 - m.z / (std::abs(m.z) + m.r);
  }
  const int directions = 1025;
  for (int d = 0; d < directions; ++d) seen_.push_back(latitude(inverse(bearing, 2.0 * d / (directions - 1)) * step));
}

Vec3 RevolvedShape::from_sphere(const Vec3& direction) const {
  const double phi = inverse(share_, 0.5 * (1 - direction.z)) * pi / double(share_.size() - 1);
  const Meridian m = meridian(latitude(phi));
  const double ring = std::hypot(direction.x, direction.y);
  if (ring == 0) return {0, 0, m.z};
  return {m.r * direction.x / ring, m.r * direction.y / ring, m.z};
}

RevolvedShape::Latitude RevolvedShape::closest(double r, double z) const {
  const double size = std::abs(z) + r;
  const double entry = size > 0 ? 0.5 * (1 - z / size) * double(seen_.size() - 1) : 0;
  const std::size_t below = std::min(std::size_t(entry), seen_.size() - 2);
  const double part = entry - double(below);
  Latitude at = turned({seen_[below].sin + part * (seen_[below + 1].sin - seen_[below].sin),
                        seen_[below].cos + part * (seen_[below + 1].cos - seen_[below].cos)},
                       0);
  // Newton on the derivative of the squared distance, from the point in the same direction from the centre.
  for (int i = 0; i < 6; ++i) {
    const Meridian m = meridian(at);
    const double slope = (m.r - r) * m.dr + (m.z - z) * m.dz;
    const double curvature = m.dr * m.dr + m.dz * m.dz + (m.r - r) * m.ddr + (m.z - z) * m.ddz;
    if (!(curvature > 0)) break;
    const double change = slope / curvature;
    at = turned(at, -change);
    if (std::abs(change) < 1e-8) break;  // squared, the error after the step
  }
  return at;
}

Vec3 RevolvedShape::project(const Vec3& point) const {
  const double r = std::sqrt(point.x * point.x + point.y * point.y);
  const Meridian m = meridian(closest(r, point.z));
  if (r == 0) return {m.r, 0, m.z};
  return {m.r * point.x / r, m.r * point.y / r, m.z};
}

Vec3 RevolvedShape::to_sphere(const Vec3& point) const {
  const double r = std::sqrt(point.x * point.x + point.y * point.y);
  const Latitude at = closest(r, point.z);
  const double entry = std::atan2(at.sin, at.cos) / pi * double(share_.size() - 1);
  const std::size_t below = std::min(std::size_t(entry), share_.size() - 2);
  const double share = share_[below] + (entry - double(below)) * (share_[below + 1] - share_[below]);
  const double z = 1 - 2 * share, ring = std::sqrt(std::max(0.0, 1 - z * z));
  if (r == 0) return {0, 0, z < 0 ? -1.0 : 1.0};
  return {ring * point.x / r, ring * point.y / r, z};
}

RevolvedShape::Meridian BiconcaveShape::meridian(const Latitude& latitude) const {
  const auto [s, c] = latitude;
  const double q = 0.25 * s * s, dq = 0.5 * s * c, ddq = 0.5 * (c * c - s * s);
  const double f = a0 + q * (a1 + q * a2), df = a1 + 2 * a2 * q;
  const double f1 = df * dq, f2 = 2 * a2 * dq * dq + df * ddq;  // derivatives of f to phi
  return {0.5 * D0 * s, D0 * c * f, 0.5 * D0 * c, D0 * (-s * f + c * f1), -0.5 * D0 * s, D0 * (-c * f - 2 * s * f1 + c * f2)};
}

EllipsoidShape::EllipsoidShape(const Triple& semi_axes) : axes_{semi_axes[0], semi_axes[1], semi_axes[2]} {
  // Area by latitude: the surface element in (u = cos latitude, longitude), integrated over longitude.
  const int entries = 2001, around = 64;
  share_.assign(entries, 0);
  for (int e = 1; e < entries; ++e) {
    const double u = 1 - 2 * (e - 0.5) / (entries - 1), s2 = 1 - u * u;
    double ring = 0;
    for (int k = 0; k < around; ++k) {
      const double psi = 2 * pi * (k + 0.5) / around;
      const double x = axes_.y * axes_.z * std::cos(psi), y = axes_.x * axes_.z * std::sin(psi);
      ring += std::sqrt(s2 * (x * x + y * y) + u * u * axes_.x * axes_.x * axes_.y * axes_.y);
    }
    share_[e] = share_[e - 1] + ring * (2 * pi / around) * 2 / (entries - 1);
  }
  area_ = share_.back();
  volume_ = 4 * pi / 3 * axes_.x * axes_.y * axes_.z;
  for (double& s : share_) s /= area_;
}

Vec3 EllipsoidShape::from_sphere(const Vec3& direction) const {
  const double u = std::clamp(1 - 2 * inverse(share_, 0.5 * (1 - direction.z)) / double(share_.size() - 1), -1.0, 1.0);
  const double ring = std::hypot(direction.x, direction.y), s = std::sqrt(1 - u * u);
  if (ring == 0) return {0, 0, axes_.z * u};
  return {axes_.x * s * direction.x / ring, axes_.y * s * direction.y / ring, axes_.z * u};
}

Vec3 EllipsoidShape::project(const Vec3& point) const {
  // Closest point p = x / (1 + t/a^2), where sum (a x / (a^2 + t))^2 = 1. That sum falls and is convex in t, and it is
  // at least 1 at the start below, so Newton's method approaches the root from the left without overshooting.
  double t = -1e300;
  for (int d = 0; d < 3; ++d) t = std::max(t, axes_[d] * (std::abs(point[d]) - axes_[d]));
  for (int i = 0; i < 60; ++i) {
    double value = -1, slope = 0;
    for (int d = 0; d < 3; ++d) {
      const double a2 = axes_[d] * axes_[d], w = axes_[d] * point[d] / (a2 + t);
      value += w * w;
      slope -= 2 * w * w / (a2 + t);
    }
    if (slope == 0) break;
    const double change = value / slope;
    t -= change;
    if (std::abs(change) < 1e-15 * axes_.x * axes_.x) break;
  }
  Vec3 p;
  for (int d = 0; d < 3; ++d) p[d] = point[d] / (1 + t / (axes_[d] * axes_[d]));
  return p;
}

}  // namespace corpuscle
