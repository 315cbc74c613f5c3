#include "membrane/shape_measures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace corpuscle {

namespace {

double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Triple cross(const Triple& a, const Triple& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Triple scaled(const Triple& a, double s) { return {s * a[0], s * a[1], s * a[2]}; }

struct AxisFrame {
  Triple e1, e2, n;
  explicit AxisFrame(const Triple& forward) {
    n = scaled(forward, 1 / std::sqrt(dot(forward, forward)));
    const Triple helper = std::abs(n[0]) < 0.7 ? Triple{1, 0, 0} : Triple{0, 1, 0};
    e1 = cross(n, helper);
    e1 = scaled(e1, 1 / std::sqrt(dot(e1, e1)));
    e2 = cross(n, e1);
  }
};

}  // namespace

ParachuteMeasures parachute_measures(const TriangleMesh& mesh, const Triple& centroid, const Triple& forward) {
  const AxisFrame frame(forward);
  std::vector<Triple> local;  // (across 1, across 2, along)
  local.reserve(mesh.vertices.size());
  for (const auto& x : mesh.vertices) {
    const Triple r{x[0] - centroid[0], x[1] - centroid[1], x[2] - centroid[2]};
    local.push_back({dot(r, frame.e1), dot(r, frame.e2), dot(r, frame.n)});
  }
  double rearmost = 1e300, foremost = -1e300;
  for (const auto& r : local) rearmost = std::min(rearmost, r[2]), foremost = std::max(foremost, r[2]);

  double rear = 1e300, front = -1e300;  // where the axis pierces the surface
  for (const auto& t : mesh.triangles) {
    const Triple &a = local[t[0]], &b = local[t[1]], &c = local[t[2]];
    const double wa = b[0] * c[1] - b[1] * c[0], wb = c[0] * a[1] - c[1] * a[0], wc = a[0] * b[1] - a[1] * b[0];
    const double total = wa + wb + wc;
    if (total == 0 || std::min({wa / total, wb / total, wc / total}) < 0) continue;
    const double z = (wa * a[2] + wb * b[2] + wc * c[2]) / total;
    rear = std::min(rear, z), front = std::max(front, z);
  }

  ParachuteMeasures result;
  result.length_um = foremost - rearmost;
  if (front >= rear) {
    result.rear_hollow_um = rear - rearmost;
    result.front_dimple_um = foremost - front;
  }
  constexpr int angles = 36;
  double sum = 0, widest = 0, narrowest = 1e300;
  for (int k = 0; k < angles; ++k) {
    const double angle = std::acos(-1.0) * k / angles, cosine = std::cos(angle), sine = std::sin(angle);
    double low = 1e300, high = -1e300;
    for (const auto& r : local) {
      const double s = cosine * r[0] + sine * r[1];
      low = std::min(low, s), high = std::max(high, s);
    }
    sum += high - low;
    widest = std::max(widest, high - low);
    narrowest = std::min(narrowest, high - low);
  }
  result.diameter_um = sum / angles;
  result.asymmetry = (widest - narrowest) / result.diameter_um;
  return result;
}

}  // namespace corpuscle
