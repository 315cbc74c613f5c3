// A rigid shape as packing sees it: points of its surface, and the signed distance from it.
#pragma once

#include <vector>

#include "common/vec3.hpp"
#include "membrane/mesh.hpp"

namespace corpuscle {

/// Points, one component after the other.
struct PackingPoints {
  std::vector<double> x, y, z;
  std::size_t size() const { return x.size(); }
  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  void add(const Vec3& p) { x.push_back(p.x), y.push_back(p.y), z.push_back(p.z); }
};

class PackingShape {
 public:
  /// @param mesh   closed, about the point around which it turns
  /// @param reach  um, up to which distances outside are wanted
  PackingShape(const TriangleMesh& mesh, double reach);

  /// Spread evenly over the surface: some tens, for the most of the work, and all vertices (thinned beyond a thousand).
  const PackingPoints& few_points() const { return few_; }
  const PackingPoints& points() const { return all_; }
  /// um, of the farthest vertex.
  double radius() const { return radius_; }
  /// um, rms distance of the vertices.
  double gyration() const { return gyration_; }

  /// The box beyond which all is farther than the reach.
  const Vec3& lower() const { return lower_; }
  const Vec3& upper() const { return upper_; }

  /// um, negative inside, and its gradient. @returns false farther outside than the reach
  bool distance(const Vec3& p, double& value, Vec3& gradient) const {
    double at[3];
    int cell[3];
    for (int d = 0; d < 3; ++d) {
      at[d] = (p[d] - lower_[d]) * per_step_;
      if (!(at[d] >= 0 && at[d] < n_[d] - 1)) return false;
      cell[d] = static_cast<int>(at[d]);
      at[d] -= cell[d];
    }
    return interpolate(cell, at, value, gradient);
  }

 private:
  bool interpolate(const int (&cell)[3], const double (&at)[3], double& value, Vec3& gradient) const;
  void choose_points(const TriangleMesh& mesh);
  void tabulate(const TriangleMesh& mesh);
  std::size_t node(int i, int j, int k) const { return i + static_cast<std::size_t>(n_[0]) * (j + static_cast<std::size_t>(n_[1]) * k); }

  PackingPoints few_, all_;
  double reach_, radius_ = 0, gyration_ = 0;
  Vec3 lower_, upper_;
  int n_[3] = {0, 0, 0};
  double step_ = 0, per_step_ = 0;
  std::vector<float> value_;  // [node] um
};

}  // namespace corpuscle
