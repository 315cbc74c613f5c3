// Repulsion of membranes by the grid's walls, where markers tell how near they are.
#pragma once

#include "common/extremes.hpp"
#include "contact/contact_law.hpp"
#include "contact/contact_views.hpp"
#include "grid/wall_sides.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Distance to a side, and inward across it.
struct WallGap {
  double gap = 1e30;  // um
  Vec3 inward;
};

/// The wall's plane where the grid line of the lattice point xi along d ends; far unless the point is within a few of the cells
/// next to the wall, or within twice the reach by their width: a plane knows nothing of how the wall bends, and in a tube that
/// turns back cells far away are behind the plane of its end.
KOKKOS_INLINE_FUNCTION WallGap gap_to_side(const Lattice& lattice, const Vec3& p, const double (&xi)[3], int d, int end, double reach) {
  constexpr double few = 4;  // cells
  double at_wall[3] = {xi[0], xi[1], xi[2]};
  at_wall[d] = end == 0 ? -1 : lattice.index.n[d];
  LatticePoint q;
  lattice.set(q, at_wall);
  Vec3 foot, tangent[3];
  lattice.map(q, foot, tangent);
  const Vec3 across = cross(tangent[(d + 1) % 3], tangent[(d + 2) % 3]);
  const double toward = dot(across, tangent[d]), length = norm(across);
  WallGap wall;
  const double cells = end == 0 ? xi[d] + 1 : lattice.index.n[d] - xi[d];
  if (!(length > 0) || (cells > few && cells * norm(tangent[d]) > reach)) return wall;
  wall.inward = ((toward > 0 ? 1.0 : -1.0) * (end == 0 ? 1.0 : -1.0) / length) * across;
  wall.gap = dot(p - foot, wall.inward);
  return wall;
}

/// The shortest of the four links across a side around each of its cells.
struct SideLinks {
  int lower[2] = {}, cells[2] = {};  // of the lattice along the side
  Array<float> length;               // [cell] um; empty where nothing is known

  /// @param e, f  index coordinates along the side, clamped to it
  KOKKOS_INLINE_FUNCTION double at(double e, double f) const {
    const double along[2] = {e, f};
    int cell[2];
    for (int d = 0; d < 2; ++d) {
      const double n = std::floor(along[d]) - lower[d];
      cell[d] = static_cast<int>(n > 0 ? (n < cells[d] - 1 ? n : cells[d] - 1) : 0);
    }
    return length(cell[0] + cells[0] * cell[1]);
  }
  /// Whether gap_to_side() finds a point so many cells away far, whatever its map says: that costs more.
  KOKKOS_INLINE_FUNCTION bool clear(double away, double e, double f, double reach) const {
    constexpr double cells_at_walls = 4, between_nodes = 0.5;  // of a link, where the directions of the four differ
    return length.extent(0) > 0 && away > cells_at_walls && away * between_nodes * at(e, f) > reach;
  }
};
struct WallLinks {
  SideLinks side[3][2];
};

/// The nearest of the walls within `reach` of a point that is at a marker or not far from it.
KOKKOS_INLINE_FUNCTION WallGap nearest_wall(const Lattice& lattice, const WallSides& walls, const WallLinks& links, const double (&eta)[3],
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
      const double away = end == 0 ? xi[d] + 1 : lattice.index.n[d] - xi[d];
      if (links.side[d][end].clear(away, xi[(d + 1) % 3], xi[(d + 2) % 3], reach)) continue;
      const WallGap wall = gap_to_side(lattice, p, xi, d, end, reach);
      if (wall.gap < reach && wall.gap < nearest.gap) nearest = wall;
    }
  return nearest;
}

/// The least way from a side to the other end of this block along d, um.
inline double least_thickness(const Lattice& of_block, int d, int end) {
  const Lattice lattice = of_block;
  const int e = (d + 1) % 3, f = (d + 2) % 3, across = lattice.index.n[e], last = lattice.index.n[d];
  double least = 1e30;
  Kokkos::parallel_reduce(
      "corpuscle::contact::least_thickness", Policy(0, across * lattice.index.n[f]),
      KOKKOS_LAMBDA(int n, double& sum) {
        double xi[3];
        const int row = n / across;
        xi[e] = n % across, xi[f] = row;
        Vec3 at[2], tangent[3];
        for (int far = 0; far < 2; ++far) {
          LatticePoint q;
          xi[d] = end == 0 ? (far == 0 ? -1 : last - 0.5) : (far == 0 ? last : -0.5);
          lattice.set(q, xi);
          lattice.map(q, at[far], tangent);
        }
        sum = smaller(sum, norm(at[1] - at[0]));
      },
      Smallest(least));
  return least;
}

inline SideLinks links_across(const Lattice& of_block, int d, int end) {
  const Lattice lattice = of_block;
  const int e = (d + 1) % 3, f = (d + 2) % 3;
  SideLinks links{{lattice.lower[e], lattice.lower[f]}, {lattice.upper[e] - lattice.lower[e], lattice.upper[f] - lattice.lower[f]}, {}};
  const int cells = links.cells[0] * links.cells[1];
  links.length = Array<float>(uninitialised("corpuscle::contact::side_links"), cells);
  const SideLinks out = links;
  Kokkos::parallel_for(
      "corpuscle::contact::side_links", Policy(0, cells), KOKKOS_LAMBDA(int n) {
        double least = 1e30;
        for (int corner = 0; corner < 4; ++corner) {
          int at[3];
          at[d] = end == 0 ? lattice.lower[d] : lattice.upper[d] - 1;
          at[e] = out.lower[0] + n % out.cells[0] + corner % 2;
          at[f] = out.lower[1] + n / out.cells[0] + corner / 2;
          const int c = lattice.node(at[0], at[1], at[2]);
          least = smaller(least, norm(lattice.position(c + lattice.index.stride(d)) - lattice.position(c)));
        }
        out.length(n) = static_cast<float>(least);
      });
  return links;
}

/// Of the grid's sides that end the lattice.
inline WallLinks links_across_walls(const Lattice& lattice) {
  WallLinks links;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end)
      if (end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d]) links.side[d][end] = links_across(lattice, d, end);
  return links;
}

/// Walls beside vertices whose markers are at home. Vertices may have moved on since the markers were placed, by less than walls
/// bend.
struct WallContacts {
  Lattice lattice;
  MarkerViews markers;
  WallSides walls;
  SurfaceSet surface;  // of the vertices
  double reach = 0;    // um
  WallLinks links{};

  /// Of a marker's vertex; far where no wall is within reach, or the marker is not at home.
  KOKKOS_INLINE_FUNCTION WallGap of(int marker) const {
    if (!markers.home(marker)) return {};
    return nearest_wall(lattice, walls, links, MarkerPlace(lattice, markers, marker).eta, load(surface.x, markers.vertex(marker)), reach);
  }
};

/// um; 1e30 where none is within reach.
inline double least_wall_gap(const WallContacts& contacts) {
  const WallContacts c = contacts;
  double least = 1e30;
  Kokkos::parallel_reduce(
      "corpuscle::coupling::least_wall_gap", Policy(0, c.markers.count),
      KOKKOS_LAMBDA(int marker, double& sum) { sum = smaller(sum, c.of(marker).gap); }, Smallest(least));
  return least;
}

/// fJ, of the walls' repulsion.
inline double wall_energy(const WallContacts& contacts, const ContactLaw& contact_law, const ContactRest& at_rest) {
  const WallContacts c = contacts;
  const ContactLaw law = contact_law;
  const ContactRest rest = at_rest;
  double energy = 0;
  Kokkos::parallel_reduce(
      "corpuscle::contact::wall_energy", Policy(0, c.markers.count),
      KOKKOS_LAMBDA(int marker, double& sum) {
        const WallGap wall = c.of(marker);
        if (wall.gap < law.range) sum += rest.area_of(c.surface, c.markers.vertex(marker)) * law.repulsion_energy(wall.gap);
      },
      energy);
  return energy;
}

/// force [vertex, 3] = that of the walls on the vertices at home, nN; zero elsewhere.
inline void wall_forces(const WallContacts& contacts, const ContactLaw& contact_law, const ContactRest& at_rest,
                        const Components<double>& force) {
  const WallContacts c = contacts;
  const ContactLaw law = contact_law;
  const ContactRest rest = at_rest;
  Kokkos::deep_copy(Exec(), force, 0.0);
  Kokkos::parallel_for(
      "corpuscle::contact::wall_forces", Policy(0, c.markers.count), KOKKOS_LAMBDA(int marker) {
        const WallGap wall = c.of(marker);
        const int v = c.markers.vertex(marker);
        if (wall.gap < law.range) store(force, v, (rest.area_of(c.surface, v) * law.repulsion(wall.gap)) * wall.inward);
      });
}

}  // namespace corpuscle
