// How much of the fluid is cells, and how fast they go: integrals over their membranes, exact whatever the grid.
//
// The volume that a cell has within some radius is the flux through its membrane of a field whose divergence is one
// there and zero beyond; the flow of its inside along the tube, whose divergence is nothing, that of its velocity times
// the way along.
#pragma once

#include "blood/flow_frame.hpp"
#include "common/sums.hpp"
#include "immersed/surface_geometry.hpp"
#include "membrane/sections.hpp"

namespace corpuscle {

inline constexpr int most_bins = 32;

/// Columns of the sums.
struct CellFlowColumn {
  enum : int {
    volume = 0,  // um3
    flow = 1,    // integral over the volume of the velocity along the tube, as on its centreline, um4/us
    within = 2   // volume within the outer edge of each bin, um3
  };
};
using CellFlowSums = Sums<CellFlowColumn::within + most_bins>;

/// A triangle's share: its four quarters, each by the middles of its sides, which is exact for quadratic integrands.
KOKKOS_INLINE_FUNCTION void add_cell_flow(const FlowFrame& frame, int bins, const Vec3 (&x)[3], const Vec3 (&v)[3], const Vec3& origin,
                                          CellFlowSums& sum) {
  using Column = CellFlowColumn;
  const Vec3 area = area_vector(x[0], x[1], x[2]);
  sum[Column::volume] += dot(x[0] - origin, area) / 3;
  for (int corner = 0; corner < 3; ++corner)
    for (int kind = 0; kind < 3; ++kind) {
      const int next = (corner + 1) % 3, last = (corner + 2) % 3;
      double share[3];
      share[corner] = kind == 0 ? 0.75 : (kind == 1 ? 0.25 : 0.5);
      share[next] = kind == 0 ? 0.25 : (kind == 1 ? 0.75 : 0.25);
      share[last] = kind == 2 ? 0.25 : 0.0;
      const double weight = (kind == 2 ? 2.0 : 1.0) / 12;
      const Vec3 at = share[0] * x[0] + share[1] * x[1] + share[2] * x[2];
      const Vec3 velocity = share[0] * v[0] + share[1] * v[1] + share[2] * v[2];
      const FlowPlace place = locate_in_flow(frame, at);
      sum[Column::flow] += weight * place.along * dot(velocity, area);
      const double outward = weight * dot(place.outward, area);
      for (int b = 0; b < bins; ++b) {
        const double edge = frame.width * (b + 1) / bins;
        sum[Column::within + b] += outward * volume_field(frame, place, edge);
      }
    }
}

/// Sums over the first `cells` cells. @param parts  [cells * sections, columns]; @param totals  [columns], columns = 2
/// + bins
inline void sum_cell_flow(const SurfaceSet& set, int cells, const FlowFrame& frame, int bins, const Table<double>& parts,
                          const Array<double>& totals) {
  const auto x = set.x, v = set.v;
  const SurfaceSet s = set;
  const auto first_triangle = set.first_triangle, first_vertex = set.first_vertex;
  const int columns = CellFlowColumn::within + bins;
  for_sections(
      "corpuscle::blood::cell_flow", cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const Vec3 origin = load(x, first_vertex(cell));
        CellFlowSums total;
        Kokkos::parallel_reduce(
            section_range(team, first_triangle(cell), first_triangle(cell + 1), section),
            [&](int t, CellFlowSums& sum) {
              Vec3 corner[3], velocity[3];
              for (int k = 0; k < 3; ++k) corner[k] = load(x, s.triangle(t, k)), velocity[k] = load(v, s.triangle(t, k));
              add_cell_flow(frame, bins, corner, velocity, origin, sum);
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          for (int q = 0; q < columns; ++q) parts(cell * sections + section, q) = total[q];
        });
      });
  Kokkos::parallel_for(
      "corpuscle::blood::cell_flow_totals", Policy(0, columns), KOKKOS_LAMBDA(int q) {
        double total = 0;
        for (int row = 0; row < cells * sections; ++row) total += parts(row, q);
        totals(q) = total;
      });
}

}  // namespace corpuscle
