// Pressure at nodes that a body has left from one search to the next without having been beside its surface.
#pragma once

#include "immersed/views.hpp"

namespace corpuscle {

/// p at owned nodes that were inside and are fluid now: the mean of the neighbours that had a pressure before. What is
/// stored there is from when the body came.
inline void fill_uncovered(const Lattice& lattice, const NodeBox& box, const Array<NodeKind>& kind, const Array<NodeKind>& previous,
                           const Array<double>& p) {
  Kokkos::parallel_for(
      "corpuscle::immersed::uncovered_pressure", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        if (!lattice.index.owns(i[0], i[1], i[2])) return;
        if (kind(c) != NodeKind::fluid || previous(c) != NodeKind::inside) return;
        double sum = 0;
        int count = 0;
        for (int reach = 1; reach <= 2 && count == 0; ++reach) {
          for (int k = -reach; k <= reach; ++k) {
            for (int j = -reach; j <= reach; ++j) {
              for (int l = -reach; l <= reach; ++l) {
                const int at[3] = {i[0] + l, i[1] + j, i[2] + k};
                if (!lattice.contains(at)) continue;
                const int n = lattice.node(at[0], at[1], at[2]);
                if (previous(n) != NodeKind::fluid && previous(n) != NodeKind::immersed) continue;
                sum += p(n);
                ++count;
              }
            }
          }
        }
        if (count > 0) p(c) = sum / count;
      });
}

}  // namespace corpuscle
