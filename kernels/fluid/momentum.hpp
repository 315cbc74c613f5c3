// The implicit part of the momentum equation, row-scaled by its diagonal: unknowns and residuals are velocities.
#pragma once

#include "common/vec3.hpp"
#include "fluid/masked_gradient.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// Coefficients of the viscous face fluxes. `normal[d]` multiplies the difference across the face; `cross[d][e]`
/// multiply the tangential differences and are allocated on skewed grids only.
struct ViscousCoefficients {
  Array<double> normal[3];
  Array<double> cross[3][3];
};

template <bool skewed>
void viscous_coefficients(const GridViews& grid, const ViscousCoefficients& g) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    const auto normal = g.normal[d];
    const auto cross0 = g.cross[d][(d + 1) % 3], cross1 = g.cross[d][(d + 2) % 3];
    // One halo layer more than owned cells need: the diagonal is also wanted in the first halo layer.
    std::array<int, 3> lower, upper;
    for (int e = 0; e < 3; ++e) lower[e] = -1, upper[e] = index.n[e] + 1;
    upper[d] += 1;
    const auto kind = grid.base_kind;
    for_box("corpuscle::fluid::viscous_coefficients", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) {
      const int c = index.cell(i, j, k), low = c - index.stride(d);
      if (kind(c) != NodeKind::fluid && kind(low) != NodeKind::fluid) {
        normal(c) = 0;
        return;
      }
      const Vec3 f = face_coefficients(x, load(area, c), index, d, c);
      normal(c) = f[d];
      if (skewed) {  // not constexpr: a device lambda must not capture anything first inside one
        cross0(c) = f[(d + 1) % 3];
        cross1(c) = f[(d + 2) % 3];
      }
    });
  }
}

/// diagonal = mass V + mu (sum of the normal coefficients), on owned cells and one halo layer.
/// @param mass  density times the leading coefficient of the time derivative, pg/um3/us
inline void momentum_diagonal(const GridViews& grid, const ViscousCoefficients& g, double mass, double mu,
                              const Array<double>& diagonal) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  const auto g0 = g.normal[0], g1 = g.normal[1], g2 = g.normal[2];
  const int s0 = index.stride(0), s1 = index.stride(1), s2 = index.stride(2);
  for_box("corpuscle::fluid::momentum_diagonal", {-1, -1, -1}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1},
          KOKKOS_LAMBDA(int i, int j, int k) {
            const int c = index.cell(i, j, k);
            const double sum = g0(c) + g0(c + s0) + g1(c) + g1(c + s1) + g2(c) + g2(c + s2);
            const double value = mass * volume(c) + mu * sum;
            diagonal(c) = value > 0 ? value : 1;
          });
}

/// Viscous flux of one velocity component through the face between c - stride(d) and c, over mu.
template <bool skewed, class Velocity>
KOKKOS_INLINE_FUNCTION double viscous_face(const ViscousCoefficients& g, const Velocity& u, const IndexSpace& index,
                                           int d, int c, int m) {
  const int low = c - index.stride(d);
  double flux = g.normal[d](c) * (u(c, m) - u(low, m));
  if constexpr (skewed) {
    for (int n = 1; n < 3; ++n) {
      const int e = (d + n) % 3, s = index.stride(e);
      flux += g.cross[d][e](c) * 0.25 * (u(c + s, m) - u(c - s, m) + u(low + s, m) - u(low - s, m));
    }
  }
  return flux;
}

/// Viscous forces on one cell of a skewed grid, over mu, as weights on the 19 nodes around it: its six face fluxes
/// collected node by node, which reads each velocity once where the faces would read it up to ten times.
struct ViscousStencil {
  double centre = 0;
  double axis[3][2];  // [direction][low, high]
  double edge[3][4];  // [p][a + 2 b]: along direction p (low, high: a = 0, 1) and along p + 1 (b)

  KOKKOS_INLINE_FUNCTION ViscousStencil(const ViscousCoefficients& g, const IndexSpace& index, int c) {
    for (int d = 0; d < 3; ++d) {
      const int next = c + index.stride(d), e = (d + 1) % 3, f = (d + 2) % 3;
      const int next_e = c + index.stride(e), next_f = c + index.stride(f);
      // Faces of the other two directions carry tangential differences along d.
      const double tangential = 0.25 * (g.cross[e][d](next_e) - g.cross[e][d](c) + g.cross[f][d](next_f) -
                                        g.cross[f][d](c));
      axis[d][0] = g.normal[d](c) - tangential;
      axis[d][1] = g.normal[d](next) + tangential;
      centre -= g.normal[d](c) + g.normal[d](next);
      const double of_d[2] = {g.cross[d][e](c), g.cross[d][e](next)};
      const double of_e[2] = {g.cross[e][d](c), g.cross[e][d](next_e)};
      for (int b = 0; b < 2; ++b)
        for (int a = 0; a < 2; ++a) edge[d][a + 2 * b] = (a == b ? 0.25 : -0.25) * (of_d[a] + of_e[b]);
    }
  }

  template <class Velocity>
  KOKKOS_INLINE_FUNCTION double apply(const Velocity& u, const IndexSpace& index, int c, int m) const {
    double sum = centre * u(c, m);
    for (int d = 0; d < 3; ++d) {
      const int s = index.stride(d), t = index.stride((d + 1) % 3);
      sum += axis[d][0] * u(c - s, m) + axis[d][1] * u(c + s, m);
      sum += edge[d][0] * u(c - s - t, m) + edge[d][1] * u(c + s - t, m) + edge[d][2] * u(c - s + t, m) +
             edge[d][3] * u(c + s + t, m);
    }
    return sum;
  }
};

/// Viscous forces on cell c over mu, all three components.
template <bool skewed, class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 viscous_force(const ViscousCoefficients& g, const Velocity& u, const IndexSpace& index,
                                          int c) {
  Vec3 force;
  if constexpr (skewed) {
    const ViscousStencil stencil(g, index, c);
    force = {stencil.apply(u, index, c, 0), stencil.apply(u, index, c, 1), stencil.apply(u, index, c, 2)};
  } else {
    // Written out, not looped over directions: a loop in here would keep compilers from vectorising over cells.
    const int s1 = index.stride(1), s2 = index.stride(2);
    const Vec3 here = load(u, c);
    force = g.normal[0](c + 1) * (load(u, c + 1) - here) - g.normal[0](c) * (here - load(u, c - 1)) +
            g.normal[1](c + s1) * (load(u, c + s1) - here) - g.normal[1](c) * (here - load(u, c - s1)) +
            g.normal[2](c + s2) * (load(u, c + s2) - here) - g.normal[2](c) * (here - load(u, c - s2));
  }
  return force;
}

/// Convective transport of component m through the face, with the volume flux F: central.
template <class Velocity>
KOKKOS_INLINE_FUNCTION double convective_face(const Velocity& u, double flux, NodeKind low_kind, NodeKind kind, int low,
                                              int c, int m) {
  if (kind == NodeKind::boundary) return flux * u(c, m);
  if (low_kind == NodeKind::boundary) return flux * u(low, m);
  return 0.5 * flux * (u(c, m) + u(low, m));
}

/// out = D^-1 A u on owned cells, compact order with component m at offset m * owned.
///  fluid:    mass V u - mu (viscous fluxes) [+ rho (convective fluxes with the given face fluxes)]
///  others:   0 (immersed velocities are eliminated: u holds what their rows make of the fluid's)
template <bool skewed, bool convective, class Velocity>
void apply_momentum(const GridViews& grid, const ViscousCoefficients& g, const Array<NodeKind>& kind,
                    const Array<double>& diagonal, double mass, double mu, double rho, const Array<double> (&flux)[3],
                    const Velocity& u, const Array<double>& out) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  const int owned = index.owned();
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  for_owned("corpuscle::fluid::momentum_operator", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k), e = index.compact(i, j, k);
    if (kind(c) != NodeKind::fluid) {
      for (int m = 0; m < 3; ++m) out(e + m * owned) = 0;
      return;
    }
    const double inertia = mass * volume(c), scale = 1 / diagonal(c);
    const Vec3 viscous = viscous_force<skewed>(g, u, index, c);
    for (int m = 0; m < 3; ++m) {
      double sum = inertia * u(c, m) - mu * viscous[m];
      if (convective) {  // not constexpr, as above
        for (int d = 0; d < 3; ++d) {
          const auto& f = d == 0 ? f0 : (d == 1 ? f1 : f2);
          const int next = c + index.stride(d), low = c - index.stride(d);
          sum += rho * (convective_face(u, f(next), kind(c), kind(next), c, next, m) -
                        convective_face(u, f(c), kind(low), kind(c), low, c, m));
        }
      }
      out(e + m * owned) = sum * scale;
    }
  });
}

/// The part of the right-hand side that does not change within a step, [cell, 3], nN:
/// V (mass1 u_old + mass2 u_older + force).
/// @param mass1, mass2  density times the coefficients of the backward difference (second: 2 / dt, -1 / (2 dt)), negated
inline void momentum_history(const GridViews& grid, double mass1, double mass2, const Components<double>& u_old,
                             const Components<double>& u_older, const Vec3& force, const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned("corpuscle::fluid::momentum_history", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    store(history, c, volume(c) * (mass1 * load(u_old, c) + mass2 * load(u_older, c) + force));
  });
}

/// history += V f for a force density that varies in space, [cell, 3], kPa/um.
inline void add_body_force(const GridViews& grid, const Components<double>& f, const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned("corpuscle::fluid::body_force", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    store(history, c, load(history, c) + volume(c) * load(f, c));
  });
}

/// history -= rho (convective fluxes of u with the face fluxes).
inline void subtract_convection(const GridViews& grid, const Array<NodeKind>& kind, double rho,
                                const Array<double> (&flux)[3], const Components<double>& u,
                                const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  for_owned("corpuscle::fluid::convection", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    if (kind(c) != NodeKind::fluid) return;
    for (int m = 0; m < 3; ++m) {
      double sum = 0;
      for (int d = 0; d < 3; ++d) {
        const auto& f = d == 0 ? f0 : (d == 1 ? f1 : f2);
        const int next = c + index.stride(d), low = c - index.stride(d);
        sum += convective_face(u, f(next), kind(c), kind(next), c, next, m) -
               convective_face(u, f(c), kind(low), kind(c), low, c, m);
      }
      history(c, m) -= rho * sum;
    }
  });
}

/// rhs [cell, 3] = D^-1 (history - V grad p) at fluid nodes, zero elsewhere.
inline void momentum_rhs(const GridViews& grid, const Array<NodeKind>& kind, const Array<double>& diagonal,
                         const Components<double>& history, const Components<double>& grad_p,
                         const Components<double>& rhs) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned("corpuscle::fluid::momentum_rhs", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const double scale = kind(c) == NodeKind::fluid ? 1 / diagonal(c) : 0.0;
    for (int m = 0; m < 3; ++m) rhs(c, m) = scale * (history(c, m) - volume(c) * grad_p(c, m));
  });
}

/// The momentum operator of an orthogonal grid without convection: A u = D^-1 (mass V u - mu (viscous fluxes)).
struct MomentumOperator {
  GridViews grid;
  ViscousCoefficients g;
  Array<double> inertia, scale;  // mass V / D and mu / D at fluid nodes, zero elsewhere

  KOKKOS_INLINE_FUNCTION Vec3 apply(const Components<double>& u, int c) const {
    return inertia(c) * load(u, c) - scale(c) * viscous_force<false>(g, u, grid.index, c);
  }
};

/// inertia = mass V / D, scale = mu / D at fluid nodes, zero elsewhere.
inline void momentum_scales(const IndexSpace& index, const Array<double>& volume, const Array<NodeKind>& kind,
                            const Array<double>& diagonal, double mass, double mu, const MomentumOperator& a) {
  for_owned("corpuscle::fluid::momentum_scales", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const double inverse = kind(c) == NodeKind::fluid ? 1 / diagonal(c) : 0.0;
    a.inertia(c) = mass * volume(c) * inverse;
    a.scale(c) = mu * inverse;
  });
}

/// Upper bound of the operator's eigenvalues on this rank, by Gershgorin's circles.
inline double largest_row_sum(const MomentumOperator& a) {
  const IndexSpace index = a.grid.index;
  double largest = 0;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::largest_row_sum", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& most) {
        const int c = index.cell(e % index.n[0], (e / index.n[0]) % index.n[1], e / (index.n[0] * index.n[1]));
        double sum = 0;
        for (int d = 0; d < 3; ++d) sum += 2 * (a.g.normal[d](c) + a.g.normal[d](c + index.stride(d)));
        const double row = a.inertia(c) + a.scale(c) * sum;
        if (row > most) most = row;
      },
      Kokkos::Max<double>(largest));
  return largest;
}

/// Start vector of the Lanczos process: smooth modes above all, a little of every other, the same on any ranks.
inline void lanczos_start(const MomentumOperator& a, const Components<double>& v) {
  const IndexSpace index = a.grid.index;
  for_owned("corpuscle::fluid::lanczos_start", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const double wave = 12.9 * (index.first[0] + i) + 78.2 * (index.first[1] + j) + 37.7 * (index.first[2] + k);
    for (int m = 0; m < 3; ++m) v(c, m) = a.scale(c) > 0 ? 1 + 0.3 * std::sin(wave + m) : 0.0;
  });
}

/// This rank's sum of D v . w, the inner product in which the operator is symmetric on an orthogonal grid. Over mu.
inline double diagonal_dot(const MomentumOperator& a, const Components<double>& v, const Components<double>& w) {
  const IndexSpace index = a.grid.index;
  return sum_owned("corpuscle::fluid::diagonal_dot", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    return a.scale(c) > 0 ? dot(load(v, c), load(w, c)) / a.scale(c) : 0.0;
  });
}

/// w = A v - beta w on owned cells.
inline void lanczos_operator(const MomentumOperator& a, double beta, const Components<double>& v, const Components<double>& w) {
  const IndexSpace index = a.grid.index;
  for_owned("corpuscle::fluid::lanczos_operator", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    store(w, c, a.apply(v, c) - beta * load(w, c));
  });
}

/// v = factor v - shift w on owned cells.
inline void lanczos_combine(const IndexSpace& index, double factor, double shift, const Components<double>& w,
                            const Components<double>& v) {
  for_owned("corpuscle::fluid::lanczos_combine", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    store(v, c, factor * load(v, c) - shift * load(w, c));
  });
}

/// previous = u + momentum (u - previous) + weight (rhs - A u) at fluid nodes, u at others: the next Chebyshev iterate
/// takes the place of the one before.
inline void momentum_step(const MomentumOperator& a, double momentum, double weight, const Components<double>& rhs,
                   const Components<double>& u, const Components<double>& previous) {
  const IndexSpace index = a.grid.index;
  for_owned("corpuscle::fluid::momentum_step", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const bool fluid = a.scale(c) > 0;
    const Vec3 here = load(u, c);
    const Vec3 next = here + momentum * (here - load(previous, c)) + weight * (load(rhs, c) - a.apply(u, c));
    store(previous, c, fluid ? next : here);
  });
}

/// This rank's sum of squares of rhs - A u over fluid nodes.
inline double momentum_residual_square(const MomentumOperator& a, const Components<double>& rhs, const Components<double>& u) {
  const IndexSpace index = a.grid.index;
  return sum_owned("corpuscle::fluid::momentum_residual", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const Vec3 r = load(rhs, c) - a.apply(u, c);
    return a.scale(c) > 0 ? dot(r, r) : 0.0;
  });
}

/// This rank's sum of squares of a vector field over owned cells.
inline double square_of(const IndexSpace& index, const Components<double>& u) {
  return sum_owned("corpuscle::fluid::square", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const Vec3 v = load(u, index.cell(i, j, k));
    return dot(v, v);
  });
}

/// residual (compact, component m at offset m * owned) = rhs - applied.
inline void compact_residual(const IndexSpace& index, const Components<double>& rhs, const Array<double>& applied,
                             const Array<double>& residual) {
  const int owned = index.owned();
  for_owned("corpuscle::fluid::compact_residual", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k), e = index.compact(i, j, k);
    for (int m = 0; m < 3; ++m) residual(e + m * owned) = rhs(c, m) - applied(e + m * owned);
  });
}

/// From compact Krylov vectors to the padded field.
inline void field_from_compact(const IndexSpace& index, const Array<double>& vector, const Components<double>& field) {
  const int owned = index.owned();
  for_owned("corpuscle::fluid::from_vector", index, KOKKOS_LAMBDA(int i, int j, int k) {
    for (int m = 0; m < 3; ++m) field(index.cell(i, j, k), m) = vector(index.compact(i, j, k) + m * owned);
  });
}

/// result = 2 a - b over whole fields, halos included.
inline void extrapolate(const Components<double>& a, const Components<double>& b, const Components<double>& result) {
  const int n = static_cast<int>(a.extent(0));
  Kokkos::parallel_for("corpuscle::fluid::extrapolate", Policy(0, n), KOKKOS_LAMBDA(int c) {
    for (int m = 0; m < 3; ++m) result(c, m) = 2 * a(c, m) - b(c, m);
  });
}

inline void extrapolate(const Array<double>& a, const Array<double>& b, const Array<double>& result) {
  const int n = static_cast<int>(a.extent(0));
  Kokkos::parallel_for("corpuscle::fluid::extrapolate", Policy(0, n),
                       KOKKOS_LAMBDA(int c) { result(c) = 2 * a(c) - b(c); });
}

}  // namespace corpuscle
