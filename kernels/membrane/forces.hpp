// Internal forces of all membranes at given positions: areas and volumes, forces of each triangle, sums at the
// vertices.
#pragma once

#include "immersed/surface_geometry.hpp"
#include "membrane/membrane_views.hpp"

namespace corpuscle {

/// Normals and areas of the triangles, and area and volume of each section, at positions x [vertex, 3].
inline void measure_membranes(const MembraneViews& m, const Components<double>& x) {
  const SurfaceSet s = m.surface;
  const auto first_triangle = m.surface.first_triangle, first_vertex = m.surface.first_vertex;
  const auto geometry = m.triangle_geometry, totals = m.totals;
  for_sections(
      "corpuscle::membrane::measure", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const Vec3 origin = load(x, first_vertex(cell));
        Sums<2> total;
        Kokkos::parallel_reduce(
            section_range(team, first_triangle(cell), first_triangle(cell + 1), section),
            [&](int t, Sums<2>& sum) {
              const Vec3 corner = load(x, s.triangle(t, 0));
              const Vec3 a = area_vector(corner, load(x, s.triangle(t, 1)), load(x, s.triangle(t, 2)));
              const double area = norm(a);
              store(geometry, t, a * (area > 0 ? 1 / area : 0));
              geometry(t, 3) = area;
              sum[0] += area;
              sum[1] += dot(corner - origin, a) / 3;
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          totals(cell * sections + section, 0) = total[0];
          totals(cell * sections + section, 1) = total[1];
        });
      });
}

/// Forces of each triangle of a part on its corners; measure_membranes must have run at the same x. Marks overstrained cells in
/// m.status.
/// @param laws   [type], read for those of the cells
/// @param cells  AllCells or ListedCells, of the part
template <class Law, class Cells>
void evaluate_triangles(const MembraneViews& m, const Array<Law>& laws, const Cells& cells, const Components<double>& x) {
  for_sections_of(
      "corpuscle::membrane::triangle_forces", cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const SurfaceSet& surface = m.surface;
        const int type = m.type(cell), first = surface.first_triangle(cell);
        const int shift = m.type_first_triangle(type) - first;
        const CellLaw law = m.law(type);
        const Law in_plane = laws(type);
        const double cell_area = section_total(m.totals, cell, 0);
        const double volume = section_total(m.totals, cell, 1);
        const GlobalLoads loads = global_loads(cell_area, volume, law);
        const bool too_large = (Law::holds_area || law.area > 0) && !(std::fabs(cell_area / law.rest_area - 1) <= m.most_area);
        if (too_large || !(std::fabs(volume / law.rest_volume - 1) <= m.most_volume))
          Kokkos::single(Kokkos::PerTeam(team), [&]() { Kokkos::atomic_fetch_max(&m.status(0), cell + 1); });
        Kokkos::parallel_for(section_range(team, first, surface.first_triangle(cell + 1), section), [&](int t) {
          TriangleState state;
          for (int k = 0; k < 3; ++k) {
            state.corner[k] = load(x, surface.triangle(t, k));
            const int other = surface.neighbour(t, k);
            state.other_normal[k] = load(m.triangle_geometry, other);
            state.other_share[k] = BendingShare(m.triangle_geometry(other, 3) / m.rest_area(other + shift)).value;
          }
          state.normal = load(m.triangle_geometry, t);
          state.area = m.triangle_geometry(t, 3);
          Vec3 force[3];
          const double strain = triangle_forces(state, m.rest(t + shift), law, in_plane, loads, force);
          for (int k = 0; k < 3; ++k) {
            for (int d = 0; d < 3; ++d) m.corner_force(t - m.first_triangle, 3 * k + d) = force[k][d];
          }
          if (!(strain < Law::limit)) Kokkos::atomic_fetch_max(&m.status(0), cell + 1);
        });
      });
}

/// See Elasticity::measure_stiffening().
template <class Law, class Cells>
void measure_stiffening(const MembraneViews& m, const Array<Law>& laws, const Cells& cells, const Array<double>& stiffening) {
  const auto x = m.surface.x;
  for_sections_of(
      "corpuscle::membrane::stiffening", cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const SurfaceSet& s = m.surface;
        const int type = m.type(cell), shift = m.type_first_triangle(type) - s.first_triangle(cell);
        const Law in_plane = laws(type);
        Kokkos::parallel_for(section_range(team, s.first_vertex(cell), s.first_vertex(cell + 1), section), [&](int i) {
          double most = 0;
          for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
            const int t = s.ring_triangle(r);
            Vec3 corner[3];
            for (int k = 0; k < 3; ++k) corner[k] = load(x, s.triangle(t, k));
            const double area = m.triangle_geometry(t, 3);
            const TriangleRest rest = m.rest(t + shift);
            const double own = in_plane.stiffening(triangle_shape(corner, load(m.triangle_geometry, t), area), rest) * rest.area / area;
            most = own > most ? own : most;
          }
          stiffening(i) = most;
        });
      });
}

/// Sum of the triangles' forces at vertex i, nN.
KOKKOS_INLINE_FUNCTION Vec3 gather_force(const MembraneViews& m, int i) {
  Vec3 force;
  for (int r = m.surface.ring_start(i); r < m.surface.ring_start(i + 1); ++r) {
    const int t = m.surface.ring_triangle(r) - m.first_triangle, k = 3 * m.surface.ring_corner(r);
    force += Vec3{m.corner_force(t, k), m.corner_force(t, k + 1), m.corner_force(t, k + 2)};
  }
  return force;
}

/// A third of the area vectors around vertex i: on a closed surface the gradient of its volume, um2. The sum of the
/// areas themselves goes to `area`, um2.
KOKKOS_INLINE_FUNCTION Vec3 gather_area(const MembraneViews& m, int i, double& area) {
  Vec3 gradient;
  area = 0;
  for (int r = m.surface.ring_start(i); r < m.surface.ring_start(i + 1); ++r) {
    const int t = m.surface.ring_triangle(r);
    const double third = m.triangle_geometry(t, 3) / 3;
    gradient += third * load(m.triangle_geometry, t);
    area += third;
  }
  return gradient;
}

/// Sums of the triangles' forces, into force [vertex, 3] nN, of a part.
inline void gather_forces(const MembraneViews& m, const Components<double>& force) {
  Kokkos::parallel_for(
      "corpuscle::membrane::gather_forces", Policy(m.first_vertex, m.first_vertex + m.vertices),
      KOKKOS_LAMBDA(int i) { store(force, i, gather_force(m, i)); });
}

}  // namespace corpuscle
