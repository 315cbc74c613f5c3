// Repulsion of membranes by the grid's walls, where markers tell how near they are.
#pragma once

#include "common/extremes.hpp"
#include "contact/contact_law.hpp"
#include "grid/wall_sides.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Distance to a side, and inward across it.
struct WallGap {
  double gap = 1e30;  // um
  Vec3 inward;
};

/// The wall's plane where the grid line of the lattice point xi along d ends.
KOKKOS_INLINE_FUNCTION WallGap gap_to_side(const Lattice& lattice, const Vec3& p, const double (&xi)[3], int d,
                                           int end) {
  double at_wall[3] = {xi[0], xi[1], xi[2]};
  at_wall[d] = end == 0 ? -1 : lattice.index.n[d];
  LatticePoint q;
  lattice.set(q, at_wall);
  Vec3 foot, tangent[3];
  lattice.map(q, foot, tangent);
  const Vec3 across = cross(tangent[(d + 1) % 3], tangent[(d + 2) % 3]);
  const double toward = dot(across, tangent[d]), length = norm(across);
  WallGap wall;
  if (!(length > 0)) return wall;
  wall.inward = ((toward > 0 ? 1.0 : -1.0) * (end == 0 ? 1.0 : -1.0) / length) * across;
  wall.gap = dot(p - foot, wall.inward);
  return wall;
}

/// The nearest of the walls within `reach` of a point that is at a marker or not far from it.
KOKKOS_INLINE_FUNCTION WallGap nearest_wall(const Lattice& lattice, const WallSides& walls, const double (&eta)[3],
                                            const Vec3& p, double reach) {
  double xi[3];
  for (int d = 0; d < 3; ++d) {  // from walls half a cell away to walls at nodes of their own
    const double last = lattice.index.n[d] - 1;
    xi[d] = eta[d];
    if (lattice.boundary_below[d] && eta[d] < 0) xi[d] = 2 * eta[d];
    if (lattice.boundary_above[d] && eta[d] > last) xi[d] = last + 2 * (eta[d] - last);
  }
  WallGap nearest;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      if (!walls.wall[d][end] || !(end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d])) continue;
      const WallGap wall = gap_to_side(lattice, p, xi, d, end);
      if (wall.gap < reach && wall.gap < nearest.gap) nearest = wall;
    }
  return nearest;
}

/// um from any of the sides, within `reach`, of the vertices [vertex, 3] whose markers are at home; 1e30 where none is so near.
/// Vertices may have moved on since the markers were placed, by less than walls bend.
inline double least_wall_gap(const Lattice& grid_lattice, const MarkerViews& markers, const WallSides& wall_sides,
                             const Components<double>& vertices, double reach) {
  const Lattice lattice = grid_lattice;
  const auto x = vertices;
  const MarkerViews m = markers;
  const WallSides walls = wall_sides;
  double least = 1e30;
  Kokkos::parallel_reduce(
      "corpuscle::contact::least_wall_gap", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker, double& sum) {
        if (!m.home(marker)) return;
        const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        sum = smaller(sum, nearest_wall(lattice, walls, eta, load(x, m.vertex(marker)), reach).gap);
      },
      Smallest(least));
  return least;
}

/// fJ, of the walls' repulsion, at vertices as above.
inline double wall_energy(const Lattice& grid_lattice, const MarkerViews& markers, const WallSides& wall_sides,
                          const ContactLaw& contact_law, const Array<double>& rest_area, const Components<double>& vertices) {
  const Lattice lattice = grid_lattice;
  const MarkerViews m = markers;
  const WallSides walls = wall_sides;
  const ContactLaw law = contact_law;
  const auto x = vertices;
  double energy = 0;
  Kokkos::parallel_reduce(
      "corpuscle::contact::wall_energy", Policy(0, m.count),
      KOKKOS_LAMBDA(int marker, double& sum) {
        if (!m.home(marker)) return;
        const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        const int v = m.vertex(marker);
        const WallGap wall = nearest_wall(lattice, walls, eta, load(x, v), law.range);
        if (wall.gap < law.range) sum += rest_area(v) * law.repulsion_energy(wall.gap);
      },
      energy);
  return energy;
}

/// force [vertex, 3] = that of the walls on the vertices at home, nN; zero elsewhere. Areas at rest.
inline void wall_forces(const Lattice& grid_lattice, const MarkerViews& markers, const WallSides& wall_sides,
                        const ContactLaw& contact_law, const Array<double>& rest_area, const Components<double>& vertices,
                        const Components<double>& force) {
  const Lattice lattice = grid_lattice;
  const MarkerViews m = markers;
  const WallSides walls = wall_sides;
  const ContactLaw law = contact_law;
  const auto x = vertices;
  Kokkos::deep_copy(Exec(), force, 0.0);
  Kokkos::parallel_for(
      "corpuscle::contact::wall_forces", Policy(0, m.count), KOKKOS_LAMBDA(int marker) {
        if (!m.home(marker)) return;
        const double eta[3] = {m.eta(marker, 0), m.eta(marker, 1), m.eta(marker, 2)};
        const int v = m.vertex(marker);
        const WallGap wall = nearest_wall(lattice, walls, eta, load(x, v), law.range);
        if (wall.gap < law.range) store(force, v, (rest_area(v) * law.repulsion(wall.gap)) * wall.inward);
      });
}

}  // namespace corpuscle
