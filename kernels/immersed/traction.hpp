// Fluid stress on the surfaces, from one-sided weighted least-squares fits around each vertex.
#pragma once

#include "common/extremes.hpp"
#include "immersed/own_side.hpp"
#include "immersed/reconstruct.hpp"
#include "immersed/surface_stress.hpp"

namespace corpuscle {

/// Of the fits: points up to this far in index-scaled distance, so that three halo layers hold every one, and weights
/// 1 / (r^2 + softening).
constexpr double fit_radius = 2.5, fit_softening = 0.1;

/// How a vertex got its traction; counted for velocity and pressure.
enum TractionFallback {
  traction_fitted,    // to second order
  traction_gradient,  // gradient only, from all points of the box
  traction_normal,    // slope along the normal only
  traction_nothing,   // no fluid on this side: no viscous part
  pressure_fitted,
  pressure_wide,     // linear fit from all points of the box, extended pressures included
  pressure_average,  // mean of the points
  pressure_nothing,  // no fluid on this side: no_pressure
  traction_counts
};

/// What the fits of one vertex need.
struct TractionVertex {
  int vertex, image;
  SidePoint side;
  double xi[3];
  Vec3 row[3];     // gradients of the index coordinates
  double spacing;  // along the normal, um
};

KOKKOS_INLINE_FUNCTION TractionVertex describe_vertex(const Lattice& lattice, const SurfaceSet& s, const Images& images,
                                                      const PlaceViews& places, int v) {
  TractionVertex t;
  const int m = places.image(v), item = m * s.vertices + v;
  t.vertex = v, t.image = m;
  LatticePoint q;
  for (int d = 0; d < 3; ++d) t.xi[d] = places.xi(item, d);
  lattice.set(q, t.xi);
  Vec3 tangent[3];
  lattice.cell_tangents(q, tangent);
  inverse_rows(tangent, t.row);
  t.side.at = t.side.foot = load(s.x, v) + images.shift[m];
  t.side.normal = load(s.normal, v);
  t.side.body = s.vertex_body(v);
  double fastest = 0;
  for (int d = 0; d < 3; ++d) {
    const double rate = std::fabs(dot(t.row[d], t.side.normal));
    fastest = rate > fastest ? rate : fastest;
  }
  t.spacing = 1 / fastest;
  return t;
}

/// Calls use(c, y, r, w) for every node that may inform vertex `t`: c its number, y its index-scaled and r its plain
/// offset from the vertex, w the weight. `farthest` bounds |y|.
template <class Use>
KOKKOS_INLINE_FUNCTION void for_nodes_around(const StencilInput& in, const TractionVertex& t, double farthest, const Use& use) {
  int lower[3], upper[3];
  for (int d = 0; d < 3; ++d) {
    lower[d] = static_cast<int>(std::ceil(t.xi[d] - 2.5));
    upper[d] = static_cast<int>(std::floor(t.xi[d] + 2.5));
    lower[d] = lower[d] > in.lattice.lower[d] ? lower[d] : in.lattice.lower[d];
    upper[d] = upper[d] < in.lattice.upper[d] ? upper[d] : in.lattice.upper[d];
  }
  for (int k = lower[2]; k <= upper[2]; ++k) {
    for (int j = lower[1]; j <= upper[1]; ++j) {
      for (int i = lower[0]; i <= upper[0]; ++i) {
        const int c = in.lattice.node(i, j, k);
        const NodeKind kind = in.nodes.kind(c);
        if (kind == NodeKind::inside || kind == NodeKind::none) continue;
        const Vec3 r = in.lattice.position(c) - t.side.at;
        const Vec3 y{dot(t.row[0], r), dot(t.row[1], r), dot(t.row[2], r)};
        const double r2 = dot(y, y);
        if (r2 > farthest * farthest || !own_side(in.lattice, in.surface, in.band, t.side, c)) continue;
        use(c, y, r, 1 / (r2 + fit_softening));
      }
    }
  }
}

/// Basis of the velocity fit, anchored at the vertex: index-scaled offset, and with N = 9 the second-order terms.
template <int N>
KOKKOS_INLINE_FUNCTION void fit_basis(const Vec3& y, double (&phi)[N]) {
  phi[0] = y.x, phi[1] = y.y, phi[2] = y.z;
  if constexpr (N == 9) {
    phi[3] = y.x * y.x, phi[4] = y.y * y.y, phi[5] = y.z * y.z;
    phi[6] = y.x * y.y, phi[7] = y.y * y.z, phi[8] = y.z * y.x;
  }
}

/// Gradient of each velocity component in index-scaled coordinates; false if the points do not carry the fit. They carry it
/// if its slope along the normal answers a motion of the surface at least as a line to the farthest point would: where all
/// points lie in a few planes, one that answers less, or with the wrong sign, would drive the surface instead of resisting it.
template <int N>
KOKKOS_INLINE_FUNCTION bool fit_gradient(const StencilInput& in, const Components<double>& u, const TractionVertex& t, const Vec3& v,
                                         double farthest, Vec3 (&gradient)[3]) {
  NormalMatrix<N> normal;
  double right[3][N] = {}, answer[N] = {};
  int points = 0;
  for_nodes_around(in, t, farthest, [&](int c, const Vec3& y, const Vec3&, double w) {
    const Vec3 du = load(u, c) - v;
    double phi[N];
    fit_basis(y, phi);
    normal.add(phi, w);
    for (int k = 0; k < N; ++k) {
      for (int d = 0; d < 3; ++d) right[d][k] += w * phi[k] * du[d];
      answer[k] += w * phi[k];
    }
    ++points;
  });
  if (points < N + 2 || !normal.factorise(N == 9 ? 1e-3 : 5e-3)) return false;
  normal.solve(answer);
  double slope = 0;
  for (int d = 0; d < 3; ++d) slope += answer[d] * dot(t.row[d], t.side.normal);
  if (!(slope * t.spacing * fit_radius > 1)) return false;
  for (int d = 0; d < 3; ++d) {
    normal.solve(right[d]);
    gradient[d] = {right[d][0], right[d][1], right[d][2]};
  }
  return true;
}

/// Slope along the normal only. @returns false without a point.
KOKKOS_INLINE_FUNCTION bool fit_slope(const StencilInput& in, const Components<double>& u, const TractionVertex& t, const Vec3& v,
                                      Vec3 (&gradient)[3]) {
  double square = 0;
  Vec3 sum;
  for_nodes_around(in, t, 1e3, [&](int c, const Vec3&, const Vec3& r, double w) {
    if (in.nodes.kind(c) == NodeKind::immersed) return;
    const double eta = dot(r, t.side.normal);
    square += w * eta * eta;
    sum += (w * eta) * (load(u, c) - v);
  });
  if (!(square > 0)) return false;
  for (int d = 0; d < 3; ++d) gradient[d] = (sum[d] / square) * t.side.normal;
  return true;
}

/// Gradient of the velocity in space, gradient[i][j] = du_i/dx_j, and how it was found.
KOKKOS_INLINE_FUNCTION int velocity_gradient(const StencilInput& in, const Components<double>& u, const TractionVertex& t, const Vec3& v,
                                             Vec3 (&gradient)[3]) {
  Vec3 scaled[3];
  int how = traction_fitted;
  if (!fit_gradient<9>(in, u, t, v, fit_radius, scaled)) {
    how = traction_gradient;
    if (!fit_gradient<3>(in, u, t, v, 1e3, scaled)) {
      return fit_slope(in, u, t, v, gradient) ? traction_normal : traction_nothing;
    }
  }
  for (int d = 0; d < 3; ++d) gradient[d] = scaled[d].x * t.row[0] + scaled[d].y * t.row[1] + scaled[d].z * t.row[2];
  return how;
}

/// A fit of the pressure. Differences from the first point are fitted: the level of the pressure is not rounded.
struct PressureFit {
  double value = 0, mean = 0;  // kPa: the fit's at the vertex; weighted average of the points
  int points = 0, fluid = 0;   // how many; those in the fluid
};

/// Linear fit of the pressure at the vertex from points up to `farthest`. @returns whether the points carry it
KOKKOS_INLINE_FUNCTION bool fit_pressure(const StencilInput& in, const Array<double>& p, const TractionVertex& t, double farthest,
                                         PressureFit& fit) {
  NormalMatrix<4> normal;
  double right[4] = {0, 0, 0, 0}, level = 0;
  fit.points = fit.fluid = 0;
  for_nodes_around(in, t, farthest, [&](int c, const Vec3& y, const Vec3&, double w) {
    const NodeKind kind = in.nodes.kind(c);
    // In a pocket no fluid is near: what an immersed node there has for a pressure is nobody's. An outflow's is given.
    if (kind != NodeKind::fluid && !in.extended(c)) return;
    if (kind == NodeKind::fluid) ++fit.fluid;
    if (fit.points == 0) level = p(c);
    const double phi[4] = {1, y.x, y.y, y.z};
    normal.add(phi, w);
    for (int k = 0; k < 4; ++k) right[k] += w * phi[k] * (p(c) - level);
    ++fit.points;
  });
  if (fit.points > 0) fit.mean = level + right[0] / normal.a[0];
  if (fit.points < 6 || !normal.factorise(5e-3)) return false;
  normal.solve(right);
  fit.value = level + right[0];
  return true;
}

/// Whether a node near the vertex belongs to another body, or another image of its own.
KOKKOS_INLINE_FUNCTION bool another_near(const StencilInput& in, const TractionVertex& t) {
  const unsigned triangles = static_cast<unsigned>(in.surface.triangles);
  bool found = false;
  for_nodes_around(in, t, fit_radius, [&](int c, const Vec3&, const Vec3&, double) {
    const Key key = in.band.key(c);
    if (key == no_key) return;
    const int image = static_cast<int>(key_item(key) / triangles);
    found = found || key_body(in.surface.triangle_body, key) != t.side.body || image != t.image;
  });
  return found;
}

KOKKOS_INLINE_FUNCTION int surface_pressure(const StencilInput& in, const Array<double>& p, const TractionVertex& t, double& value) {
  PressureFit fit;
  int how = pressure_fitted;
  const bool fitted = fit_pressure(in, p, t, fit_radius, fit);
  if (fit.fluid == 0 && another_near(in, t)) {  // in a film without fluid nodes: pressures at its rim are not its own
    value = unseen_pressure;
    return pressure_nothing;
  }
  if (!fitted) {
    // Where the surface runs along a grid plane, a single layer of fluid nodes may be in reach: the layer between it and
    // the surface, to which the pressure was extended, carries the slope.
    how = pressure_wide;
    if (!fit_pressure(in, p, t, 1e3, fit)) {
      value = fit.points > 0 ? fit.mean : no_pressure;
      return fit.points > 0 ? pressure_average : pressure_nothing;
    }
  }
  value = fit.value;
  return how;
}

/// Fields and parameters of a traction.
struct TractionInput {
  Components<double> u;    // [cell, 3] um/us, reconstructed at immersed nodes, halos filled
  Array<double> p;         // [cell] kPa, periodic part, extended to immersed nodes, halos filled
  double viscosity = 0;    // mPa s
  Vec3 pressure_gradient;  // kPa/um, imposed along periodic directions
  Vec3 origin;             // where the imposed gradient's pressure is zero, um
};

/// Stress of the fluid at the owned vertices, zero at those of other ranks; counts as TractionFallback.
inline void tractions(const StencilInput& input, const PlaceViews& places, const TractionInput& fields, const SurfaceStress& out,
                      const Array<int>& counts) {
  Kokkos::deep_copy(Exec(), counts, 0);
  const StencilInput in = input;
  const PlaceViews where = places;
  const TractionInput f = fields;
  const SurfaceStress to = out;
  Kokkos::parallel_for(
      "corpuscle::immersed::vertex_tractions", Policy(0, in.surface.vertices), KOKKOS_LAMBDA(int v) {
        Vec3 drag;
        double p = 0;
        if (where.image(v) >= 0) {
          const TractionVertex t = describe_vertex(in.lattice, in.surface, in.images, where, v);
          const Vec3 n = t.side.normal;
          Vec3 gradient[3];
          const int how = velocity_gradient(in, f.u, t, load(in.surface.v, v), gradient);
          Kokkos::atomic_fetch_add(&counts(how), 1);
          if (how != traction_nothing) {
            const Vec3 transposed = n.x * gradient[0] + n.y * gradient[1] + n.z * gradient[2];
            drag = f.viscosity * (Vec3{dot(gradient[0], n), dot(gradient[1], n), dot(gradient[2], n)} + transposed);
          }
          Kokkos::atomic_fetch_add(&counts(surface_pressure(in, f.p, t, p)), 1);
          if (has_pressure(p)) p += dot(f.pressure_gradient, load(in.surface.x, v) - f.origin);
        }
        to.set(v, p, drag);
      });
}

struct Slip {
  double largest = 0, square = 0;  // um/us; sum of squares
};

/// Difference between the surface's velocity and the fluid's, extrapolated to the owned vertices by a linear fit that
/// is not anchored there. Vertices without enough points are left out.
inline Slip surface_slip(const StencilInput& input, const PlaceViews& places, const Components<double>& u) {
  const StencilInput in = input;
  const PlaceViews where = places;
  const auto field = u;
  Slip slip;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::surface_slip", Policy(0, in.surface.vertices),
      KOKKOS_LAMBDA(int v, double& square, double& largest) {
        if (where.image(v) < 0) return;
        const TractionVertex t = describe_vertex(in.lattice, in.surface, in.images, where, v);
        NormalMatrix<5> normal;
        double right[3][5] = {};
        int points = 0;
        for_nodes_around(in, t, fit_radius, [&](int c, const Vec3& y, const Vec3& r, double w) {
          if (in.nodes.kind(c) == NodeKind::immersed) return;
          const double eta = dot(r, t.side.normal) / t.spacing, phi[5] = {1, y.x, y.y, y.z, eta * eta};
          normal.add(phi, w);
          const Vec3 du = load(field, c) - load(in.surface.v, v);
          for (int k = 0; k < 5; ++k) {
            for (int d = 0; d < 3; ++d) right[d][k] += w * phi[k] * du[d];
          }
          ++points;
        });
        if (points < 8 || !normal.factorise(5e-3)) return;
        Vec3 here;
        for (int d = 0; d < 3; ++d) {
          normal.solve(right[d]);
          here[d] = right[d][0];
        }
        square += dot(here, here);
        largest = larger(largest, norm(here));
      },
      slip.square, Largest(slip.largest));
  return slip;
}

}  // namespace corpuscle
