// The flow's velocity across a tube or between walls, from the grid.
#pragma once

#include "blood/flow_frame.hpp"
#include "common/sums.hpp"
#include "grid/grid_views.hpp"
#include "membrane/sections.hpp"

namespace corpuscle {

/// Owned cells in the order of their bins.
struct ProfileViews {
  Array<int> cell;               // [owned] padded number
  Array<int> start;              // [bins + 1]
  Components<double> direction;  // [owned, 3] unit vector along the flow; empty where there is one for all
  Array<double> lengthening;     // [owned] 1 / (1 - bend), likewise
};

/// Columns of the sums over a bin.
struct ProfileColumn {
  enum : int {
    volume = 0,  // um3
    speed = 1,   // integral of the velocity along the flow, um4/us
    flow = 2,    // of that as on the centreline
    count = 3
  };
};

/// Of each owned cell, in compact order, its bin and where it is across, um. In an open flow all are in the first bin.
inline void find_bins(const GridViews& grid, const FlowFrame& frame, int bins, const Array<int>& bin, const Array<double>& across) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for_owned(
      "corpuscle::blood::find_bins", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int e = index.compact(i, j, k);
        const FlowPlace place = locate_in_flow(frame, load(x, index.cell(i, j, k)));
        const int at = frame.guided() ? static_cast<int>(place.across / frame.width * bins) : 0;
        bin(e) = at < 0 ? 0 : (at >= bins ? bins - 1 : at);
        across(e) = place.across;
      });
}

/// Fills direction and lengthening.
inline void find_directions(const GridViews& grid, const FlowFrame& frame, const ProfileViews& profile) {
  const auto x = grid.x;
  const auto cell = profile.cell;
  const auto direction = profile.direction;
  const auto lengthening = profile.lengthening;
  Kokkos::parallel_for(
      "corpuscle::blood::find_directions", Policy(0, static_cast<int>(cell.extent(0))), KOKKOS_LAMBDA(int n) {
        const FlowPlace place = locate_in_flow(frame, load(x, cell(n)));
        store(direction, n, place.tangent);
        lengthening(n) = 1 / (1 - place.bend);
      });
}

/// @param parts  [bins * sections, ProfileColumn::count]
inline void sum_profile(const GridViews& grid, const ProfileViews& profile, const Vec3& tangent, const Components<double>& u, int bins,
                        const Table<double>& parts) {
  using Column = ProfileColumn;
  const auto volume = grid.volume, lengthening = profile.lengthening;
  const auto cell = profile.cell, start = profile.start;
  const auto direction = profile.direction;
  const bool bent = direction.data() != nullptr;
  for_sections(
      "corpuscle::blood::profile", bins, KOKKOS_LAMBDA(const SectionTeam& team, int bin, int section) {
        Sums<3> total;
        Kokkos::parallel_reduce(
            section_range(team, start(bin), start(bin + 1), section),
            [&](int n, Sums<3>& sum) {
              const int c = cell(n);
              const double speed = volume(c) * dot(load(u, c), bent ? load(direction, n) : tangent);
              sum[Column::volume] += volume(c);
              sum[Column::speed] += speed;
              sum[Column::flow] += bent ? speed * lengthening(n) : speed;
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          for (int q = 0; q < Column::count; ++q) parts(bin * sections + section, q) = total[q];
        });
      });
}

}  // namespace corpuscle
