// Markers sorted by the cell they are in: a counting sort whose result does not depend on who counts first.
#pragma once

#include "transfer/marker_views.hpp"

namespace corpuscle {

/// The cell of this block, halo included, that a marker is in.
KOKKOS_INLINE_FUNCTION int marker_cell(const MarkerViews& m, const IndexSpace& index, int marker) {
  return index.cell(static_cast<int>(std::floor(m.eta(marker, 0) + 0.5)), static_cast<int>(std::floor(m.eta(marker, 1) + 0.5)),
                    static_cast<int>(std::floor(m.eta(marker, 2) + 0.5)));
}

/// Fills m.start and m.order.
inline void sort_markers(const IndexSpace& index, const MarkerViews& markers) {
  const MarkerViews m = markers;
  const int cells = index.size();
  Kokkos::deep_copy(Exec(), m.start, 0);
  Kokkos::parallel_for(
      "corpuscle::transfer::count_markers", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker) { Kokkos::atomic_fetch_add(&m.start(marker_cell(m, index, marker)), 1); });
  // To the end of each cell; placing the markers counts it down to the start.
  Kokkos::parallel_scan(
      "corpuscle::transfer::cell_ends", Policy(0, cells + 1), KOKKOS_LAMBDA(int c, int& sum, bool last) {
        sum += m.start(c);
        if (last) m.start(c) = sum;
      });
  Kokkos::parallel_for(
      "corpuscle::transfer::place_markers", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        m.order(Kokkos::atomic_fetch_add(&m.start(marker_cell(m, index, marker)), -1) - 1) = marker;
      });
  Kokkos::parallel_for(
      "corpuscle::transfer::order_in_cells", Policy(0, cells), KOKKOS_LAMBDA(int c) {
        const int begin = m.start(c), end = m.start(c + 1);
        for (int i = begin + 1; i < end; ++i) {
          const int moved = m.order(i);
          int to = i;
          for (; to > begin && m.order(to - 1) > moved; --to) m.order(to) = m.order(to - 1);
          m.order(to) = moved;
        }
      });
}

}  // namespace corpuscle
