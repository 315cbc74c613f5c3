// What the way between faces and centres takes from the power of a force on faces.
#pragma once

#include "fluid/masked_gradient.hpp"
#include "grid/box_values.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// Fluxes are the mean velocities' of both sides and what the compact difference of pressure and force adds to the wide one
/// (interpolate_flux()). A force works on the whole of them, and the momentum equation knows of the means: the rest is lost, as
/// friction within a spacing. This rank's part, nW.
inline double face_loss(const GridViews& grid, const Array<NodeKind>& kind, const FaceForce& force, const Array<double> (&flux)[3],
                        const Components<double>& velocity, const Array<double>& pressure) {
  const IndexSpace index = grid.index;
  const FaceForce on_faces = force, through{{flux[0], flux[1], flux[2]}};
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const auto u = velocity;
  const auto p = pressure;
  return sum_owned(
      "corpuscle::transfer::face_loss", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        double sum = 0;
        for (int d = 0; d < 3; ++d) {
          const int low = c - index.stride(d);
          if (kind(c) != NodeKind::fluid || kind(low) != NodeKind::fluid) continue;
          const Vec3 area = load(d == 0 ? area0 : (d == 1 ? area1 : area2), c);
          sum += (through(d, c) - 0.5 * dot(area, load(u, c) + load(u, low))) * (on_faces(d, c) - (p(c) - p(low)));
        }
        return sum;
      });
}

}  // namespace corpuscle
