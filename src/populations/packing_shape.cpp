#include "populations/packing_shape.hpp"

#include <algorithm>
#include <cmath>

#include "immersed/triangle.hpp"

namespace corpuscle {

namespace {

constexpr std::size_t few = 96, most = 1000;  // points
constexpr int nodes_across = 48;              // of the table: linear between nodes, it is 0.002 um off on the rim of a red cell

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

/// Each the farthest from those before it.
PackingPoints spread(const std::vector<Vec3>& from, std::size_t count) {
  PackingPoints chosen;
  if (from.size() <= count) {
    for (const Vec3& p : from) chosen.add(p);
    return chosen;
  }
  std::vector<double> square(from.size(), 1e300);
  std::size_t next = 0;
  while (chosen.size() < count) {
    const Vec3 last = from[next];
    chosen.add(last);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const Vec3 r = from[i] - last;
      square[i] = std::min(square[i], dot(r, r));
      if (square[i] > square[next]) next = i;
    }
  }
  return chosen;
}

/// Normals that have the right sign at any point's nearest one (Baerentzen & Aanaes, IEEE Trans. Vis. Comput. Graph. 11, 2005).
struct Normals {
  explicit Normals(const TriangleMesh& mesh) : neighbour(triangle_neighbours(mesh)), vertex(mesh.vertices.size()) {
    for (const auto& t : mesh.triangles) {
      Vec3 x[3];
      for (int k = 0; k < 3; ++k) x[k] = vec(mesh.vertices[t[k]]);
      const Vec3 n = cross(x[1] - x[0], x[2] - x[0]);
      face.push_back((1 / std::max(norm(n), 1e-300)) * n);
      for (int k = 0; k < 3; ++k) {
        const Vec3 p = x[(k + 1) % 3] - x[k], q = x[(k + 2) % 3] - x[k];
        vertex[t[k]] += std::atan2(norm(cross(p, q)), dot(p, q)) * face.back();
      }
    }
  }
  Vec3 at(const TriangleMesh& mesh, int t, int feature) const {
    if (feature == 0) return face[t];
    if (feature <= 3) return face[t] + face[neighbour[t][feature - 1]];
    return vertex[mesh.triangles[t][feature - 4]];
  }
  std::vector<std::array<int, 3>> neighbour;
  std::vector<Vec3> face, vertex;
};

}  // namespace

PackingShape::PackingShape(const TriangleMesh& mesh, double reach) : reach_(reach) {
  choose_points(mesh);
  tabulate(mesh);
}

void PackingShape::choose_points(const TriangleMesh& mesh) {
  std::vector<Vec3> vertices;
  double squares = 0;
  for (const Triple& x : mesh.vertices) {
    vertices.push_back(vec(x));
    const double square = dot(vertices.back(), vertices.back());
    radius_ = std::max(radius_, std::sqrt(square));
    squares += square;
  }
  gyration_ = std::sqrt(squares / static_cast<double>(vertices.size()));
  all_ = spread(vertices, most);
  few_ = spread(vertices, few);
}

/// Triangles tell the nodes around them; what none reaches is far outside, or deep inside where all around it is.
void PackingShape::tabulate(const TriangleMesh& mesh) {
  step_ = 2 * radius_ / nodes_across;
  per_step_ = 1 / step_;
  const double band = std::max(reach_, 0.4 * radius_) + 2 * step_;
  Vec3 upper;
  for (int d = 0; d < 3; ++d) lower_[d] = 1e300, upper[d] = -1e300;
  for (const Triple& x : mesh.vertices)
    for (int d = 0; d < 3; ++d) lower_[d] = std::min(lower_[d], x[d]), upper[d] = std::max(upper[d], x[d]);
  for (int d = 0; d < 3; ++d) {
    lower_[d] -= reach_ + step_;
    n_[d] = static_cast<int>(std::ceil((upper[d] + reach_ + step_ - lower_[d]) / step_)) + 1;
    upper_[d] = upper[d] + reach_;
  }
  const float unknown = 1e30f;
  value_.assign(static_cast<std::size_t>(n_[0]) * n_[1] * n_[2], unknown);
  const Normals normals(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& c = mesh.triangles[t];
    const Vec3 x[3] = {vec(mesh.vertices[c[0]]), vec(mesh.vertices[c[1]]), vec(mesh.vertices[c[2]])};
    int low[3], high[3];
    for (int d = 0; d < 3; ++d) {
      const double least = std::min({x[0][d], x[1][d], x[2][d]}), largest = std::max({x[0][d], x[1][d], x[2][d]});
      low[d] = std::max(0, static_cast<int>(std::floor((least - band - lower_[d]) / step_)));
      high[d] = std::min(n_[d] - 1, static_cast<int>(std::ceil((largest + band - lower_[d]) / step_)));
    }
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i) {
          const Vec3 p = lower_ + step_ * Vec3{double(i), double(j), double(k)};
          const TrianglePoint at = closest_on_triangle(p, x[0], x[1], x[2]);
          const Vec3 away = p - (at.weight[0] * x[0] + at.weight[1] * x[1] + at.weight[2] * x[2]);
          const double distance = norm(away);
          float& value = value_[node(i, j, k)];
          if (distance >= std::abs(value)) continue;
          const bool inside = dot(away, normals.at(mesh, static_cast<int>(t), at.feature)) < 0;
          value = static_cast<float>(inside ? -distance : distance);
        }
  }
  const auto beyond = static_cast<float>(band);
  for (int k = 0; k < n_[2]; ++k)
    for (int j = 0; j < n_[1]; ++j) {
      bool inside = false;  // along a line that begins outside
      for (int i = 0; i < n_[0]; ++i) {
        float& value = value_[node(i, j, k)];
        if (value == unknown)
          value = inside ? -beyond : beyond;
        else
          inside = value < 0;
      }
    }
}

bool PackingShape::interpolate(const int (&cell)[3], const double (&at)[3], double& value, Vec3& gradient) const {
  const std::size_t first = node(cell[0], cell[1], cell[2]),
                    up[2] = {static_cast<std::size_t>(n_[0]), static_cast<std::size_t>(n_[0]) * n_[1]};
  double v[2][2][2];
  for (int c = 0; c < 2; ++c)
    for (int b = 0; b < 2; ++b)
      for (int a = 0; a < 2; ++a) v[c][b][a] = value_[first + a + b * up[0] + c * up[1]];
  const double x = at[0], y = at[1], z = at[2];
  double on_x[2][2], slope_x[2][2];
  for (int c = 0; c < 2; ++c)
    for (int b = 0; b < 2; ++b) {
      slope_x[c][b] = v[c][b][1] - v[c][b][0];
      on_x[c][b] = v[c][b][0] + x * slope_x[c][b];
    }
  double on_y[2];
  for (int c = 0; c < 2; ++c) on_y[c] = on_x[c][0] + y * (on_x[c][1] - on_x[c][0]);
  value = on_y[0] + z * (on_y[1] - on_y[0]);
  if (value > reach_) return false;
  const auto mix = [](double a, double b, double share) { return a + share * (b - a); };
  gradient.x = mix(mix(slope_x[0][0], slope_x[0][1], y), mix(slope_x[1][0], slope_x[1][1], y), z);
  gradient.y = mix(on_x[0][1] - on_x[0][0], on_x[1][1] - on_x[1][0], z);
  gradient.z = on_y[1] - on_y[0];
  const double length = norm(gradient);
  gradient = length > 1e-12 ? (1 / length) * gradient : Vec3{0, 0, 1};
  return true;
}

}  // namespace corpuscle
