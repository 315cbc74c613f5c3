#include "coupling/periodic_frame.hpp"

#include "grid/metrics.hpp"

namespace corpuscle {

namespace {

Vec3 to_vec3(const Triple& a) { return {a[0], a[1], a[2]}; }

}  // namespace

/// The vectors dual to the periods, in the space that they span: from the adjugate of their Gram matrix, in which
/// directions that are not periodic have a one.
PeriodicFrame periodic_frame(const Grid& grid) {
  PeriodicFrame frame;
  frame.origin = to_vec3(grid.corner());
  double gram[3][3] = {};
  for (int d = 0; d < 3; ++d) {
    frame.periodic[d] = grid.index().periodic[d];
    if (frame.periodic[d]) frame.period[d] = to_vec3(grid.period(d));
  }
  for (int d = 0; d < 3; ++d)
    for (int e = 0; e < 3; ++e)
      gram[d][e] = frame.periodic[d] && frame.periodic[e] ? dot(frame.period[d], frame.period[e]) : (d == e ? 1.0 : 0.0);
  const DualBasis inverse({gram[0][0], gram[0][1], gram[0][2]}, {gram[1][0], gram[1][1], gram[1][2]}, {gram[2][0], gram[2][1], gram[2][2]});
  for (int d = 0; d < 3; ++d)
    for (int e = 0; e < 3; ++e) frame.dual[d] += inverse.b[d][e] * frame.period[e];
  for (int d = 0; d < 3; ++d)
    if (!frame.periodic[d]) frame.dual[d] = {};
  return frame;
}

}  // namespace corpuscle
