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
  SurfaceSet set;
  Array<int> type;      // [body]
  Array<int> material;  // [type]
  Table<int> turns;     // [body, 3] periods by which it has been shifted to where this block sees it
};

/// What a triangle changes on the lines along d of this block.
KOKKOS_INLINE_FUNCTION void add_crossings(const Lattice& lattice, const std::int64_t (&corner)[3][3], int d, int turns,
                                          const Array<int>& part) {
  const IndexSpace& index = lattice.index;
  constexpr std::int64_t half = inside_unit / 2;
  visit_crossings(index, corner, d, 0, [&](const Crossing& crossing, const int(&line)[3]) {
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
inline void count_crossings(const MarkerSearch& search, const VertexPlaces& vertex_places, const InsideSurface& surface, int material,
                            const InsideViews& inside) {
  for (const auto& part : inside.part) Kokkos::deep_copy(Exec(), part, 0);
  const MarkerSearch s = search;
  const VertexPlaces places = vertex_places;
  const InsideSurface of = surface;
  const InsideViews out = inside;
  Kokkos::parallel_for(
      "corpuscle::transfer::inside_crossings", Policy(0, surface.set.triangles), KOKKOS_LAMBDA(int t) {
        const int body = of.set.triangle_body(t);
        if (of.material(of.type(body)) != material) return;
        std::int64_t corner[3][3];
        for (int k = 0; k < 3; ++k)
          if (!place_in_units(s, places, of.set.triangle(t, k), corner[k])) return;
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
inline void add_up_inside(const IndexSpace& index, int d, bool alone, const Array<int>& part, const Array<int>& broken) {
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

/// The mean of the three lines' parts, [cell] from 0 to 1: what is inside of it up to a third of a cell where a surface is parallel to
/// two of them. Good enough for the direction of a surface.
inline void find_rough_share(const IndexSpace& index, const InsideViews& inside, const Array<double>& share) {
  const auto p0 = inside.part[0], p1 = inside.part[1], p2 = inside.part[2];
  const Array<double> out = share;
  for_owned(
      "corpuscle::transfer::inside_share", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const double mean = (static_cast<double>(p0(c)) + p1(c) + p2(c)) / (3.0 * inside_unit);
        out(c) = mean < 0 ? 0 : (mean > 1 ? 1 : mean);  // where surfaces overlap
      });
}

/// Volume of the part of the cube of side one, centred at the origin, where n . x < offset: Scardovelli & Zaleski, J. Comput. Phys. 164,
/// 228, 2000. @param n  of any length but zero
KOKKOS_INLINE_FUNCTION double cut_cube(const Vec3& n, double offset) {
  constexpr double least = 1e-3;  // of the sum: the formula divides by each
  double m[3] = {std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)};
  const double sum = m[0] + m[1] + m[2];
  double whole = 0;
  for (double& a : m) a = a > least * sum ? a : least * sum, whole += a;
  for (double& a : m) a /= whole;
  const double above = 0.5 + offset / sum;
  if (above <= 0 || above >= 1) return above <= 0 ? 0 : 1;
  const double a = above < 0.5 ? above : 1 - above;
  double cubes = a * a * a;
  for (int d = 0; d < 3; ++d) {
    const double one = a - m[d], two = a - m[d] - m[(d + 1) % 3];
    if (one > 0) cubes -= one * one * one;
    if (two > 0) cubes += two * two * two;
  }
  const double part = cubes / (6 * m[0] * m[1] * m[2]);
  return above < 0.5 ? part : 1 - part;
}

/// A cell and those around it, the ones beyond a side of the domain as inside as itself along the lines across that.
struct CellAround {
  InsideViews inside;
  Array<double> share;
  IndexSpace index;
  bool closed[3][2];  // no cells beyond that side of the block

  KOKKOS_INLINE_FUNCTION double part(int d, int c) const {
    const double p = inside.part[d](c) / static_cast<double>(inside_unit);
    return p < 0 ? 0 : (p > 1 ? 1 : p);
  }
  /// Of the cells below, at and above `c` along d, whose place along it is `at`.
  KOKKOS_INLINE_FUNCTION void column(int d, int c, int at, double (&p)[3]) const {
    p[1] = part(d, c);
    p[0] = at == 0 && closed[d][0] ? p[1] : part(d, c - index.stride(d));
    p[2] = at == index.n[d] - 1 && closed[d][1] ? p[1] : part(d, c + index.stride(d));
  }
  /// By how much the mean height of a surface over a cell's cross-section is above that at its middle, from the lines beside it.
  KOKKOS_INLINE_FUNCTION double bulge(int d, int c, const int (&at)[3], double height) const {
    double more = 0;
    for (int e = 0; e < 3; ++e) {
      if (e == d || (at[e] == 0 && closed[e][0]) || (at[e] == index.n[e] - 1 && closed[e][1])) continue;
      double beside[2], p[3];
      bool met = true;
      for (int side = 0; side < 2; ++side) {
        column(d, side == 0 ? c - index.stride(e) : c + index.stride(e), at[d], p);
        beside[side] = p[0] + p[1] + p[2] - 1.5;
        met = met && std::fabs(beside[side]) < 1.5;
      }
      if (met) more += (beside[0] + beside[1] - 2 * height) / 24;
    }
    return more;
  }
  /// Outward, in index space; from differences of the mean of four lines of three cells (1, 2, 1 across each way).
  KOKKOS_INLINE_FUNCTION Vec3 normal(int c) const {
    double n[3] = {0, 0, 0};
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const double value = share(c + x * index.stride(0) + y * index.stride(1) + z * index.stride(2));
          const int wx = 2 - x * x, wy = 2 - y * y, wz = 2 - z * z;
          n[0] -= x * wy * wz * value, n[1] -= y * wx * wz * value, n[2] -= z * wx * wy * value;
        }
    return {n[0], n[1], n[2]};
  }

  /// The part of a cell that is inside. Where one surface passes it is flat in index space: its height over the cell is what the
  /// lines of three cells along the direction that it faces most have inside.
  KOKKOS_INLINE_FUNCTION double part_inside(int i, int j, int k) const {
    const int c = index.cell(i, j, k), at[3] = {i, j, k};
    double column_of[3][3];
    bool even = true;
    for (int d = 0; d < 3; ++d) {
      column(d, c, at[d], column_of[d]);
      for (int q = 0; q < 3; ++q) even = even && column_of[d][q] == column_of[0][0];
    }
    if (even) return column_of[0][0];
    const Vec3 n = normal(c);
    const double along[3] = {n.x, n.y, n.z};
    int faces = 0;
    for (int d = 1; d < 3; ++d)
      if (std::fabs(along[d]) > std::fabs(along[faces])) faces = d;
    if (along[faces] == 0) return share(c);
    const auto& p = column_of[faces];
    const double behind = along[faces] > 0 ? p[0] : p[2], ahead = along[faces] > 0 ? p[2] : p[0];
    const bool once = behind >= p[1] && p[1] >= ahead && (behind == 1 || ahead == 0);
    const double height = p[0] + p[1] + p[2] - 1.5;
    if (once) return cut_cube(n, std::fabs(along[faces]) * (height + bulge(faces, c, at, height)));
    double sum = 0, weights = 0;  // of several surfaces: of lines that they lie across
    for (int d = 0; d < 3; ++d) {
      const double w = along[d] * along[d] * along[d] * along[d];
      sum += w * column_of[d][1], weights += w;
    }
    return sum / weights;
  }
};

/// Means over each cell of the viscosity over that outside, and of its inverse.
struct CytosolViews {
  Array<double> relative, fluidity;  // [cell]
};

/// Adds what a fluid of `ratio` does to them by the part of each cell that is inside. @param around  with valid halos of one layer
/// @param first  from 1  @param least  what no viscosity is below, where surfaces overlap too
inline void add_relative_viscosity(const CellAround& around, double ratio, bool first, double least, const CytosolViews& cytosol) {
  const CellAround cells = around;
  const CytosolViews out = cytosol;
  for_owned(
      "corpuscle::transfer::inside_viscosity", cells.index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = cells.index.cell(i, j, k);
        const double share = cells.part_inside(i, j, k);
        const double relative = (first ? 1.0 : out.relative(c)) + (ratio - 1) * share;
        const double fluidity = (first ? 1.0 : out.fluidity(c)) + (1 / ratio - 1) * share;
        out.relative(c) = relative > least ? relative : least;
        out.fluidity(c) = fluidity * out.relative(c) > 1 ? fluidity : 1 / out.relative(c);
      });
}

}  // namespace corpuscle
