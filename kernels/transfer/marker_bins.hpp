// Markers sorted by the cell they are in.
#pragma once

#include "common/counting_sort.hpp"
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
  counting_sort(
      "corpuscle::transfer::sort_markers", m.count, index.size(),
      KOKKOS_LAMBDA(int marker) { return marker_cell(m, index, marker); }, m.start, m.order);
}

}  // namespace corpuscle
