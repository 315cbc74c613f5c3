// Velocity at immersed nodes from the surface and the fluid beyond, and pressure extended to them, both as rows of
// node numbers and weights. Only fluid (and, for the velocity, boundary) nodes of the node's own side are used, never
// another immersed node: the rows can be applied in any order, or eliminated.
#pragma once

#include "immersed/band.hpp"
#include "immersed/own_side.hpp"

namespace corpuscle {

constexpr int stencil_width = 16;

/// How a row came about, from the best to the last resort.
enum class RowKind : std::int8_t {
  quadratic = 0,      // two probes
  linear = 1,         // one probe
  least_squares = 2,  // linear fit through the nodes of the own side around
  normal_only = 3,    // slope along the normal alone (velocity), average (pressure)
  surface_only = 4    // nothing on the own side: the surface's velocity; for the pressure, no row
};
constexpr int row_kinds = 5;

/// Rows for the list of owned immersed nodes.
struct StencilViews {
  Array<int> node;               // [row] the immersed node
  Table<int> column;             // [row, 16] node numbers
  Table<double> weight;          // [row, 16]
  Array<int> columns;            // [row] how many are in use
  Array<double> surface_weight;  // [row] velocity rows: weight of the surface's velocity
  Array<RowKind> kind;           // [row]
};

/// Where the closest surface points of the rows' nodes are.
struct FootViews {
  Array<int> triangle;   // [row]
  Table<double> weight;  // [row, 3] barycentric
};

/// One row under construction.
struct Row {
  int column[stencil_width];
  double weight[stencil_width];
  int count = 0;
  double surface = 0;

  KOKKOS_INLINE_FUNCTION void add(int c, double w) {
    for (int k = 0; k < count; ++k) {
      if (column[k] == c) {
        weight[k] += w;
        return;
      }
    }
    column[count] = c;
    weight[count++] = w;
  }
  KOKKOS_INLINE_FUNCTION void add(const LatticeStencil& s, double factor) {
    for (int k = 0; k < 8; ++k) {
      if (s.weight[k] != 0) add(s.node[k], factor * s.weight[k]);
    }
  }
};

/// The nearest nodes found so far, nearest first.
struct NearestNodes {
  int node[stencil_width];
  double square[stencil_width];
  int count = 0;

  KOKKOS_INLINE_FUNCTION void offer(int c, double r2) {
    if (count == stencil_width && !(r2 < square[count - 1])) return;
    int at = count < stencil_width ? count++ : count - 1;
    for (; at > 0 && r2 < square[at - 1]; --at) node[at] = node[at - 1], square[at] = square[at - 1];
    node[at] = c;
    square[at] = r2;
  }
};

/// An immersed node with what its stencils need.
struct ImmersedNode {
  SidePoint side;
  int i[3];
  double delta;    // distance to the surface, um
  double spacing;  // local spacing along the normal, um: one node further in the direction that changes fastest
  Vec3 rate;       // index-space direction of the normal, per um
  Vec3 row[3];     // gradients of the index coordinates
};

/// Which nodes a stencil may use.
struct Allowed {
  Lattice lattice;
  SurfaceSet surface;
  BandViews band;
  NodeViews nodes;
  bool boundary;  // boundary nodes too

  KOKKOS_INLINE_FUNCTION bool operator()(const ImmersedNode& p, int c) const {
    const NodeKind kind = nodes.kind(c);
    if (kind != NodeKind::fluid && !(boundary && kind == NodeKind::boundary)) return false;
    return own_side(lattice, surface, band, p.side, c);
  }
};

KOKKOS_INLINE_FUNCTION ImmersedNode describe(const Lattice& lattice, const SurfaceSet& s, const Images& images,
                                             const PseudoNormals& normals, const BandViews& band, int c) {
  ImmersedNode p;
  lattice.index.unpack(c, p.i[0], p.i[1], p.i[2]);
  const unsigned item = key_item(band.key(c));
  const int t = static_cast<int>(item % static_cast<unsigned>(s.triangles));
  Vec3 tangent[3];
  lattice.node_tangents(p.i, tangent);
  inverse_rows(tangent, p.row);
  p.side.at = lattice.position(c);
  p.side.foot = load(band.foot, c);
  p.side.body = s.triangle_body(t);
  p.delta = std::fabs(band.distance(c));
  p.side.normal = p.side.at - p.side.foot;
  const double scale = norm(tangent[0]) + norm(tangent[1]) + norm(tangent[2]);
  if (p.delta > 1e-9 * scale) {
    p.side.normal *= 1 / p.delta;
  } else {  // the node sits on the surface
    const Corners k = corners(s, t, images.shift[item / static_cast<unsigned>(s.triangles)]);
    const Vec3 n = pseudo_normal(s, normals, t, closest_on_triangle(p.side.at, k.a, k.b, k.c).feature);
    p.side.normal = n * (1 / norm(n));
  }
  double fastest = 0;
  for (int d = 0; d < 3; ++d) {
    p.rate[d] = dot(p.row[d], p.side.normal);
    fastest = std::fabs(p.rate[d]) > fastest ? std::fabs(p.rate[d]) : fastest;
  }
  p.spacing = 1 / fastest;
  return p;
}

/// Stencil of the point at distance `s` beyond the node along its normal. @returns false where the lattice ends, the
/// point is more than three nodes away, or a node that carries weight is not allowed.
KOKKOS_INLINE_FUNCTION bool probe(const Allowed& allowed, const ImmersedNode& p, double s, LatticeStencil& stencil) {
  const double start[3] = {p.i[0] + s * p.rate.x, p.i[1] + s * p.rate.y, p.i[2] + s * p.rate.z};
  LatticePoint q;
  allowed.lattice.set(q, start);
  if (allowed.lattice.locate(p.side.at + s * p.side.normal, q) != Located::inside) return false;
  for (int d = 0; d < 3; ++d) {
    if (q.base[d] < p.i[d] - 3 || q.base[d] > p.i[d] + 2) return false;
  }
  stencil = allowed.lattice.stencil(q);
  for (int k = 0; k < 8; ++k) {
    if (std::fabs(stencil.weight[k]) < 1e-13) stencil.weight[k] = 0;
    if (stencil.weight[k] != 0 && !allowed(p, stencil.node[k])) return false;
  }
  return true;
}

/// First probe that fits, moving outward from `s` in quarters of a spacing up to `farthest` spacings.
KOKKOS_INLINE_FUNCTION bool seek_probe(const Allowed& allowed, const ImmersedNode& p, double farthest, double& s, LatticeStencil& stencil) {
  for (; s <= (farthest + 1e-9) * p.spacing; s += 0.25 * p.spacing) {
    if (probe(allowed, p, s, stencil)) return true;
  }
  return false;
}

KOKKOS_INLINE_FUNCTION NearestNodes nearest_allowed(const Allowed& allowed, const ImmersedNode& p) {
  NearestNodes nearest;
  for (int k = -2; k <= 2; ++k) {
    for (int j = -2; j <= 2; ++j) {
      for (int i = -2; i <= 2; ++i) {
        const int at[3] = {p.i[0] + i, p.i[1] + j, p.i[2] + k};
        if (!allowed.lattice.contains(at)) continue;
        const int c = allowed.lattice.node(at[0], at[1], at[2]);
        if (!allowed(p, c)) continue;
        nearest.offer(c, i * i + j * j + k * k);
      }
    }
  }
  return nearest;
}

/// Index coordinates of node c relative to `origin`, with the metric of the immersed node.
KOKKOS_INLINE_FUNCTION Vec3 scaled(const Lattice& lattice, const ImmersedNode& p, const Vec3& origin, int c) {
  const Vec3 r = lattice.position(c) - origin;
  return {dot(p.row[0], r), dot(p.row[1], r), dot(p.row[2], r)};
}

/// Fallbacks for the velocity: gradient fit anchored at the surface, slope along the normal, surface value.
KOKKOS_INLINE_FUNCTION RowKind fitted_velocity_row(const Allowed& allowed, const ImmersedNode& p, Row& row) {
  const NearestNodes nearest = nearest_allowed(allowed, p);
  const Vec3 here = p.side.at - p.side.foot;
  row.surface = 1;
  NormalMatrix<3> normal;
  for (int k = 0; k < nearest.count; ++k) {
    const Vec3 y = scaled(allowed.lattice, p, p.side.foot, nearest.node[k]);
    const double phi[3] = {y.x, y.y, y.z};
    normal.add(phi, 1 / nearest.square[k]);
  }
  if (nearest.count >= 4 && normal.factorise(0.02)) {
    double z[3] = {dot(p.row[0], here), dot(p.row[1], here), dot(p.row[2], here)};
    normal.solve(z);
    double size = 0;
    for (int k = 0; k < nearest.count; ++k) {
      const Vec3 y = scaled(allowed.lattice, p, p.side.foot, nearest.node[k]);
      const double w = (z[0] * y.x + z[1] * y.y + z[2] * y.z) / nearest.square[k];
      row.add(nearest.node[k], w);
      row.surface -= w;
      size += std::fabs(w);
    }
    if (size <= 3) return RowKind::least_squares;
    row = Row();
    row.surface = 1;
  }
  double sum = 0;
  for (int k = 0; k < nearest.count; ++k) {
    const double eta = dot(allowed.lattice.position(nearest.node[k]) - p.side.foot, p.side.normal);
    sum += eta * eta / nearest.square[k];
  }
  if (nearest.count == 0) return RowKind::surface_only;
  for (int k = 0; k < nearest.count; ++k) {
    const double eta = dot(allowed.lattice.position(nearest.node[k]) - p.side.foot, p.side.normal);
    const double w = eta * p.delta / (nearest.square[k] * sum);
    row.add(nearest.node[k], w);
    row.surface -= w;
  }
  return RowKind::normal_only;
}

KOKKOS_INLINE_FUNCTION RowKind velocity_row(const Allowed& allowed, const ImmersedNode& p, Row& row) {
  LatticeStencil first, second;
  double s1 = p.spacing;
  if (!seek_probe(allowed, p, 2.5, s1, first)) return fitted_velocity_row(allowed, p, row);
  const double delta = p.delta, d1 = delta + s1;
  double s2 = s1 + p.spacing;
  if (seek_probe(allowed, p, 2.95, s2, second)) {
    const double d2 = delta + s2;
    row.surface = (delta - d1) * (delta - d2) / (d1 * d2);
    row.add(first, delta * (delta - d2) / (d1 * (d1 - d2)));
    row.add(second, delta * (delta - d1) / (d2 * (d2 - d1)));
    return RowKind::quadratic;
  }
  row.surface = s1 / d1;
  row.add(first, delta / d1);
  return RowKind::linear;
}

KOKKOS_INLINE_FUNCTION RowKind pressure_row(const Allowed& allowed, const ImmersedNode& p, Row& row) {
  const NearestNodes nearest = nearest_allowed(allowed, p);
  if (nearest.count == 0) return RowKind::surface_only;
  NormalMatrix<4> normal;
  for (int k = 0; k < nearest.count; ++k) {
    const Vec3 y = scaled(allowed.lattice, p, p.side.at, nearest.node[k]);
    const double phi[4] = {1, y.x, y.y, y.z};
    normal.add(phi, 1 / nearest.square[k]);
  }
  if (nearest.count >= 6 && normal.factorise(0.02)) {
    double z[4] = {1, 0, 0, 0}, size = 0;
    normal.solve(z);
    for (int k = 0; k < nearest.count; ++k) {
      const Vec3 y = scaled(allowed.lattice, p, p.side.at, nearest.node[k]);
      const double w = (z[0] + z[1] * y.x + z[2] * y.y + z[3] * y.z) / nearest.square[k];
      row.add(nearest.node[k], w);
      size += std::fabs(w);
    }
    if (size <= 5) return RowKind::least_squares;
    row = Row();
  }
  double sum = 0;
  for (int k = 0; k < nearest.count; ++k) sum += 1 / nearest.square[k];
  for (int k = 0; k < nearest.count; ++k) row.add(nearest.node[k], 1 / (nearest.square[k] * sum));
  return RowKind::normal_only;
}

/// Geometry that the stencils are built on.
struct StencilInput {
  Lattice lattice;
  SurfaceSet surface;
  Images images;
  PseudoNormals normals;
  BandViews band;
  NodeViews nodes;
  /// [cell] whether an immersed node gets a pressure from fluid nodes, and a boundary node has a given one; halos filled.
  Array<std::int8_t> extended;
};

KOKKOS_INLINE_FUNCTION void write_row(const StencilViews& rows, int n, const Row& row, RowKind kind, const Array<int>& counts, int offset) {
  rows.columns(n) = row.count;
  rows.surface_weight(n) = row.surface;
  rows.kind(n) = kind;
  for (int k = 0; k < stencil_width; ++k) {
    rows.column(n, k) = k < row.count ? row.column[k] : rows.node(n);
    rows.weight(n, k) = k < row.count ? row.weight[k] : 0;
  }
  Kokkos::atomic_fetch_add(&counts(offset + static_cast<int>(kind)), 1);
}

/// extended = 1 where `given` says that a boundary node's pressure is known.
inline void mark_known_pressure(const Array<unsigned char>& given, const Array<std::int8_t>& extended) {
  const auto from = given;
  const auto to = extended;
  Kokkos::parallel_for(
      "corpuscle::immersed::known_pressure", Policy(0, static_cast<int>(to.extent(0))), KOKKOS_LAMBDA(int c) { to(c) = from(c) ? 1 : 0; });
}

/// Velocity rows and surface points of `count` immersed nodes; counts[0 .. row_kinds) gets the rows of each kind.
/// Exact for velocities linear in space (quadratic along the normal: for those along straight normals too).
inline void build_velocity_rows(const StencilInput& input, int count, const StencilViews& rows, const FootViews& feet,
                                const Array<int>& counts) {
  const StencilInput in = input;
  const StencilViews out = rows;
  const FootViews foot_out = feet;
  Kokkos::parallel_for(
      "corpuscle::immersed::velocity_rows", Policy(0, count), KOKKOS_LAMBDA(int n) {
        const int c = out.node(n);
        const ImmersedNode p = describe(in.lattice, in.surface, in.images, in.normals, in.band, c);
        const Allowed allowed{in.lattice, in.surface, in.band, in.nodes, true};
        Row row;
        const RowKind kind = velocity_row(allowed, p, row);
        write_row(out, n, row, kind, counts, 0);
        const unsigned item = key_item(in.band.key(c)), triangles = static_cast<unsigned>(in.surface.triangles);
        const int t = static_cast<int>(item % triangles);
        const Corners k = corners(in.surface, t, in.images.shift[item / triangles]);
        const TrianglePoint foot = closest_on_triangle(p.side.at, k.a, k.b, k.c);
        foot_out.triangle(n) = t;
        for (int corner = 0; corner < 3; ++corner) foot_out.weight(n, corner) = foot.weight[corner];
      });
}

/// Pressure rows of `count` immersed nodes (fluid nodes only, no surface value); counts[row_kinds .. 2 row_kinds).
/// Exact for linear pressures. A row of kind surface_only is empty. Sets input.extended at these nodes.
inline void build_pressure_rows(const StencilInput& input, int count, const StencilViews& rows, const Array<int>& counts) {
  const StencilInput in = input;
  const StencilViews out = rows;
  Kokkos::parallel_for(
      "corpuscle::immersed::pressure_rows", Policy(0, count), KOKKOS_LAMBDA(int n) {
        const ImmersedNode p = describe(in.lattice, in.surface, in.images, in.normals, in.band, out.node(n));
        const Allowed allowed{in.lattice, in.surface, in.band, in.nodes, false};
        Row row;
        const RowKind kind = pressure_row(allowed, p, row);
        write_row(out, n, row, kind, counts, row_kinds);
        in.extended(out.node(n)) = row.count > 0 ? 1 : 0;
      });
}

/// Velocity of the surface at the rows' feet: [row, 3], um/us.
inline void interpolate_surface_velocity(const SurfaceSet& surface, const FootViews& feet, int count, const Components<double>& u_surface) {
  const SurfaceSet s = surface;
  const FootViews in = feet;
  const auto out = u_surface;
  Kokkos::parallel_for(
      "corpuscle::immersed::surface_velocity", Policy(0, count), KOKKOS_LAMBDA(int n) {
        Vec3 sum;
        for (int k = 0; k < 3; ++k) sum += in.weight(n, k) * load(s.v, s.triangle(in.triangle(n), k));
        store(out, n, sum);
      });
}

/// Set u at the listed immersed nodes from their rows.
inline void apply_velocity_rows(const StencilViews& rows, int count, const Components<double>& u_surface, const Components<double>& u) {
  const StencilViews in = rows;
  const auto surface = u_surface, field = u;
  Kokkos::parallel_for(
      "corpuscle::immersed::apply_velocity_rows", Policy(0, count), KOKKOS_LAMBDA(int n) {
        Vec3 sum = in.surface_weight(n) * load(surface, n);
        for (int k = 0; k < in.columns(n); ++k) sum += in.weight(n, k) * load(field, in.column(n, k));
        store(field, in.node(n), sum);
      });
}

/// Set p at the listed immersed nodes from their rows; nodes without a row keep their value.
inline void apply_pressure_rows(const StencilViews& rows, int count, const Array<double>& p) {
  const StencilViews in = rows;
  const auto field = p;
  Kokkos::parallel_for(
      "corpuscle::immersed::apply_pressure_rows", Policy(0, count), KOKKOS_LAMBDA(int n) {
        if (in.columns(n) == 0) return;
        double sum = 0;
        for (int k = 0; k < in.columns(n); ++k) sum += in.weight(n, k) * field(in.column(n, k));
        field(in.node(n)) = sum;
      });
}

}  // namespace corpuscle
