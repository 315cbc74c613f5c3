// How near markers are to the sides that fluid leaves by.
#pragma once

#include "transfer/marker_views.hpp"

namespace corpuscle {

struct NearSide {
  double distance = 1e30;  // um along the grid line
  int vertex = -1;
};

/// The vertex at home that is nearest to one end (0 low, 1 high) of direction d, which is a side of the grid.
inline NearSide nearest_to_side(const TransferBlock& transfer_block, const MarkerViews& markers, int d, int end) {
  using Reducer = Kokkos::MinLoc<double, int>;
  Reducer::value_type nearest;
  const Lattice lattice = transfer_block.lattice;
  const MarkerViews m = markers;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::nearest_to_side", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker, Reducer::value_type& least) {
        if (!m.home(marker)) return;
        const MarkerPlace place(lattice, m, marker);
        const double(&xi)[3] = place.eta;
        LatticePoint q;
        lattice.set(q, xi);
        Vec3 tangent[3];
        lattice.cell_tangents(q, tangent);
        const double gap = end == 0 ? xi[d] + 0.5 : lattice.index.n[d] - 0.5 - xi[d], distance = gap * norm(tangent[d]);
        if (distance < least.val) least.val = distance, least.loc = m.vertex(marker);
      },
      Reducer(nearest));
  return m.count > 0 && nearest.val < 1e30 ? NearSide{nearest.val, nearest.loc} : NearSide{};
}

}  // namespace corpuscle
