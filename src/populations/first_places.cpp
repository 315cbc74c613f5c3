#include "populations/first_places.hpp"

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "membrane/mesh.hpp"

namespace corpuscle {

namespace {

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

}  // namespace

double Chance::normal() {
  const double u = 1 - share(), v = share();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::acos(-1.0) * v);
}

Rotation Chance::rotation() {
  double q[4], square = 0;
  while (square < 1e-6) {
    square = 0;
    for (double& c : q) c = normal(), square += c * c;
  }
  const double share = 1 / std::sqrt(square);
  return {share * q[0], share * q[1], share * q[2], share * q[3]};
}

PointsOfGrid::PointsOfGrid(const NodeSource& source) : source_(source) {
  constexpr int samples = 4000;
  constexpr double margin = 1.5;  // the largest of the samples is not the largest of all
  Chance chance(1);
  for (int n = 0; n < samples; ++n) {
    const double u = chance.share(), v = chance.share(), w = chance.share();
    largest_ = std::max(largest_, margin * place(u, v, w).stretch);
  }
}

PointsOfGrid::Place PointsOfGrid::place(double u, double v, double w) const {
  const double along[3] = {u * source_.cells[0], v * source_.cells[1], w * source_.cells[2]};
  int cell[3];
  double x[3];
  for (int d = 0; d < 3; ++d) {
    cell[d] = std::min(static_cast<int>(along[d]), source_.cells[d] - 1);
    x[d] = along[d] - cell[d];
  }
  Place found{{}, 0};
  Vec3 tangent[3];
  for (int corner = 0; corner < 8; ++corner) {
    const int a[3] = {corner & 1, corner >> 1 & 1, corner >> 2 & 1};
    const Vec3 node = vec(source_.node(cell[0] + a[0], cell[1] + a[1], cell[2] + a[2]));
    double share[3];
    for (int d = 0; d < 3; ++d) share[d] = a[d] ? x[d] : 1 - x[d];
    found.at += (share[0] * share[1] * share[2]) * node;
    for (int d = 0; d < 3; ++d) tangent[d] += ((a[d] ? 1 : -1) * share[(d + 1) % 3] * share[(d + 2) % 3]) * node;
  }
  found.stretch = dot(cross(tangent[0], tangent[1]), tangent[2]);
  return found;
}

Vec3 PointsOfGrid::next(Chance& chance) const {
  for (;;) {
    const double u = chance.share(), v = chance.share(), w = chance.share(), kept = chance.share();
    const Place found = place(u, v, w);
    if (kept * largest_ < found.stretch) return found.at;
  }
}

namespace {

/// Of the cube `by` away from that of a place.
std::int64_t bin_key(const Vec3& at, double width, const int (&by)[3]) {
  std::int64_t key = 0;
  for (int d = 0; d < 3; ++d) key = (key << 21) | ((static_cast<std::int64_t>(std::floor(at[d] / width)) + by[d] + (1 << 20)) & 0x1fffff);
  return key;
}

}  // namespace

void Neighbourhood::add(const Vec3& center, double radius) {
  for (const Vec3& shift : shifts_) bins_[bin_key(center + shift, width_, {0, 0, 0})].push_back({center + shift, radius});
}

bool Neighbourhood::meets(const Vec3& center, double radius) const {
  for (int n = 0; n < 27; ++n) {
    const auto bin = bins_.find(bin_key(center, width_, {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}));
    if (bin == bins_.end()) continue;
    for (const Ball& ball : bin->second) {
      const Vec3 apart = ball.center - center;
      if (dot(apart, apart) < (radius + ball.radius) * (radius + ball.radius)) return true;
    }
  }
  return false;
}

Rotation rotation_of(const Triple& axis, double spin_deg) {
  TriangleMesh unit;
  unit.vertices = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto turned = transform(unit, axis, spin_deg, {0, 0, 0}).vertices;
  double m[3][3];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m[r][c] = turned[c][r];
  // The largest of the four components first (Shepperd, J. Guid. Control 1, 1978).
  const double trace = m[0][0] + m[1][1] + m[2][2];
  double q[4];  // w, x, y, z
  int most = 0;
  const double size[4] = {trace, m[0][0], m[1][1], m[2][2]};
  for (int n = 1; n < 4; ++n)
    if (size[n] > size[most]) most = n;
  if (most == 0) {
    q[0] = 0.5 * std::sqrt(1 + trace);
    for (int d = 0; d < 3; ++d) q[1 + d] = (m[(d + 2) % 3][(d + 1) % 3] - m[(d + 1) % 3][(d + 2) % 3]) / (4 * q[0]);
  } else {
    const int i = most - 1, j = (i + 1) % 3, k = (i + 2) % 3;
    q[1 + i] = 0.5 * std::sqrt(1 + m[i][i] - m[j][j] - m[k][k]);
    q[0] = (m[k][j] - m[j][k]) / (4 * q[1 + i]);
    q[1 + j] = (m[j][i] + m[i][j]) / (4 * q[1 + i]);
    q[1 + k] = (m[k][i] + m[i][k]) / (4 * q[1 + i]);
  }
  return {q[0], q[1], q[2], q[3]};
}

void set_direction(const Rotation& rotation, Triple& axis, double& spin_deg) {
  Vec3 rows[3];
  rotation.matrix(rows);
  for (int d = 0; d < 3; ++d) axis[d] = rows[d].z;
  // What is left once the axis is turned back to z, see transform().
  const Vec3 a = vec(axis), x{rows[0].x, rows[1].x, rows[2].x}, w{a.y, -a.x, 0};
  const bool opposite = a.z < -1 + 1e-12;
  const Vec3 back = opposite ? Vec3{x.x, -x.y, -x.z} : a.z * x + cross(w, x) + (dot(w, x) / (1 + a.z)) * w;
  spin_deg = std::atan2(back.y, back.x) / units::degree;
}

}  // namespace corpuscle
