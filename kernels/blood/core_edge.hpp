// How far out cells reach, seen from the side.
#pragma once

#include "blood/flow_frame.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

inline constexpr double nobody = -1e300;

/// Directions in which one looks for the outermost membrane: around a tube, or up and down between walls.
KOKKOS_INLINE_FUNCTION int view_count(const FlowFrame& frame) { return frame.tube() ? 16 : 2; }

/// Columns of the table beside one for each view: how far up and down along the flow a window is filled.
inline constexpr int filled_columns = 2;

KOKKOS_INLINE_FUNCTION void reach_out(const FlowFrame& frame, const FlowPlace& place, int window, double within,
                                      const Table<double>& edge) {
  if (window < 0) return;
  const int views = view_count(frame);
  for (int k = 0; k < views; ++k) {
    double reach = k == 0 ? place.across : -place.across;
    if (frame.tube()) {
      const double angle = 6.283185307179586 * k / views;
      reach = std::cos(angle) * dot(place.offset, place.normal) + std::sin(angle) * dot(place.offset, place.binormal);
    }
    Kokkos::atomic_fetch_max(&edge(window, k), reach);
  }
  Kokkos::atomic_fetch_max(&edge(window, views), within);
  Kokkos::atomic_fetch_max(&edge(window, views + 1), -within);
}

/// edge [window, view]: the largest extent in each direction of any membrane in each window, um; `nobody` where there
/// is none. Of tubes from the centreline; between walls the height, and minus the lowest height. A triangle's extremes
/// in a window are its corners and where its sides pass into another window. A largest is the same in any order. Then
/// the largest and minus the smallest share of the window at which there is a membrane.
inline void find_core_edge(const SurfaceSet& set, int triangles, const FlowFrame& frame, int windows, const Table<double>& edge) {
  Kokkos::deep_copy(Exec(), edge, nobody);
  const auto x = set.x;
  const SurfaceSet s = set;
  const FlowFrame f = frame;
  Kokkos::parallel_for(
      "corpuscle::blood::core_edge", Policy(0, triangles), KOKKOS_LAMBDA(int t) {
        Vec3 corner[3];
        double along[3];
        for (int k = 0; k < 3; ++k) {
          corner[k] = load(x, s.triangle(t, k));
          const FlowPlace place = locate_in_flow(f, corner[k]);
          along[k] = windows_along(f, corner[k], place, windows);
          reach_out(f, place, window_number(f, along[k], windows), along[k] - std::floor(along[k]), edge);
        }
        for (int k = 0; k < 3; ++k) {
          const int next = (k + 1) % 3;
          if (along[next] < along[k]) continue;  // the neighbour has this side the other way round
          for (double at = std::floor(along[k]) + 1; at < along[next]; at += 1) {
            const double share = (at - along[k]) / (along[next] - along[k]);
            const FlowPlace place = locate_in_flow(f, corner[k] + share * (corner[next] - corner[k]));
            reach_out(f, place, window_number(f, at - 0.5, windows), 1, edge);
            reach_out(f, place, window_number(f, at + 0.5, windows), 0, edge);
          }
        }
      });
}

/// Between the wall and the outermost membranes, um: the mean over windows and views, each window for what of it is
/// filled. Not a number without any. @param edge  as find_core_edge() fills it, on the host, a window after the other
inline double cell_free_layer(const FlowFrame& frame, int windows, const double* edge) {
  const int views = view_count(frame);
  double sum = 0, weight = 0;
  for (int w = 0; w < windows; ++w, edge += views + filled_columns) {
    if (edge[0] == nobody) continue;
    const double filled = edge[views] + edge[views + 1];
    for (int k = 0; k < views; ++k) sum += filled * ((!frame.tube() && k == 1 ? 0 : frame.width) - edge[k]);
    weight += filled * views;
  }
  return weight > 0 ? sum / weight : std::nan("");
}

}  // namespace corpuscle
