// What a rigid body takes of forces that are spread beside it: there is no momentum at nodes in a body or next to its surface, and what
// falls upon their faces is held by the body, across a film that the grid does not show.
#pragma once

#include "fluid/masked_gradient.hpp"
#include "grid/box_values.hpp"
#include "grid/grid_views.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

struct BodyMotion {
  Vec3 centre, velocity, omega;  // um, um/us, 1/us; the centre up to periods
  PeriodicFrame frame;

  /// Where the body's image next to x is, if x is not half a period away from it.
  KOKKOS_INLINE_FUNCTION Vec3 at(const Vec3& x) const {
    const Vec3 from_centre = x - centre;
    Vec3 arm = from_centre;
    for (int d = 0; d < 3; ++d)
      if (frame.periodic[d]) arm -= std::floor(dot(from_centre, frame.dual[d]) + 0.5) * frame.period[d];
    return velocity + cross(omega, arm);
  }
};

/// The force on a body, nN, its power on the body, nW, and that in the film, nW. This rank's part. Less what momentum_balance() counts of
/// forces: it extends the pressure to faces around the body by its whole last difference, which the force beside it makes a part of.
inline Sums<5> load_beside_body(const GridViews& grid, const NodeViews& nodes, const FaceForce& force, const Array<double> (&flux)[3],
                                int body, const BodyMotion& body_motion) {
  const IndexSpace index = grid.index;
  const FaceForce on_faces = force, through{{flux[0], flux[1], flux[2]}};
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const auto x = grid.x;
  const auto kind = nodes.kind;
  const auto body_of = nodes.body;
  const BodyMotion motion = body_motion;
  Sums<5> load_on_body;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::beside_body", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, Sums<5>& sum) {
        const int c = index.cell(e % index.n[0], (e / index.n[0]) % index.n[1], e / (index.n[0] * index.n[1]));
        for (int d = 0; d < 3; ++d) {
          const int low = c - index.stride(d);
          if (body_of(c) != body && (body_of(c) >= 0 || body_of(low) != body)) continue;
          const Vec3 area = load(d == 0 ? area0 : (d == 1 ? area1 : area2), c);
          double counted = 0;
          if (kind(c) == NodeKind::fluid && kind(c + index.stride(d)) == NodeKind::fluid) counted = on_faces(d, c + index.stride(d));
          if (kind(low) == NodeKind::fluid && kind(low - index.stride(d)) == NodeKind::fluid) counted = on_faces(d, low);
          const double across = on_faces(d, c), of_body = dot(area, motion.at(0.5 * (load(x, c) + load(x, low))));
          for (int m = 0; m < 3; ++m) sum[m] += (across - 0.5 * counted) * area[m];
          sum[3] += across * of_body;
          sum[4] += across * (through(d, c) - of_body);
        }
      },
      load_on_body);
  return load_on_body;
}

}  // namespace corpuscle
