// The part of a membrane's force that its normal carries as a jump of the pressure: not smeared out, but the difference of
// pressure across the faces whose grid lines, between the centres of cells, a triangle cuts. Of a uniform load these are the
// differences of a pressure that is one inside and another outside, cell by cell, on any grid: it is balanced exactly. Sums are of
// integers, so that bits do not depend on their order.
#pragma once

#include <cmath>

#include "common/extremes.hpp"
#include "fluid/flux.hpp"
#include "immersed/surface_geometry.hpp"
#include "transfer/crossings.hpp"

namespace corpuscle {

/// A third of the area vectors around a vertex, um2, and of their lengths: its part in the change of the volume by its motion.
struct VertexArea {
  Vec3 vector;
  double whole = 0;
};
KOKKOS_INLINE_FUNCTION VertexArea vertex_area(const SurfaceSet& set, int v) {
  VertexArea area;
  for (int r = set.ring_start(v); r < set.ring_start(v + 1); ++r) {
    const Vec3 a = area_vector(set, set.ring_triangle(r));
    area.vector += a;
    area.whole += norm(a);
  }
  area.vector *= 1.0 / 3;
  area.whole /= 3;
  return area;
}

/// jump [vertex], kPa, of the pressure from inside to outside = the part of the forces [vertex, 3], nN, along the normal, over
/// the area.
inline void normal_loads(const SurfaceSet& surface, const Components<double>& force, const Array<double>& jump) {
  const SurfaceSet set = surface;
  const auto f = force;
  const auto out = jump;
  Kokkos::parallel_for(
      "corpuscle::transfer::jump_load", Policy(0, set.vertices), KOKKOS_LAMBDA(int v) {
        constexpr double folded = 0.25;  // square of the area vector over that of the area: below, a normal says little
        const VertexArea area = vertex_area(set, v);
        const double square = dot(area.vector, area.vector), least = folded * area.whole * area.whole;
        out(v) = least > 0 ? dot(load(f, v), area.vector) / (square > least ? square : least) : 0;
      });
}

/// smooth [vertex] = the mean over the triangles around each vertex. Of a load that changes from vertex to vertex, grid lines a
/// spacing apart see too much or too little; what is taken off is spread.
inline void smooth_loads(const SurfaceSet& surface, const Array<double>& jump, const Array<double>& smooth) {
  const SurfaceSet set = surface;
  const auto in = jump, out = smooth;
  Kokkos::parallel_for(
      "corpuscle::transfer::jump_smooth", Policy(0, set.vertices), KOKKOS_LAMBDA(int v) {
        double sum = 0;
        for (int r = set.ring_start(v); r < set.ring_start(v + 1); ++r)
          for (int k = 0; k < 3; ++k) sum += in(set.triangle(set.ring_triangle(r), k));
        const int triangles = set.ring_start(v + 1) - set.ring_start(v);
        out(v) = triangles > 0 ? sum / (3 * triangles) : 0;
      });
}

/// rest [vertex, 3] nN = what the jumps leave of the forces: jumps that are linear on triangles add up to jump x area vector.
inline void rest_of_loads(const SurfaceSet& surface, const Components<double>& force, const Array<double>& jump,
                          const Components<double>& rest) {
  const SurfaceSet set = surface;
  const auto f = force, out = rest;
  const auto of = jump;
  Kokkos::parallel_for(
      "corpuscle::transfer::jump_rest", Policy(0, set.vertices),
      KOKKOS_LAMBDA(int v) { store(out, v, load(f, v) - of(v) * vertex_area(set, v).vector); });
}

/// Largest magnitude of the jumps; not a number if any is not.
inline double largest_jump(int vertices, const Array<double>& of_vertex) {
  const auto jump = of_vertex;
  double most = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::jump_largest", Policy(0, vertices),
      KOKKOS_LAMBDA(int v, double& largest) { largest = larger(largest, std::fabs(jump(v))); }, Largest(most));
  return most;
}

/// On which of the two faces beside the nearest centre a crossing of a line lies: the one below (0) or above (1). By the side of
/// the triangle's plane that the centre is on, which is the same for the lines of all directions through it: else a centre within
/// rounding of the surface would be inside along one and outside along another. Corners are half a unit higher than they say: where
/// one were a centre itself, its triangles would not agree.
KOKKOS_INLINE_FUNCTION int beyond_centre(const std::int64_t (&corner)[3][3], const int (&centre)[3], int sign) {
  Vec3 relative[3];
  for (int k = 0; k < 3; ++k)
    for (int m = 0; m < 3; ++m) relative[k][m] = static_cast<double>(2 * (corner[k][m] - centre[m] * inside_unit) + 1);
  const bool inside = dot(relative[0], cross(relative[1], relative[2])) >= 0;
  return inside == (sign < 0) ? 1 : 0;
}

/// Whether a triangle reaches from this block to where vertices are not known: over more than two spacings.
inline bool jumps_beyond_knowledge(const MarkerSearch& search, const VertexPlaces& vertex_places, const SurfaceSet& set) {
  const MarkerSearch s = search;
  const VertexPlaces places = vertex_places;
  const SurfaceSet surface = set;
  int broken = 0;
  Kokkos::parallel_reduce(
      "corpuscle::transfer::jump_reach", Policy(0, set.triangles),
      KOKKOS_LAMBDA(int t, int& most) {
        bool all = true, near = false;
        for (int k = 0; k < 3; ++k) {
          std::int64_t at[3];
          const bool known = place_in_units(s, places, surface.triangle(t, k), at);
          all = all && known;
          if (!known) continue;
          const std::int64_t alone[3][3] = {{at[0], at[1], at[2]}, {at[0], at[1], at[2]}, {at[0], at[1], at[2]}};
          near = near || !beyond_block(s.lattice.index, alone);
        }
        if (near && !all) most = 1;
      },
      Kokkos::Max<int>(broken));
  return broken > 0;
}

/// sum [cell] = what triangles add to the difference of pressure across faces of direction d of this rank, times `scale`.
inline void sum_jumps(const MarkerSearch& search, const VertexPlaces& vertex_places, const SurfaceSet& set, int d,
                      const Array<double>& of_vertex, double scale, const Array<std::int64_t>& sums) {
  Kokkos::deep_copy(Exec(), sums, std::int64_t(0));
  const MarkerSearch s = search;
  const VertexPlaces places = vertex_places;
  const SurfaceSet surface = set;
  const auto jump = of_vertex;
  const auto sum = sums;
  Kokkos::parallel_for(
      "corpuscle::transfer::jump_sum", Policy(0, set.triangles), KOKKOS_LAMBDA(int t) {
        const IndexSpace& index = s.lattice.index;
        std::int64_t corner[3][3];
        for (int k = 0; k < 3; ++k)
          if (!place_in_units(s, places, surface.triangle(t, k), corner[k])) return;
        if (beyond_block(index, corner)) return;
        visit_crossings(index, corner, d, 1, [&](const Crossing& crossing, const int(&line)[3]) {
          int centre[3] = {line[0], line[1], line[2]};
          centre[d] = static_cast<int>(floor_units(crossing.at + inside_unit / 2));
          const int row = centre[d] + beyond_centre(corner, centre, crossing.sign);
          if (row < 0 || row > index.n[d]) return;
          double value = 0;
          for (int k = 0; k < 3; ++k) value += crossing.share[k] * jump(surface.triangle(t, k));
          const auto part = static_cast<std::int64_t>(std::floor(-crossing.sign * scale * value + 0.5));
          Kokkos::atomic_add(&sum(index.cell(line[0], line[1], line[2]) + row * index.stride(d)), part);
        });
      });
}

/// across += sums / scale at faces of direction d of this rank.
inline void add_jumps(const IndexSpace& index, int d, const Array<std::int64_t>& sums, double scale, const Array<double>& across) {
  const auto sum = sums;
  const auto to = across;
  const double factor = 1 / scale;
  const CellBox box = face_box(index, d);
  for_box(
      "corpuscle::transfer::jump_add", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        to(c) += factor * static_cast<double>(sum(c));
      });
}

}  // namespace corpuscle
