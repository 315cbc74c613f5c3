// The grid's nodes (cell centres and boundary face centres) as a trilinear map from index space to space.
#pragma once

#include "common/small_linear.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// A point of index space: node `base` plus fractions, normally 0 to 1.
struct LatticePoint {
  int base[3];
  double f[3];

  KOKKOS_INLINE_FUNCTION double xi(int d) const { return base[d] + f[d]; }
};

/// The eight nodes around a point and their trilinear weights.
struct LatticeStencil {
  int node[8];
  double weight[8];
};

enum class Located : std::int8_t { inside = 0, outside = 1, failed = 2 };

/// Trilinear map over the nodes that exist on this rank: `lower` to `upper` inclusive, with three halo layers towards
/// neighbours and periodic images and one layer, the boundary itself, at physical boundaries.
struct Lattice {
  static constexpr double reach = 8;  // nodes beyond the lattice to which points are still extrapolated

  IndexSpace index;
  Components<double> x;
  int lower[3], upper[3];
  bool boundary_below[3], boundary_above[3];  // a physical boundary ends the lattice on this side

  KOKKOS_INLINE_FUNCTION int node(int i, int j, int k) const { return index.cell(i, j, k); }
  KOKKOS_INLINE_FUNCTION Vec3 position(int c) const { return load(x, c); }
  KOKKOS_INLINE_FUNCTION bool contains(const int (&i)[3]) const {
    for (int d = 0; d < 3; ++d) {
      if (i[d] < lower[d] || i[d] > upper[d]) return false;
    }
    return true;
  }

  /// Position and tangents dx/dxi at a lattice point.
  KOKKOS_INLINE_FUNCTION void map(const LatticePoint& q, Vec3& at, Vec3 (&tangent)[3]) const {
    const int c0 = node(q.base[0], q.base[1], q.base[2]);
    const int sj = index.stride(1), sk = index.stride(2);
    const Vec3 x00 = position(c0), x10 = position(c0 + sj), x01 = position(c0 + sk), x11 = position(c0 + sj + sk);
    const Vec3 d00 = position(c0 + 1) - x00, d10 = position(c0 + sj + 1) - x10;
    const Vec3 d01 = position(c0 + sk + 1) - x01, d11 = position(c0 + sj + sk + 1) - x11;
    const double a = q.f[0], b = q.f[1], c = q.f[2];
    const Vec3 y00 = x00 + a * d00, y10 = x10 + a * d10, y01 = x01 + a * d01, y11 = x11 + a * d11;
    const Vec3 z0 = y00 + b * (y10 - y00), z1 = y01 + b * (y11 - y01);
    at = z0 + c * (z1 - z0);
    tangent[0] = (1 - c) * (d00 + b * (d10 - d00)) + c * (d01 + b * (d11 - d01));
    tangent[1] = (1 - c) * (y10 - y00) + c * (y11 - y01);
    tangent[2] = z1 - z0;
  }

  KOKKOS_INLINE_FUNCTION void set(LatticePoint& q, const double (&xi)[3]) const {
    for (int d = 0; d < 3; ++d) {
      int b = static_cast<int>(std::floor(xi[d]));
      if (b < lower[d]) b = lower[d];
      if (b > upper[d] - 1) b = upper[d] - 1;
      q.base[d] = b;
      q.f[d] = xi[d] - b;
    }
  }

  /// Newton step towards `p` from `q` in index space; false where the map is singular.
  KOKKOS_INLINE_FUNCTION bool newton_step(const Vec3& p, const LatticePoint& q, double (&step)[3]) const {
    Vec3 at, tangent[3], row[3];
    map(q, at, tangent);
    if (inverse_rows(tangent, row) == 0) return false;
    for (int d = 0; d < 3; ++d) step[d] = dot(row[d], p - at);
    return true;
  }

  /// Index-space position of `p`, started from `q`. A point beyond the lattice is extrapolated up to `reach` nodes and
  /// reported as outside.
  KOKKOS_INLINE_FUNCTION Located locate(const Vec3& p, LatticePoint& q) const {
    constexpr int free_steps = 8, most_steps = 60;
    for (int iteration = 0; iteration < most_steps; ++iteration) {
      double step[3], xi[3];
      if (!newton_step(p, q, step)) return Located::failed;
      const double longest = iteration < free_steps ? 1e9 : (iteration < 2 * free_steps ? 2.0 : 0.5);
      double moved = 0, wanted = 0;
      for (int d = 0; d < 3; ++d) {
        const double limited = step[d] > longest ? longest : (step[d] < -longest ? -longest : step[d]);
        xi[d] = q.xi(d) + limited;
        const double lo = lower[d] - reach, hi = upper[d] + reach;
        if (!(xi[d] > lo)) xi[d] = lo;
        if (!(xi[d] < hi)) xi[d] = hi;
        const double dx = std::fabs(xi[d] - q.xi(d)), w = std::fabs(step[d]);
        moved = dx > moved ? dx : moved;
        wanted = w > wanted ? w : wanted;
      }
      if (wanted < 1e-9) {  // close enough that the next cell's map, if the point sits on a cell face, agrees
        for (int d = 0; d < 3; ++d) q.f[d] += step[d];
        return within(q) ? Located::inside : Located::outside;
      }
      if (moved < 1e-9) return Located::outside;
      set(q, xi);
    }
    return Located::failed;
  }

  /// Newton's method from the middle of the cell of `q` in its own map. @returns the last step, cells; negative where the map is singular
  KOKKOS_INLINE_FUNCTION double solve_in_cell(const Vec3& p, LatticePoint& q) const {
    double last = 0;
    for (int d = 0; d < 3; ++d) q.f[d] = 0.5;
    for (int iteration = 0; iteration < 12; ++iteration) {
      double step[3];
      if (!newton_step(p, q, step)) return -1;
      for (int d = 0; d < 3; ++d) q.f[d] += step[d];
      last = std::fabs(step[0]) + std::fabs(step[1]) + std::fabs(step[2]);
      if (last < 1e-13) break;
    }
    return last;
  }

  /// What locate() and polish() give where `p` is well within the cell of `q`, as it nearly always is in that where it was before.
  /// @returns false, and `q` as it was, where it is not
  KOKKOS_INLINE_FUNCTION bool find_in_cell(const Vec3& p, LatticePoint& q) const {
    constexpr double margin = 1e-6, converged = 1e-9;
    LatticePoint s = q;
    const double last = solve_in_cell(p, s);
    if (!(last >= 0 && last < converged)) return false;
    for (int d = 0; d < 3; ++d)
      if (!(s.f[d] > margin && s.f[d] < 1 - margin)) return false;
    q = s;
    return true;
  }

  /// Same bits on every rank that holds the lattice cell of `q`, whatever the start of the search was: a point on a face
  /// between two cells, which a search may end in either of, belongs to the upper one.
  KOKKOS_INLINE_FUNCTION void polish(const Vec3& p, LatticePoint& q) const {
    constexpr double on_face = 1e-9;
    for (int d = 0; d < 3; ++d) {
      int up = q.f[d] >= 1 - on_face ? 1 : (q.f[d] < -on_face ? -1 : 0);
      if (q.base[d] + up < lower[d] || q.base[d] + up > upper[d] - 1) up = 0;
      q.base[d] += up;
      q.f[d] -= up;
    }
    LatticePoint s = q;
    if (solve_in_cell(p, s) < 0) return;
    if (std::fabs(s.f[0] - q.f[0]) + std::fabs(s.f[1] - q.f[1]) + std::fabs(s.f[2] - q.f[2]) < 1e-6) q = s;
  }

  KOKKOS_INLINE_FUNCTION bool within(const LatticePoint& q) const {
    for (int d = 0; d < 3; ++d) {
      if (q.xi(d) < lower[d] - 1e-9 || q.xi(d) > upper[d] + 1e-9) return false;
    }
    return true;
  }

  /// The node nearest to `p` among about 12 samples a direction: a start for locate().
  KOKKOS_INLINE_FUNCTION void coarse_start(const Vec3& p, LatticePoint& q) const {
    int step[3];
    for (int d = 0; d < 3; ++d) step[d] = 1 + (upper[d] - lower[d]) / 12;
    double best = 1e300, xi[3] = {0, 0, 0};
    for (int k = lower[2]; k <= upper[2]; k += step[2]) {
      for (int j = lower[1]; j <= upper[1]; j += step[1]) {
        for (int i = lower[0]; i <= upper[0]; i += step[0]) {
          const Vec3 r = position(node(i, j, k)) - p;
          if (dot(r, r) < best) best = dot(r, r), xi[0] = i, xi[1] = j, xi[2] = k;
        }
      }
    }
    set(q, xi);
  }

  /// Tangents dx/dxi at a node, taken from the interior side where a boundary half cell lies on the other.
  KOKKOS_INLINE_FUNCTION void node_tangents(const int (&i)[3], Vec3 (&tangent)[3]) const {
    LatticePoint q;
    for (int d = 0; d < 3; ++d) {
      const bool from_below = i[d] >= upper[d] - 1;
      q.base[d] = from_below ? i[d] - 1 : i[d];
      q.f[d] = from_below ? 1 : 0;
    }
    Vec3 at;
    map(q, at, tangent);
  }

  /// Tangents at a point, with those that cross a boundary half cell doubled, so that they measure whole cells.
  KOKKOS_INLINE_FUNCTION void cell_tangents(const LatticePoint& q, Vec3 (&tangent)[3]) const {
    Vec3 at;
    map(q, at, tangent);
    for (int d = 0; d < 3; ++d) {
      if ((boundary_below[d] && q.base[d] == lower[d]) || (boundary_above[d] && q.base[d] == upper[d] - 1)) {
        tangent[d] *= 2;
      }
    }
  }

  KOKKOS_INLINE_FUNCTION LatticeStencil stencil(const LatticePoint& q) const {
    LatticeStencil s;
    const int c0 = node(q.base[0], q.base[1], q.base[2]);
    for (int corner = 0; corner < 8; ++corner) {
      const int a = corner & 1, b = (corner >> 1) & 1, c = corner >> 2;
      s.node[corner] = c0 + a + b * index.stride(1) + c * index.stride(2);
      s.weight[corner] = (a ? q.f[0] : 1 - q.f[0]) * (b ? q.f[1] : 1 - q.f[1]) * (c ? q.f[2] : 1 - q.f[2]);
    }
    return s;
  }
};

inline Lattice make_lattice(const GridViews& grid) {
  Lattice lattice{grid.index, grid.x, {}, {}, {}, {}};
  const IndexSpace& index = grid.index;
  for (int d = 0; d < 3; ++d) {
    lattice.boundary_below[d] = !index.periodic[d] && index.first[d] == 0;
    lattice.boundary_above[d] = !index.periodic[d] && index.first[d] + index.n[d] == index.global[d];
    lattice.lower[d] = lattice.boundary_below[d] ? -1 : -IndexSpace::halo;
    lattice.upper[d] = lattice.boundary_above[d] ? index.n[d] : index.n[d] + IndexSpace::halo - 1;
  }
  return lattice;
}

}  // namespace corpuscle
