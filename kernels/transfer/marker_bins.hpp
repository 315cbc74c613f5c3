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

/// The first of m.order in each plane of cells along the last direction, halo included, and behind the last plane the number of all.
/// @param first  [plane + 1]
inline void first_of_planes(const IndexSpace& index, const MarkerViews& markers, const Array<int>& first) {
  const auto start = markers.start;
  const auto out = first;
  const int plane = index.stride(2);
  Kokkos::parallel_for(
      "corpuscle::transfer::first_of_planes", Policy(0, index.padded(2) + 1), KOKKOS_LAMBDA(int p) { out(p) = start(p * plane); });
}

}  // namespace corpuscle
