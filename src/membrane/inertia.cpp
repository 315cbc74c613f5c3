#include "membrane/inertia.hpp"

#include <cmath>

#include "common/symmetric.hpp"

namespace corpuscle {

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
      for (int j = 0; j < 3; ++j) second[i][j] += v / 20 * (sum[i] * sum[j] + k[0][i] * k[0][j] + k[1][i] * k[1][j] + k[2][i] * k[2][j]);
  }
  const Vec3 centre = (1 / volume) * first;
  double a[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = second[i][j] / volume - centre[i] * centre[j];
  const SymmetricEigen eigen = eigen_of(a);
  PrincipalAxes result;
  for (int d = 0; d < 3; ++d) {
    result.centroid[d] = origin[d] + centre[d];
    result.moment[d] = eigen.value[d];
    for (int m = 0; m < 3; ++m) result.axis[d][m] = eigen.vector[d][m];
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
