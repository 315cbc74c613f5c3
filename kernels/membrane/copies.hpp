// Copies of positions and velocities.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

/// The first `vertices` rows of x and v into to_x and to_v, all [vertex, 3].
inline void copy_motion(int vertices, const Components<double>& x, const Components<double>& v, const Components<double>& to_x,
                        const Components<double>& to_v) {
  Kokkos::parallel_for(
      "corpuscle::membrane::copy_motion", Policy(0, vertices), KOKKOS_LAMBDA(int i) {
        for (int d = 0; d < 3; ++d) {
          to_x(i, d) = x(i, d);
          to_v(i, d) = v(i, d);
        }
      });
}

/// from = x + share dt v, then x += dt v, over the first `vertices` rows, all [vertex, 3].
inline void set_out(int vertices, const Components<double>& x, const Components<double>& v, double dt, double share,
                    const Components<double>& from) {
  Kokkos::parallel_for(
      "corpuscle::membrane::set_out", Policy(0, vertices), KOKKOS_LAMBDA(int i) {
        for (int d = 0; d < 3; ++d) {
          const double at = x(i, d), way = dt * v(i, d);
          from(i, d) = at + share * way;
          x(i, d) = at + way;
        }
      });
}

}  // namespace corpuscle
