// Energies and shape of each membrane, for output.
#pragma once

#include "common/extremes.hpp"
#include "membrane/forces.hpp"

namespace corpuscle {

/// Columns of the table that measure_cells fills, one row a cell.
struct CellColumn {
  enum : int {
    centroid = 0,  // 3, um, of the enclosed volume
    velocity = 3,  // 3, um/us, mean over the vertices
    lower = 6,     // 3, um
    upper = 9,     // 3, um
    area = 12,     // um2
    volume = 13,   // um3
    springs = 14,  // energies, fJ: in-plane, ...
    bending = 15,
    global_area = 16,
    local_area = 17,
    global_volume = 18,
    stretch = 19,  // largest strain of any triangle, as its law has it: with springs, length over l_m of a link
    count = 20
  };
};

/// Per-triangle sums behind the columns: energies and the first moment of the volume.
template <class Law>
KOKKOS_INLINE_FUNCTION Sums<6> triangle_sums(const MembraneViews& m, int t, int type_triangle, const CellLaw& law, const Law& in_plane,
                                             const Vec3& origin) {
  const SurfaceSet& s = m.surface;
  const Components<double>& x = s.x;
  const TriangleRest rest = m.rest(type_triangle);
  const Vec3 normal = load(m.triangle_geometry, t);
  const double area = m.triangle_geometry(t, 3);
  Vec3 corner[3];
  for (int k = 0; k < 3; ++k) corner[k] = load(x, s.triangle(t, k)) - origin;
  const TriangleShape shape = triangle_shape(corner, normal, area);
  Sums<6> sum;
  sum[0] = in_plane.energy(shape, rest);
  for (int k = 0; k < 3; ++k) {
    const Dihedral angle = dihedral(normal, load(m.triangle_geometry, s.neighbour(t, k)), shape.side[k] * (1 / shape.length[k]));
    sum[1] += 0.5 * bending_energy(angle, rest.cos_angle[k], rest.sin_angle[k], law.bending);
  }
  const double ratio = area / rest.area;
  sum[2] = law.local_area * rest.area * (0.5 * (ratio - 1) * (ratio - 1) + Squeeze(ratio).energy);
  // First moment of the tetrahedron from the origin: its volume times the mean of its four corners.
  const Vec3 moment = (area * dot(corner[0], normal) / 12) * (corner[0] + corner[1] + corner[2]);
  sum[3] = moment.x, sum[4] = moment.y, sum[5] = moment.z;
  return sum;
}

/// The rows of the given cells; measure_membranes must have run.
/// @param laws   [type], read for those of the cells
/// @param cells  AllCells or ListedCells
/// @param table  [cells, CellColumn::count]
template <class Law, class Cells>
void measure_cells(const MembraneViews& m, const Array<Law>& laws, const Cells& cells, const Table<double>& table) {
  using Column = CellColumn;
  const auto x = m.surface.x, v = m.surface.v;
  Kokkos::parallel_for(
      "corpuscle::membrane::measure_cells", Kokkos::TeamPolicy<Exec>(cells.count, Kokkos::AUTO), KOKKOS_LAMBDA(const SectionTeam& team) {
        const int cell = cells(team.league_rank()), type = m.type(cell);
        const CellLaw law = m.law(type);
        const Law in_plane = laws(type);
        const int first = m.surface.first_vertex(cell), last = m.surface.first_vertex(cell + 1);
        const int t0 = m.surface.first_triangle(cell), t1 = m.surface.first_triangle(cell + 1);
        const int shift = m.type_first_triangle(type) - t0;
        const Vec3 origin = load(x, first);
        Sums<6> total;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, t0, t1),
            [&](int t, Sums<6>& sum) { sum += triangle_sums(m, t, t + shift, law, in_plane, origin); }, total);
        Sums<3> momentum;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first, last),
            [&](int i, Sums<3>& sum) {
              for (int d = 0; d < 3; ++d) sum[d] += v(i, d);
            },
            momentum);
        double stretch = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, t0, t1),
            [&](int t, double& largest) {
              Vec3 corner[3];
              for (int k = 0; k < 3; ++k) corner[k] = load(x, m.surface.triangle(t, k));
              const TriangleShape shape = triangle_shape(corner, load(m.triangle_geometry, t), m.triangle_geometry(t, 3));
              const double strain = in_plane.strain(shape, m.rest(t + shift));
              largest = larger(largest, strain);
            },
            Largest(stretch));
        Sums<3> lower, upper;
        for (int d = 0; d < 3; ++d) {
          Kokkos::parallel_reduce(
              Kokkos::TeamThreadRange(team, first, last), [&](int i, double& low) { low = smaller(low, x(i, d)); }, Smallest(lower[d]));
          Kokkos::parallel_reduce(
              Kokkos::TeamThreadRange(team, first, last), [&](int i, double& high) { high = larger(high, x(i, d)); }, Largest(upper[d]));
        }
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          const double area = section_total(m.totals, cell, 0), volume = section_total(m.totals, cell, 1);
          const double da = area - law.rest_area, dv = volume - law.rest_volume;
          for (int d = 0; d < 3; ++d) {
            table(cell, Column::centroid + d) = origin[d] + total[3 + d] / volume;
            table(cell, Column::velocity + d) = momentum[d] / (last - first);
            table(cell, Column::lower + d) = lower[d];
            table(cell, Column::upper + d) = upper[d];
          }
          table(cell, Column::area) = area;
          table(cell, Column::volume) = volume;
          table(cell, Column::springs) = total[0];
          table(cell, Column::bending) = total[1];
          table(cell, Column::global_area) = 0.5 * law.area * da * da / law.rest_area;
          table(cell, Column::local_area) = total[2];
          table(cell, Column::global_volume) = 0.5 * law.volume * dv * dv / law.rest_volume;
          table(cell, Column::stretch) = stretch;
        });
      });
}

/// Kinetic energy of all membranes, fJ.
inline double kinetic_energy(const MembraneViews& m) {
  const auto v = m.surface.v;
  double energy = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::kinetic_energy", Policy(0, m.vertices),
      KOKKOS_LAMBDA(int i, double& sum) { sum += 0.5 * m.law(m.type(m.surface.vertex_body(i))).vertex_mass * dot(load(v, i), load(v, i)); },
      energy);
  return energy;
}

}  // namespace corpuscle
