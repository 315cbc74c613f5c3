#include "membrane/mesh_quality.hpp"

#include <algorithm>
#include <cmath>

#include "common/vec3.hpp"
#include "core/units.hpp"

namespace corpuscle {

MeshQuality mesh_quality(const TriangleMesh& mesh) {
  MeshQuality q;
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  std::vector<int> valence(mesh.vertices.size(), 0);
  double sum = 0, squares = 0, shortest = 1e300, longest = 0, largest_cosine = -1;
  const double sides = 3.0 * double(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      ++valence[t[k]];
      const Vec3 a = at(t[(k + 1) % 3]) - at(t[k]), b = at(t[(k + 2) % 3]) - at(t[k]);
      const double length = norm(a);
      sum += length;
      squares += length * length;
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
      largest_cosine = std::max(largest_cosine, dot(a, b) / (length * norm(b)));
    }
  }
  q.edge_mean = sum / sides;
  q.edge_spread = std::sqrt(std::max(0.0, squares / sides - q.edge_mean * q.edge_mean)) / q.edge_mean;
  q.edge_min = shortest / q.edge_mean;
  q.edge_max = longest / q.edge_mean;
  q.smallest_angle_deg = std::acos(std::min(1.0, largest_cosine)) / units::degree;
  q.valence_min = *std::min_element(valence.begin(), valence.end());
  q.valence_max = *std::max_element(valence.begin(), valence.end());
  return q;
}

}  // namespace corpuscle
