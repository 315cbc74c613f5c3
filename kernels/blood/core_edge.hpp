// How far out cells reach, seen from the side.
#pragma once

#include "blood/flow_frame.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

inline constexpr double nobody = -1e300;

/// Directions in which one looks for the outermost membrane: around a tube, or up and down between walls.
KOKKOS_INLINE_FUNCTION int view_count(const FlowFrame& frame) { return frame.tube() ? 16 : 2; }

/// edge [window, view]: the largest extent in each direction of any vertex in each window, um; `nobody` where there is none. Of
/// tubes from the centreline; between walls the height, and minus the lowest height. A largest is the same in any order.
inline void find_core_edge(const SurfaceSet& set, int vertices, const FlowFrame& frame, int windows, const Table<double>& edge) {
  Kokkos::deep_copy(Exec(), edge, nobody);
  const auto x = set.x;
  const int views = view_count(frame);
  Kokkos::parallel_for(
      "corpuscle::blood::core_edge", Policy(0, vertices), KOKKOS_LAMBDA(int i) {
        const Vec3 at = load(x, i);
        const FlowPlace place = locate_in_flow(frame, at);
        const int window = window_of(frame, at, place, windows);
        if (window < 0) return;
        for (int k = 0; k < views; ++k) {
          const double angle = 6.283185307179586 * k / views;
          const double reach = frame.tube() ? std::cos(angle) * dot(place.offset, place.normal) + std::sin(angle) * dot(place.offset, place.binormal)
                                            : (k == 0 ? place.across : -place.across);
          Kokkos::atomic_fetch_max(&edge(window, k), reach);
        }
      });
}

}  // namespace corpuscle
