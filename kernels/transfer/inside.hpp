// How much of each grid cell is inside membranes: signed crossings of the grid's index lines with triangles, counted in
// integers, so that neither the order of the sums nor rounding in the geometry matters.
#pragma once

#include "transfer/crossings.hpp"

namespace corpuscle {

/// For each direction, over the cells of the block in units: first what the crossings of the line through a cell change
/// there, then what they add up to, the part of the cell that is inside. The last halo cell below a line holds where it
/// starts from.
struct InsideViews {
  Array<int> part[3];  // [cell]
};

/// Triangles whose interior is `material`, by the cell they are of. Copies of cells beyond periodic sides are bodies of their own.
struct InsideSurface {
  Table<int> triangle;       // [triangle, 3] vertex numbers
  Array<int> triangle_body;  // [triangle]
  Array<int> type;           // [body]
  Array<int> material;       // [type]
  Table<int> turns;          // [body, 3] periods by which it has been shifted to where this block sees it
};

/// What a triangle changes on the lines along d of this block.
KOKKOS_INLINE_FUNCTION void add_crossings(const Lattice& lattice, const std::int64_t (&corner)[3][3], int d, int turns,
                                          const Array<int>& part) {
  const IndexSpace& index = lattice.index;
  constexpr std::int64_t half = inside_unit / 2;
  visit_crossings(index, corner, d, 0, [&](const Crossing& crossing, const int (&line)[3]) {
    std::int64_t from_side = crossing.at + half;  // of the block
    if (lattice.boundary_above[d] && from_side >= index.n[d] * inside_unit) from_side = index.n[d] * inside_unit - 1;
    const std::int64_t cell = floor_units(from_side);
    if (cell < 0 || cell >= index.n[d]) return;
    const int within = static_cast<int>(from_side - cell * inside_unit);  // of the cell, before the crossing
    const int start = index.cell(line[0], line[1], line[2]), s = index.stride(d), c = start + static_cast<int>(cell) * s;
    Kokkos::atomic_add(&part(c), crossing.sign * (static_cast<int>(inside_unit) - within));
    Kokkos::atomic_add(&part(c + s), crossing.sign * within);
    if (turns != 0) Kokkos::atomic_add(&part(start - s), crossing.sign * turns * static_cast<int>(inside_unit));
  });
}

/// Fills `inside` with the changes along each line. A line that comes in through a periodic side is inside as often as,
/// over all crossings, sign x the periods that they were shifted by along it: a crossing shifted by -1 is of a surface
/// whose earlier crossings are at the other end. Any sum of integers is the same in any order.
inline void count_crossings(const MarkerSearch& search, const VertexPlaces& vertex_places, const InsideSurface& surface,
                            int triangles, int material, const InsideViews& inside) {
  for (const auto& part : inside.part) Kokkos::deep_copy(Exec(), part, 0);
  const MarkerSearch s = search;
  const VertexPlaces places = vertex_places;
  const InsideSurface of = surface;
  const InsideViews out = inside;
  Kokkos::parallel_for(
      "corpuscle::transfer::inside_crossings", Policy(0, triangles), KOKKOS_LAMBDA(int t) {
        const int body = of.triangle_body(t);
        if (of.material(of.type(body)) != material) return;
        std::int64_t corner[3][3];
        for (int k = 0; k < 3; ++k)
          if (!place_in_units(s, places, of.triangle(t, k), corner[k])) return;
        if (beyond_block(s.lattice.index, corner)) return;
        for (int d = 0; d < 3; ++d) add_crossings(s.lattice, corner, d, of.turns(body, d), out.part[d]);
      });
}

/// The line of cells along d with number `line`: the cell below its first.
KOKKOS_INLINE_FUNCTION int line_start(const IndexSpace& index, int d, int line) {
  const int e = d == 0 ? 1 : 0, f = d == 2 ? 1 : 2;
  int at[3];
  at[d] = -1, at[e] = line % index.n[e], at[f] = line / index.n[e];
  return index.cell(at[0], at[1], at[2]);
}
inline int count_lines(const IndexSpace& index, int d) { return index.owned() / index.n[d]; }

/// ends [2 lines]: what each line starts from, then the sum of its changes.
inline void sum_lines_inside(const IndexSpace& index, int d, const Array<int>& part, const Array<int>& ends) {
  const int lines = count_lines(index, d), n = index.n[d], s = index.stride(d);
  Kokkos::parallel_for(
      "corpuscle::transfer::inside_ends", Policy(0, lines), KOKKOS_LAMBDA(int line) {
        const int start = line_start(index, d, line);
        int sum = 0;
        for (int i = 1; i <= n + 1; ++i) sum += part(start + i * s);
        ends(line) = part(start);
        ends(lines + line) = sum;
      });
}
inline void set_line_starts(const IndexSpace& index, int d, const Array<int>& ends, const Array<int>& part) {
  Kokkos::parallel_for(
      "corpuscle::transfer::inside_starts", Policy(0, count_lines(index, d)),
      KOKKOS_LAMBDA(int line) { part(line_start(index, d, line)) = ends(line); });
}

/// From changes to what is inside, along every line. Where no other rank has a part of the lines, all changes of a line
/// add up to nothing, or it has met a surface that is not closed: broken(0) = 1.
inline void add_up_inside(const IndexSpace& index, int d, bool alone, const Array<int>& part,
                          const Array<int>& broken) {
  const int n = index.n[d], s = index.stride(d);
  Kokkos::parallel_for(
      "corpuscle::transfer::inside", Policy(0, count_lines(index, d)), KOKKOS_LAMBDA(int line) {
        const int start = line_start(index, d, line);
        int sum = part(start);
        for (int i = 1; i <= n; ++i) {
          sum += part(start + i * s);
          part(start + i * s) = sum;
        }
        sum += part(start + (n + 1) * s);
        if (alone && sum != part(start)) Kokkos::atomic_fetch_max(&broken(0), 1);
      });
}

/// Means over each cell of the viscosity over that outside, and of its inverse.
struct CytosolViews {
  Array<double> relative, fluidity;  // [cell]
};

/// Adds what a fluid of `ratio` does to them by the part of each cell that is inside, the mean of the three directions';
/// `first`: from 1. @param least  what no viscosity is below, where surfaces overlap too
inline void add_relative_viscosity(const IndexSpace& index, const InsideViews& inside, double ratio, bool first, double least,
                                   const CytosolViews& cytosol) {
  const double whole = 3.0 * inside_unit;
  const auto p0 = inside.part[0], p1 = inside.part[1], p2 = inside.part[2];
  const CytosolViews out = cytosol;
  for_owned(
      "corpuscle::transfer::inside_viscosity", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const double sum = static_cast<double>(p0(c)) + p1(c) + p2(c);
        const double share = sum < 0 ? 0 : (sum > whole ? 1 : sum / whole);  // where surfaces overlap
        const double relative = (first ? 1.0 : out.relative(c)) + (ratio - 1) * share;
        const double fluidity = (first ? 1.0 : out.fluidity(c)) + (1 / ratio - 1) * share;
        out.relative(c) = relative > least ? relative : least;
        out.fluidity(c) = fluidity * out.relative(c) > 1 ? fluidity : 1 / out.relative(c);
      });
}

}  // namespace corpuscle
