#include "grid/generators.hpp"

#include "grid/node_file.hpp"
#include "grid/tube_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace corpuscle {

namespace {

Triple operator+(const Triple& a, const Triple& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Triple operator-(const Triple& a, const Triple& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Triple operator*(double s, const Triple& a) { return {s * a[0], s * a[1], s * a[2]}; }
double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Triple cross(const Triple& a, const Triple& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Triple unit(const Triple& a) { return (1 / std::sqrt(dot(a, a))) * a; }

/// Integral of 1 / sqrt(1 + sin^2) from 0 to phi: the arc length of the lemniscate at sin(phi). Ten-point Gauss rule on
/// eight pieces, exact to rounding for phi up to pi / 2.
double lemniscate_arc(double phi) {
  static constexpr double node[5] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717};
  static constexpr double weight[5] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159820, 0.1494513491505806, 0.0666713443086881};
  constexpr int pieces = 8;
  double sum = 0;
  const double half = phi / (2 * pieces);
  for (int p = 0; p < pieces; ++p)
    for (int m = 0; m < 5; ++m)
      for (double side : {-1.0, 1.0}) {
        const double s = std::sin(half * (2 * p + 1 + side * node[m]));
        sum += half * weight[m] / std::sqrt(1 + s * s);
      }
  return sum;
}

/// Lemniscate sine and its derivative on the real interval between its zeros' midpoints.
struct Lemniscate {
  double sine, slope;
  explicit Lemniscate(double x) {
    double phi = x;
    for (int it = 0; it < 50; ++it) {
      const double s = std::sin(phi), step = (lemniscate_arc(phi) - x) * std::sqrt(1 + s * s);
      phi -= step;
      if (std::abs(step) < 1e-15) break;
    }
    const double s = std::sin(phi);
    sine = s;
    slope = std::cos(phi) * std::sqrt(1 + s * s);
  }
};

std::array<double, 2> conformal_disk(double u, double v) {
  static const double quarter = lemniscate_arc(std::acos(0.0));
  using Complex = std::complex<double>;
  const Complex turn = std::polar(1.0, std::acos(0.0) / 2);
  const Complex w = Complex(u, v) / turn * (quarter / std::sqrt(2.0));
  const Lemniscate a(w.real()), b(w.imag());
  // Addition theorem of the lemniscate sine, with sl(i y) = i sl(y).
  const Complex sl = Complex(a.sine * b.slope, b.sine * a.slope) / (1 - a.sine * a.sine * b.sine * b.sine);
  const Complex z = turn * sl;
  return {z.real(), z.imag()};
}

NodeSource box(const GridSettings& s) {
  const std::array<int, 3> cells{s.nodes[0] - 1, s.nodes[1] - 1, s.nodes[2] - 1};
  const Triple lower = s.lower_um, upper = s.upper_um;
  return {cells, [=](int i, int j, int k) {
            const int at[3] = {i, j, k};
            Triple x;
            for (int d = 0; d < 3; ++d) x[d] = lower[d] + (upper[d] - lower[d]) * at[d] / cells[d];
            return x;
          }};
}

/// Disk points of every cross-section node, so that the map is evaluated once and not for every k.
std::vector<std::array<double, 2>> disk_points(const GridSettings& s) {
  std::vector<std::array<double, 2>> disk;
  for (int j = 0; j < s.nodes[1]; ++j)
    for (int i = 0; i < s.nodes[0]; ++i) {
      auto p = square_to_disk(-1 + 2.0 * i / (s.nodes[0] - 1), -1 + 2.0 * j / (s.nodes[1] - 1), s.cross_section);
      for (double& value : p) value *= 0.5 * s.diameter_um;
      disk.push_back(p);
    }
  return disk;
}

NodeSource straight_tube(const GridSettings& s) {
  const std::array<int, 3> cells{s.nodes[0] - 1, s.nodes[1] - 1, s.nodes[2] - 1};
  return {cells, [disk = disk_points(s), cells, length = s.length_um](int i, int j, int k) {
            const auto& p = disk[i + (cells[0] + 1) * j];
            return Triple{p[0], p[1], length * (static_cast<double>(k) / cells[2] - 0.5)};
          }};
}

NodeSource swept_tube(const GridSettings& s) {
  const std::array<int, 3> cells{s.nodes[0] - 1, s.nodes[1] - 1, s.nodes[2] - 1};
  const Centerline line(s);
  check_tube(line, s.diameter_um);
  std::vector<Centerline::Frame> sections;
  for (int k = 0; k <= cells[2]; ++k) sections.push_back(line.at(line.length() * k / cells[2]));
  return {cells, [disk = disk_points(s), cells, sections](int i, int j, int k) {
            const auto& p = disk[i + (cells[0] + 1) * j];
            const auto& f = sections[k];
            return f.position + p[0] * f.normal + p[1] * f.binormal;
          }};
}

/// Natural cubic spline through points, parametrised by chord length.
class Spline {
 public:
  explicit Spline(const std::vector<Triple>& points) : p_(points) {
    const int n = static_cast<int>(p_.size());
    t_.assign(n, 0);
    for (int i = 1; i < n; ++i) {
      const Triple d = p_[i] - p_[i - 1];
      t_[i] = t_[i - 1] + std::sqrt(dot(d, d));
    }
    m_.assign(n, Triple{});
    std::vector<double> c(n, 0);
    for (int i = 1; i + 1 < n; ++i) {  // Thomas algorithm for the second derivatives
      const double h0 = t_[i] - t_[i - 1], h1 = t_[i + 1] - t_[i];
      const Triple rhs = 6 * ((1 / h1) * (p_[i + 1] - p_[i]) - (1 / h0) * (p_[i] - p_[i - 1]));
      const double pivot = 2 * (h0 + h1) - h0 * c[i - 1];
      c[i] = h1 / pivot;
      m_[i] = (1 / pivot) * (rhs - h0 * m_[i - 1]);
    }
    for (int i = n - 2; i > 0; --i) m_[i] = m_[i] - c[i] * m_[i + 1];
  }
  double end() const { return t_.back(); }
  Triple at(double t) const {
    const int i =
        std::clamp(static_cast<int>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin()) - 1, 0, static_cast<int>(t_.size()) - 2);
    const double h = t_[i + 1] - t_[i], a = (t_[i + 1] - t) / h, b = (t - t_[i]) / h;
    return a * p_[i] + b * p_[i + 1] + (h * h / 6 * (a * a * a - a)) * m_[i] + (h * h / 6 * (b * b * b - b)) * m_[i + 1];
  }

 private:
  std::vector<Triple> p_, m_;
  std::vector<double> t_;
};

std::function<Triple(double)> centerline_curve(const GridSettings& s, double& end) {
  switch (s.centerline) {
    case GridSettings::Centerline::arc: {
      end = s.arc_angle_deg * std::acos(-1.0) / 180;
      const double r = s.arc_radius_um;
      return [r](double t) { return Triple{r * (1 - std::cos(t)), 0, r * std::sin(t)}; };
    }
    case GridSettings::Centerline::helix: {
      const double r = s.helix_radius_um, rise = s.helix_pitch_um / (2 * std::acos(-1.0));
      end = 2 * std::acos(-1.0) * s.helix_turns;
      return [r, rise](double t) { return Triple{r * std::cos(t), r * std::sin(t), rise * t}; };
    }
    case GridSettings::Centerline::spline:
      break;
  }
  const Spline spline(s.points_um);
  end = spline.end();
  return [spline](double t) { return spline.at(t); };
}

}  // namespace

std::array<double, 2> square_to_disk(double u, double v, GridSettings::CrossSection map) {
  if (map == GridSettings::CrossSection::elliptical) return {u * std::sqrt(1 - 0.5 * v * v), v * std::sqrt(1 - 0.5 * u * u)};
  return conformal_disk(u, v);
}

Centerline::Centerline(const GridSettings& settings) {
  double end = 0;
  const auto curve = centerline_curve(settings, end);
  constexpr int samples = 20000;
  std::vector<Triple> p(samples + 1);
  std::vector<double> s(samples + 1, 0);
  for (int i = 0; i <= samples; ++i) {
    p[i] = curve(end * i / samples);
    if (i > 0) s[i] = s[i - 1] + std::sqrt(dot(p[i] - p[i - 1], p[i] - p[i - 1]));
  }
  length_ = s.back();
  constexpr int count = 4000;
  frames_.resize(count + 1);
  const double ds = length_ / count;
  for (int m = 0; m <= count; ++m) {
    const double target = ds * m;
    const int i = std::clamp(static_cast<int>(std::upper_bound(s.begin(), s.end(), target) - s.begin()) - 1, 0, samples - 1);
    const double fraction = std::clamp((target - s[i]) / (s[i + 1] - s[i]), 0.0, 1.0);
    const double t = end * (i + fraction) / samples, dt = 1e-4 * end;
    frames_[m].position = curve(t);
    const double before = std::max(t - dt, 0.0), after = std::min(t + dt, end);
    frames_[m].tangent = unit(curve(after) - curve(before));
  }
  for (int m = 1; m < count; ++m) {
    const Triple bend = frames_[m + 1].tangent - frames_[m - 1].tangent;
    curvature_ = std::max(curvature_, std::sqrt(dot(bend, bend)) / (2 * ds));
  }
  const Triple first = frames_[0].tangent;
  const Triple helper = std::abs(first[0]) < 0.9 ? Triple{1, 0, 0} : Triple{0, 1, 0};
  frames_[0].normal = unit(helper - dot(helper, first) * first);
  for (int m = 1; m <= count; ++m) {  // double reflection (Wang, Juettler, Zheng, Liu, ACM Trans. Graph. 2008)
    const Triple v1 = frames_[m].position - frames_[m - 1].position;
    const double c1 = dot(v1, v1);
    const Triple r = frames_[m - 1].normal - (2 / c1 * dot(v1, frames_[m - 1].normal)) * v1;
    const Triple t = frames_[m - 1].tangent - (2 / c1 * dot(v1, frames_[m - 1].tangent)) * v1;
    const Triple v2 = frames_[m].tangent - t;
    const double c2 = dot(v2, v2);
    frames_[m].normal = c2 > 0 ? r - (2 / c2 * dot(v2, r)) * v2 : r;
  }
  for (auto& f : frames_) {
    f.normal = unit(f.normal - dot(f.normal, f.tangent) * f.tangent);
    f.binormal = cross(f.tangent, f.normal);
  }
}

Centerline::Frame Centerline::at(double s) const {
  const int last = static_cast<int>(frames_.size()) - 1;
  const double position = std::clamp(s / length_, 0.0, 1.0) * last;
  const int i = std::min(static_cast<int>(position), last - 1);
  const double b = position - i, a = 1 - b;
  Frame f;
  f.position = a * frames_[i].position + b * frames_[i + 1].position;
  f.tangent = unit(a * frames_[i].tangent + b * frames_[i + 1].tangent);
  const Triple normal = a * frames_[i].normal + b * frames_[i + 1].normal;
  f.normal = unit(normal - dot(normal, f.tangent) * f.tangent);
  f.binormal = cross(f.tangent, f.normal);
  return f;
}

NodeSource make_node_source(const GridSettings& settings) {
  switch (settings.generator) {
    case GridSettings::Generator::box:
      return box(settings);
    case GridSettings::Generator::straight_tube:
      return straight_tube(settings);
    case GridSettings::Generator::swept_tube:
      return swept_tube(settings);
    case GridSettings::Generator::file:
      break;
  }
  return read_node_file(settings.file);
}

}  // namespace corpuscle
