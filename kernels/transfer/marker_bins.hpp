// Markers sorted by the cell they are in.
#pragma once

#include "common/counting_sort.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// The cell of this block, halo included, that a marker is in.
KOKKOS_INLINE_FUNCTION int marker_cell(const MarkerViews& m, const Lattice& lattice, int marker) {
  const MarkerPlace place(lattice, m, marker);
  return lattice.index.cell(static_cast<int>(std::floor(place.eta[0] + 0.5)), static_cast<int>(std::floor(place.eta[1] + 0.5)),
                            static_cast<int>(std::floor(place.eta[2] + 0.5)));
}

/// Fills m.start and m.order.
inline void sort_markers(const Lattice& of_block, const MarkerViews& markers) {
  const MarkerViews m = markers;
  const Lattice lattice = of_block;
  counting_sort(
      "corpuscle::transfer::sort_markers", m.count, lattice.index.size(),
      KOKKOS_LAMBDA(int marker) { return marker_cell(m, lattice, marker); }, m.start, m.order);
}

}  // namespace corpuscle
