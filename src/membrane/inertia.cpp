#include "membrane/inertia.hpp"

#include <algorithm>
#include <cmath>

#include "common/vec3.hpp"

namespace corpuscle {

namespace {

/// Eigenvalues of a symmetric matrix, which ends diagonal, and its eigenvectors in the columns of `v` (Jacobi rotations).
void diagonalise(double (&a)[3][3], double (&v)[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) v[i][j] = i == j;
  for (int sweep = 0; sweep < 50; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (std::abs(a[p][q]) <= 1e-300) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        }
        for (int k = 0; k < 3; ++k) {
          const double kp = v[k][p], kq = v[k][q];
          v[k][p] = c * kp - s * kq, v[k][q] = s * kp + c * kq;
        }
      }
}

}  // namespace

PrincipalAxes principal_axes(const TriangleMesh& mesh) {
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  const Vec3 origin = at(0);
  // Sums over the tetrahedra between the triangles and vertex 0, of six times their volumes.
  double volume = 0, second[3][3] = {};
  Vec3 first{};
  for (const auto& t : mesh.triangles) {
    const Vec3 k[3] = {at(t[0]) - origin, at(t[1]) - origin, at(t[2]) - origin};
    const double v = dot(k[0], cross(k[1], k[2]));
    const Vec3 sum = k[0] + k[1] + k[2];
    volume += v;
    first += v / 4 * sum;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        second[i][j] += v / 20 * (sum[i] * sum[j] + k[0][i] * k[0][j] + k[1][i] * k[1][j] + k[2][i] * k[2][j]);
  }
  const Vec3 centre = (1 / volume) * first;
  double a[3][3], v[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = second[i][j] / volume - centre[i] * centre[j];
  diagonalise(a, v);
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int i, int j) { return a[i][i] < a[j][j]; });
  PrincipalAxes result;
  for (int d = 0; d < 3; ++d) {
    result.centroid[d] = origin[d] + centre[d];
    result.moment[d] = a[order[d]][order[d]];
    for (int m = 0; m < 3; ++m) result.axis[d][m] = v[m][order[d]];
  }
  return result;
}

std::optional<Triple> disc_axis(const PrincipalAxes& axes) {
  // Moments go with the squares of extents: the flat direction at least a tenth shorter.
  constexpr double distinct = 0.8;
  const Triple& m = axes.moment;
  if (!(m[0] < distinct * m[1]) || m[2] - m[1] > m[1] - m[0]) return {};
  Triple axis = axes.axis[0];
  constexpr double none = 1e-9;  // a component that is rounding
  for (double& a : axis)
    if (std::abs(a) < none) a = 0;
  const int leading = axis[2] != 0 ? 2 : (axis[1] != 0 ? 1 : 0);
  if (axis[leading] < 0)
    for (double& a : axis) a = -a;
  return axis;
}

TriangleMesh turn_to_z(const TriangleMesh& mesh, const Triple& axis, const Triple& centre) {
  TriangleMesh moved = mesh;
  for (Triple& p : moved.vertices)
    for (int d = 0; d < 3; ++d) p[d] -= centre[d];
  // The rotation that takes z to the mirror image of the axis in z takes the axis to z.
  return transform(moved, {-axis[0], -axis[1], axis[2]}, 0, {});
}

Triple extents(const TriangleMesh& mesh) {
  Triple lower = mesh.vertices[0], upper = lower;
  for (const Triple& p : mesh.vertices)
    for (int d = 0; d < 3; ++d) lower[d] = std::min(lower[d], p[d]), upper[d] = std::max(upper[d], p[d]);
  return {upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]};
}

}  // namespace corpuscle
