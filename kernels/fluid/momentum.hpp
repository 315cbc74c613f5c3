// The implicit part of the momentum equation over the viscosity, and what its solution needs.
#pragma once

#include "common/vec3.hpp"
#include "fluid/masked_gradient.hpp"
#include "fluid/viscosity.hpp"
#include "grid/grid_views.hpp"

#include <type_traits>

namespace corpuscle {

/// Coefficients of the viscous face fluxes. `normal[d]` multiplies the difference across the face; `cross[d][e]`
/// multiply the tangential differences and are allocated on skewed grids only.
struct NormalCoefficients {
  Array<double> normal[3];
};
struct ViscousCoefficients : NormalCoefficients {
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
    for_box(
        "corpuscle::fluid::viscous_coefficients", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) {
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

/// diagonal = mass V + mu (sum of the normal coefficients, each times the relative viscosity), on owned cells and one halo layer.
/// @param mass  density times the leading coefficient of the time derivative, pg/um3/us
template <class Viscosity>
void momentum_diagonal(const GridViews& grid, const ViscousCoefficients& g, double mass, double mu, const Viscosity& viscosity,
                       const Array<double>& diagonal) {
  const Viscosity relative = viscosity;
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  const auto g0 = g.normal[0], g1 = g.normal[1], g2 = g.normal[2];
  const int s0 = index.stride(0), s1 = index.stride(1), s2 = index.stride(2);
  for_box(
      "corpuscle::fluid::momentum_diagonal", {-1, -1, -1}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1},
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const auto of = [&](const Array<double>& g, int face, int beyond) { return g(face) * mean_viscosity(relative, c, beyond); };
        const double sum = of(g0, c, c - s0) + of(g0, c + s0, c + s0) + of(g1, c, c - s1) + of(g1, c + s1, c + s1) + of(g2, c, c - s2) +
                           of(g2, c + s2, c + s2);
        const double value = mass * volume(c) + mu * sum;
        diagonal(c) = value > 0 ? value : 1;
      });
}

/// Viscous flux of one velocity component through the face between c - stride(d) and c, over mu.
template <bool skewed, class Velocity>
KOKKOS_INLINE_FUNCTION double viscous_face(const ViscousCoefficients& g, const Velocity& u, const IndexSpace& index, int d, int c, int m) {
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
      const double tangential = 0.25 * (g.cross[e][d](next_e) - g.cross[e][d](c) + g.cross[f][d](next_f) - g.cross[f][d](c));
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
      sum += edge[d][0] * u(c - s - t, m) + edge[d][1] * u(c + s - t, m) + edge[d][2] * u(c - s + t, m) + edge[d][3] * u(c + s + t, m);
    }
    return sum;
  }
};

/// Viscous forces on cell c over mu, all three components.
template <bool skewed, class Coefficients, class Velocity>
KOKKOS_FORCEINLINE_FUNCTION auto viscous_force(const Coefficients& g, const Velocity& u, const IndexSpace& index, int c) {
  using Real = typename Velocity::non_const_value_type;
  Vector3<Real> force;
  if constexpr (skewed) {
    const ViscousStencil stencil(g, index, c);
    for (int m = 0; m < 3; ++m) force[m] = stencil.apply(u, index, c, m);
  } else {
    // Written out, not looped over directions: a loop in here would keep compilers from vectorising over cells.
    const int s1 = index.stride(1), s2 = index.stride(2);
    const Vector3<Real> here = load(u, c);
    force = g.normal[0](c + 1) * (load(u, c + 1) - here) - g.normal[0](c) * (here - load(u, c - 1)) +
            g.normal[1](c + s1) * (load(u, c + s1) - here) - g.normal[1](c) * (here - load(u, c - s1)) +
            g.normal[2](c + s2) * (load(u, c + s2) - here) - g.normal[2](c) * (here - load(u, c - s2));
  }
  return force;
}

/// Convective transport of component m through the face, with the volume flux F: central.
template <class Velocity>
KOKKOS_INLINE_FUNCTION double convective_face(const Velocity& u, double flux, NodeKind low_kind, NodeKind kind, int low, int c, int m) {
  if (kind == NodeKind::boundary) return flux * u(c, m);
  if (low_kind == NodeKind::boundary) return flux * u(low, m);
  return 0.5 * flux * (u(c, m) + u(low, m));
}

struct FaceFluxes {
  Array<double> flux[3];
};
struct NoFluxes {};

/// The momentum operator over mu at fluid nodes: inertia - viscous fluxes [+ convective fluxes with the given face fluxes].
/// Immersed velocities are eliminated: u holds there what their rows make of the fluid's.
/// @tparam Viscosity  UniformViscosity or VaryingViscosity; mu is the former's, and what the latter is relative to
template <bool skewed, bool convective, class Viscosity = UniformViscosity>
struct MomentumOperator : std::conditional_t<convective, FaceFluxes, NoFluxes>, Viscosity {
  IndexSpace index;
  Array<double> volume;
  Array<NodeKind> kind;
  std::conditional_t<skewed, ViscousCoefficients, NormalCoefficients> g;
  double mass_over_mu, density_over_mu;

  /// Before apply() with this velocity.
  template <class Velocity>
  void prepare(const Velocity& u) const {
    find_excess(static_cast<const Viscosity&>(*this), u, kind, index);
  }

  template <class Velocity>
  KOKKOS_FORCEINLINE_FUNCTION auto apply(const Velocity& u, int c) const {
    using Real = typename Velocity::non_const_value_type;
    Vector3<Real> image = (mass_over_mu * volume(c)) * load(u, c) - viscous_force<skewed>(g, u, index, c);
    subtract_excess(static_cast<const Viscosity&>(*this), c, image);
    if constexpr (convective)
      for (int m = 0; m < 3; ++m) {
        double sum = 0;
        for (int d = 0; d < 3; ++d) {
          const int next = c + index.stride(d), low = c - index.stride(d);
          sum += convective_face(u, this->flux[d](next), kind(c), kind(next), c, next, m) -
                 convective_face(u, this->flux[d](c), kind(low), kind(c), low, c, m);
        }
        image[m] += density_over_mu * sum;
      }
    return image;
  }
};

// Here nodes with a momentum equation are told by `inverse`, of the diagonal in the velocity's cycle, which is zero at all
// others: with node kinds, of one byte, compilers take so many cells at once that a short line has too few.

/// out = A u at fluid nodes, zero elsewhere.
template <class Operator>
void apply_momentum(const Operator& a, const Array<float>& inverse, const Components<float>& u, const Components<float>& out) {
  a.prepare(u);
  for_owned_rounded(
      "corpuscle::fluid::momentum_operator", a.index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = a.index.cell(i, j, k);
        const float fluid = inverse(c) > 0 ? 1 : 0;
        store(out, c, fluid * a.apply(u, c));
      });
}

/// residual = (history - V grad p) / mu - A u at fluid nodes, zero elsewhere; this rank's sums of squares of `inverse` times it, which
/// is a velocity, and of u.
template <class Operator>
void momentum_residual(const Operator& a, double mu, const Components<double>& history, const Components<double>& grad_p,
                       const Components<double>& u, const Array<float>& inverse, const Components<float>& residual,
                       const Kokkos::View<Sums<2>, Memory>& sums) {
  a.prepare(u);
  sums_owned(
      "corpuscle::fluid::momentum_residual", a.index,
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = a.index.cell(i, j, k);
        const double fluid = inverse(c) > 0 ? 1 : 0, scale = 1 / mu;
        const Vec3 left = fluid * (scale * (load(history, c) - a.volume(c) * load(grad_p, c)) - a.apply(u, c));
        residual(c, 0) = left.x, residual(c, 1) = left.y, residual(c, 2) = left.z;
        return Sums<2>{{inverse(c) * inverse(c) * dot(left, left), dot(load(u, c), load(u, c))}};
      },
      sums);
}

/// The part of the right-hand side that does not change within a step, [cell, 3], nN:
/// V (mass1 u_old + mass2 u_older + force).
/// @param mass1, mass2  density times the coefficients of the backward difference (second: 2 / dt, -1 / (2 dt)), negated
inline void momentum_history(const GridViews& grid, double mass1, double mass2, const Components<double>& u_old,
                             const Components<double>& u_older, const Vec3& force, const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned(
      "corpuscle::fluid::momentum_history", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(history, c, volume(c) * (mass1 * load(u_old, c) + mass2 * load(u_older, c) + force));
      });
}

/// history += V f for a force density that varies in space, [cell, 3], kPa/um.
inline void add_body_force(const GridViews& grid, const Components<double>& f, const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned(
      "corpuscle::fluid::body_force", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(history, c, load(history, c) + volume(c) * load(f, c));
      });
}

/// history -= rho (convective fluxes of u with the face fluxes).
inline void subtract_convection(const GridViews& grid, const Array<NodeKind>& kind, double rho, const Array<double> (&flux)[3],
                                const Components<double>& u, const Components<double>& history) {
  const IndexSpace index = grid.index;
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  for_owned(
      "corpuscle::fluid::convection", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::fluid) return;
        for (int m = 0; m < 3; ++m) {
          double sum = 0;
          for (int d = 0; d < 3; ++d) {
            const auto& f = d == 0 ? f0 : (d == 1 ? f1 : f2);
            const int next = c + index.stride(d), low = c - index.stride(d);
            sum += convective_face(u, f(next), kind(c), kind(next), c, next, m) - convective_face(u, f(c), kind(low), kind(c), low, c, m);
          }
          history(c, m) -= rho * sum;
        }
      });
}

/// Diagonal of the velocity's multigrid over mu without the faces between fluid nodes: inertia, and the faces to nodes whose
/// velocity is known. `natural`: sides with a condition on the derivative, which conduct nothing.
inline void velocity_own_diagonal(const GridViews& grid, const ViscousCoefficients& g, const Array<NodeKind>& kind, double mass_over_mu,
                                  const bool (&natural)[3][2], const Array<float>& own) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  const auto g0 = g.normal[0], g1 = g.normal[1], g2 = g.normal[2];
  double weight[3][2];
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) weight[d][side] = natural[d][side] ? 0 : 1;
  const double l0 = weight[0][0], h0 = weight[0][1], l1 = weight[1][0], h1 = weight[1][1], l2 = weight[2][0], h2 = weight[2][1];
  for_owned(
      "corpuscle::multigrid::velocity_own", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), s1 = index.stride(1), s2 = index.stride(2);
        const auto known = [&](int beyond, double conductance, double beyond_side) {
          if (kind(beyond) == NodeKind::fluid) return 0.0;
          return kind(beyond) == NodeKind::boundary ? beyond_side * conductance : conductance;
        };
        const double sum = known(c - 1, g0(c), l0) + known(c + 1, g0(c + 1), h0) + known(c - s1, g1(c), l1) +
                           known(c + s1, g1(c + s1), h1) + known(c - s2, g2(c), l2) + known(c + s2, g2(c + s2), h2);
        own(c) = kind(c) == NodeKind::fluid ? mass_over_mu * volume(c) + sum : 0.0;
      });
}

// Inner products of residuals, scaled to velocities; not in the operator's own loop, where sums in double precision would make it take
// four times as long.

/// This rank's sum of inverse^2 a . b.
inline double scaled_dot(const IndexSpace& index, const Array<float>& inverse, const Components<float>& a, const Components<float>& b) {
  return sum_owned(
      "corpuscle::fluid::scaled_dot", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const float sum = a(c, 0) * b(c, 0) + a(c, 1) * b(c, 1) + a(c, 2) * b(c, 2);
        return inverse(c) * inverse(c) * sum;
      });
}

/// Of a . b and of a . a.
inline void scaled_dots(const IndexSpace& index, const Array<float>& inverse, const Components<float>& a, const Components<float>& b,
                        const Kokkos::View<Sums<2>, Memory>& sums) {
  sums_owned(
      "corpuscle::fluid::scaled_dots", index,
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const float both = a(c, 0) * b(c, 0) + a(c, 1) * b(c, 1) + a(c, 2) * b(c, 2);
        const float own = a(c, 0) * a(c, 0) + a(c, 1) * a(c, 1) + a(c, 2) * a(c, 2);
        return Sums<2>{{inverse(c) * inverse(c) * both, inverse(c) * inverse(c) * own}};
      },
      sums);
}

/// u += factor direction at fluid nodes, r -= factor image; this rank's scaled r . r and shadow . r.
inline void advance_velocity(const IndexSpace& index, const Array<float>& inverse, double factor, const Components<float>& direction,
                             const Components<float>& image, const Components<float>& shadow, const Components<double>& u,
                             const Components<float>& r, const Kokkos::View<Sums<2>, Memory>& sums) {
  const float of_image = factor;
  sums_owned(
      "corpuscle::fluid::advance_velocity", index,
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const double step = inverse(c) > 0 ? factor : 0.0;
        float square = 0, along = 0;
        for (int m = 0; m < 3; ++m) {
          u(c, m) += step * direction(c, m);
          const float left = r(c, m) - of_image * image(c, m);
          r(c, m) = left;
          square += left * left;
          along += shadow(c, m) * left;
        }
        return Sums<2>{{inverse(c) * inverse(c) * square, inverse(c) * inverse(c) * along}};
      },
      sums);
}

/// p = r + beta (p - w v).
inline void next_direction(const IndexSpace& index, double beta, double w, const Components<float>& r, const Components<float>& v,
                           const Components<float>& p) {
  const float of_p = beta, of_v = -beta * w;
  for_owned(
      "corpuscle::fluid::next_direction", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        for (int m = 0; m < 3; ++m) p(c, m) = r(c, m) + of_p * p(c, m) + of_v * v(c, m);
      });
}

/// result = a + ratio (a - b) over whole fields, halos included.
inline void extrapolate(double ratio, const Components<double>& a, const Components<double>& b, const Components<double>& result) {
  const int n = static_cast<int>(a.extent(0));
  Kokkos::parallel_for(
      "corpuscle::fluid::extrapolate", Policy(0, n), KOKKOS_LAMBDA(int c) {
        for (int m = 0; m < 3; ++m) result(c, m) = (1 + ratio) * a(c, m) - ratio * b(c, m);
      });
}

inline void extrapolate(double ratio, const Array<double>& a, const Array<double>& b, const Array<double>& result) {
  const int n = static_cast<int>(a.extent(0));
  Kokkos::parallel_for(
      "corpuscle::fluid::extrapolate", Policy(0, n), KOKKOS_LAMBDA(int c) { result(c) = (1 + ratio) * a(c) - ratio * b(c); });
}

}  // namespace corpuscle
