// Slow and independent answers to the questions that the search answers quickly.
#pragma once

#include "scene.hpp"

namespace scene {

using corpuscle::cross;
using corpuscle::dot;
using corpuscle::norm;

/// Triangles of a set on the host, moved by `shift`.
struct Soup {
  std::vector<std::array<Vec3, 3>> triangles;
  std::vector<int> body;

  explicit Soup(const SurfaceSet& s, const std::vector<Vec3>& shifts = {Vec3{}}) {
    const auto x = on_host(s.x);
    const auto t = triangles_on_host(s);
    const auto b = on_host(s.triangle_body);
    for (const Vec3& shift : shifts) {
      for (int e = 0; e < s.triangles; ++e) {
        triangles.push_back(
            {corpuscle::load(x, t(e, 0)) + shift, corpuscle::load(x, t(e, 1)) + shift, corpuscle::load(x, t(e, 2)) + shift});
        body.push_back(b(e));
      }
    }
  }

  /// Parameter of the strict intersection of p + t d with a triangle, or -1 (Moeller & Trumbore 1997).
  static double hit(const Vec3& p, const Vec3& d, const std::array<Vec3, 3>& tri) {
    const Vec3 e1 = tri[1] - tri[0], e2 = tri[2] - tri[0], h = cross(d, e2);
    const double det = dot(e1, h);
    if (det == 0) return -1;
    const Vec3 s = p - tri[0], q = cross(s, e1);
    const double u = dot(s, h) / det, v = dot(d, q) / det, t = dot(e2, q) / det;
    return u >= 0 && v >= 0 && u + v <= 1 ? t : -1;
  }

  /// Triangles hit by the segment from p to q.
  int crossings(const Vec3& p, const Vec3& q) const {
    int count = 0;
    for (const auto& t : triangles) {
      bool apart = false;
      for (int d = 0; d < 3; ++d) {
        apart = apart || std::max(p[d], q[d]) < std::min({t[0][d], t[1][d], t[2][d]}) ||
                std::min(p[d], q[d]) > std::max({t[0][d], t[1][d], t[2][d]});
      }
      if (apart) continue;
      const double at = hit(p, q - p, t);
      count += at >= 0 && at <= 1;
    }
    return count;
  }

  /// Parity along a ray in a direction that no symmetric scene is aligned with.
  bool inside(const Vec3& p) const {
    const Vec3 ray{0.8431, 0.3127, 0.4375};
    int count = 0;
    for (const auto& t : triangles) count += hit(p, ray, t) > 0;
    return count % 2 == 1;
  }

  double distance(const Vec3& p) const {
    double best = 1e300;
    for (const auto& t : triangles) {
      const auto q = corpuscle::closest_on_triangle(p, t[0], t[1], t[2]);
      best = std::min(best, norm(p - (q.weight[0] * t[0] + q.weight[1] * t[1] + q.weight[2] * t[2])));
    }
    return best;
  }
};

}  // namespace scene
