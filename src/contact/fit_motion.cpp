#include "contact/fit_motion.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr int terms = SmoothMotion::terms;

/// Solves for three right sides in place by Cholesky's factorisation, with a unit diagonal that is a little raised: motions that the
/// vertices cannot tell apart share what there is. @returns whether it can be
bool solve(double (&a)[terms][terms], double (&b)[terms][3]) {
  constexpr double raised = 1e-9;
  double scale[terms];
  for (int i = 0; i < terms; ++i) scale[i] = a[i][i] > 0 ? 1 / std::sqrt(a[i][i]) : 0;
  for (int i = 0; i < terms; ++i) {
    for (int j = 0; j < terms; ++j) a[i][j] = i == j ? 1 + raised : a[i][j] * scale[i] * scale[j];
    for (double& value : b[i]) value *= scale[i];
  }
  for (int i = 0; i < terms; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (int k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      if (i == j && !(sum > 0)) return false;
      a[i][j] = i == j ? std::sqrt(sum) : sum / a[j][j];
    }
    for (int d = 0; d < 3; ++d) {
      for (int k = 0; k < i; ++k) b[i][d] -= a[i][k] * b[k][d];
      b[i][d] /= a[i][i];
    }
  }
  for (int i = terms; i-- > 0;)
    for (int d = 0; d < 3; ++d) {
      for (int k = i + 1; k < terms; ++k) b[i][d] -= a[k][i] * b[k][d];
      b[i][d] /= a[i][i];
    }
  for (int i = 0; i < terms; ++i)
    for (double& value : b[i]) value *= scale[i];
  return true;
}

}  // namespace

SmoothMotion fit_motion(const SurfaceSet& surface, const SpaceBounds& bounds) {
  constexpr int enough = 4096;  // vertices
  SmoothMotion motion;
  const double size = 0.5 * norm(bounds.upper - bounds.lower);
  if (surface.vertices == 0 || !(size > 0 && size < 1e300)) return motion;
  motion.middle = 0.5 * (bounds.lower + bounds.upper);
  motion.over_size = 1 / size;
  const MotionProducts products = motion_products(surface, motion, 1 + (surface.vertices - 1) / enough);
  double matrix[terms][terms], right[terms][3];
  int at = 0;
  for (int a = 0; a < terms; ++a)
    for (int b = a; b < terms; ++b) matrix[a][b] = matrix[b][a] = products[at++];
  for (auto& row : right)
    for (double& value : row) value = products[at++];
  if (!solve(matrix, right)) return motion;
  for (int a = 0; a < terms; ++a) {
    const Vec3 share{right[a][0], right[a][1], right[a][2]};
    if (!std::isfinite(dot(share, share))) return SmoothMotion();
    motion.share[a] = share;
  }
  return motion;
}

double steepest_gradient(const SmoothMotion& motion, const SpaceBounds& bounds) {
  double most = 0;
  const Vec3(&c)[terms] = motion.share;
  for (int corner = 0; corner < 8; ++corner) {  // gradients are linear in position, and their norm is largest in a corner
    Vec3 r;
    for (int d = 0; d < 3; ++d) r[d] = motion.over_size * (((corner >> d & 1) != 0 ? bounds.upper[d] : bounds.lower[d]) - motion.middle[d]);
    const Vec3 gradient[3] = {c[1] + (2 * r.x) * c[4] + r.y * c[7] + r.z * c[9], c[2] + (2 * r.y) * c[5] + r.x * c[7] + r.z * c[8],
                              c[3] + (2 * r.z) * c[6] + r.y * c[8] + r.x * c[9]};
    double square = 0;
    for (const Vec3& g : gradient) square += dot(g, g);
    most = std::max(most, square);
  }
  return motion.over_size * std::sqrt(most);
}

}  // namespace corpuscle
