// A manufactured Navier-Stokes solution: an Arnold-Beltrami-Childress flow that varies in time, with a pressure of its
// own, on a skewed curvilinear grid. curl u = u, so the Laplacian is -u and the convective term the gradient of
// |u|^2/2. The viscosity may vary in space.
#pragma once

#include <cmath>

#include "fluid/fluid_solver.hpp"
#include "fluid/integrals.hpp"

namespace corpuscle::manufactured {

struct Flow {
  double rho = 1, mu = 0.3, a = 1.0, b = 0.7, c = 0.4, rate = 2.0;
  double contrast = 0;  // the viscosity is mu exp(contrast s), s between -1 and 1
  bool convective = true;
  /// Start with sin^3 from rest: then the start has no spatial error, which would leave an error of order h^2 dt.
  bool from_rest = false;

  KOKKOS_INLINE_FUNCTION double amplitude(double t) const {
    const double s = std::sin(rate * t);
    return from_rest ? (t > 0 ? s * s * s : 0.0) : 1 + 0.5 * s;
  }
  KOKKOS_INLINE_FUNCTION double growth(double t) const {
    const double s = std::sin(rate * t), c = std::cos(rate * t);
    return from_rest ? (t > 0 ? 3 * rate * s * s * c : 0.0) : 0.5 * rate * c;
  }
  KOKKOS_INLINE_FUNCTION Vec3 shape(const Vec3& x) const {
    return {a * std::sin(x.z) + c * std::cos(x.y), b * std::sin(x.x) + a * std::cos(x.z), c * std::sin(x.y) + b * std::cos(x.x)};
  }
  KOKKOS_INLINE_FUNCTION Vec3 velocity(const Vec3& x, double t) const { return amplitude(t) * shape(x); }
  KOKKOS_INLINE_FUNCTION double pressure(const Vec3& x, double t) const {
    return amplitude(t) * std::cos(x.x) * std::sin(x.y) * std::cos(x.z);
  }
  KOKKOS_INLINE_FUNCTION double relative_viscosity(const Vec3& x) const {
    return std::exp(contrast * std::sin(1.3 * x.x + 0.4 * x.y) * std::cos(1.1 * x.z - 0.3));
  }
  KOKKOS_INLINE_FUNCTION Vec3 relative_viscosity_gradient(const Vec3& x) const {
    const double a = 1.3 * x.x + 0.4 * x.y, b = 1.1 * x.z - 0.3;
    return contrast * relative_viscosity(x) *
           Vec3{1.3 * std::cos(a) * std::cos(b), 0.4 * std::cos(a) * std::cos(b), -1.1 * std::sin(a) * std::sin(b)};
  }
  /// du[d] = the shape's derivative along d.
  KOKKOS_INLINE_FUNCTION void shape_derivatives(const Vec3& x, Vec3 (&du)[3]) const {
    du[0] = {0, b * std::cos(x.x), -b * std::sin(x.x)};
    du[1] = {-c * std::sin(x.y), 0, c * std::cos(x.y)};
    du[2] = {a * std::cos(x.z), -a * std::sin(x.z), 0};
  }
  KOKKOS_INLINE_FUNCTION Vec3 force(const Vec3& x, double t) const {
    const Vec3 u = shape(x);
    const double f = amplitude(t);
    Vec3 du[3];
    shape_derivatives(x, du);
    // -div(mu (grad u + grad u^T)) = mu u - grad mu . (grad u + grad u^T)
    Vec3 total = (rho * growth(t) + mu * relative_viscosity(x) * f) * u;
    const Vec3 slope = (mu * f) * relative_viscosity_gradient(x);
    for (int d = 0; d < 3; ++d) {
      total -= slope[d] * du[d];
      total[d] -= dot(slope, du[d]);
    }
    const Vec3 grad_p = {-std::sin(x.x) * std::sin(x.y) * std::cos(x.z), std::cos(x.x) * std::cos(x.y) * std::cos(x.z),
                         -std::cos(x.x) * std::sin(x.y) * std::sin(x.z)};
    total += f * grad_p;
    if (convective) {
      for (int d = 0; d < 3; ++d) total[d] += rho * f * f * dot(u, du[d]);
    }
    return total;
  }
};

inline void set_force(const GridViews& grid, const Flow& flow, double t, const Components<double>& force) {
  const auto x = grid.x;
  Kokkos::parallel_for(
      "corpuscle::test::force", Policy(0, grid.index.size()), KOKKOS_LAMBDA(int e) { store(force, e, flow.force(load(x, e), t)); });
}

inline void set_velocity(const GridViews& grid, const Flow& flow, double t, const Components<double>& u) {
  const auto x = grid.x;
  Kokkos::parallel_for(
      "corpuscle::test::velocity", Policy(0, grid.index.size()), KOKKOS_LAMBDA(int e) { store(u, e, flow.velocity(load(x, e), t)); });
}

/// Exact fluxes by the mid-point rule, at the mean of the neighbouring centres.
inline void set_face_flux(const GridViews& grid, const Flow& flow, double t, const Array<double> (&flux)[3]) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    const auto f = flux[d];
    const int stride = index.stride(d);
    for_box(
        "corpuscle::test::flux", {0, 0, 0}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
          const int c = index.cell(i, j, k);
          const Vec3 u = 0.5 * (flow.velocity(load(x, c), t) + flow.velocity(load(x, c - stride), t));
          f(c) = dot(load(area, c), u);
        });
  }
}

/// Cube of side 2 um, sheared by 0.35 and warped: face angles down to about 60 degrees.
inline NodeSource skewed_cube(int cells) {
  return {{cells, cells, cells}, [cells](int i, int j, int k) {
            const double s = 2.0 / cells, u = s * i, v = s * j, w = s * k, pi = std::acos(-1.0);
            const double bump = 0.06 * std::sin(pi * u) * std::sin(pi * v) * std::sin(pi * w);
            return Triple{u + 0.35 * v + bump + 0.05 * std::sin(pi * w), v + 0.2 * w - bump, w + 0.15 * u + bump + 0.04 * std::sin(pi * v)};
          }};
}

/// Velocity um/us, pressure kPa, largest divergence of the face fluxes in any step over U h^2.
struct Errors {
  double velocity = 0, pressure = 0, divergence = 0;
};

/// The fields at the end, for differences between runs on the same grid.
struct Fields {
  Components<double> u;
  Array<double> p;
};

/// Volume-weighted rms of the difference of two runs on the grid of `source`; pressure up to its mean.
inline Errors difference(const Comm& comm, const NodeSource& source, const Fields& a, const Fields& b) {
  const Grid grid(comm, source, {false, false, false});
  const auto views = grid.views();
  double sums[4] = {0, 0, 0, 0};
  for (int m = 0; m < 4; ++m) {
    reduce_owned(
        "corpuscle::test::difference", views.index,
        KOKKOS_LAMBDA(int i, int j, int k, double& sum) {
          const int c = views.index.cell(i, j, k);
          const Vec3 e = load(a.u, c) - load(b.u, c);
          const double ep = a.p(c) - b.p(c);
          const double term[4] = {dot(e, e), ep, ep * ep, 1};
          sum += views.volume(c) * term[m];
        },
        Kokkos::Sum<double>(sums[m]));
  }
  comm.sum(sums, 4);
  const double mean = sums[1] / sums[3];
  return {std::sqrt(sums[0] / sums[3]), std::sqrt(std::max(sums[2] / sums[3] - mean * mean, 0.0)), 0};
}

/// All sides prescribe the exact velocity. Returns volume-weighted rms errors at the end; pressure up to its mean.
/// @param dt     mean length of the steps
/// @param ratio  of every second step's length to the others'
inline Errors run(const Comm& comm, const NodeSource& source, double dt, int steps, FluidSettings settings, Fields* fields = nullptr,
                  Flow flow = {}, double ratio = 1) {
  Grid grid(comm, source, {false, false, false});
  flow.convective = settings.convection != FluidSettings::Convection::none;
  settings.density_pg_per_um3 = flow.rho;
  settings.kinematic_viscosity_um2_per_us = flow.mu / flow.rho;
  std::vector<BoundarySettings> sides(6);
  for (int s = 0; s < 6; ++s) {
    sides[s].side = static_cast<BoundarySettings::Side>(s);
    sides[s].type = BoundarySettings::Type::velocity_inlet;
    sides[s].velocity = Triple{1, 0, 0};
  }
  FluidSolver solver(grid, settings, sides);
  if (flow.contrast != 0) {
    const Array<double> relative("corpuscle::test::viscosity", grid.index().size());
    const auto x = grid.views().x;
    Kokkos::parallel_for(
        "corpuscle::test::viscosity", Policy(0, grid.index().size()),
        KOKKOS_LAMBDA(int e) { relative(e) = flow.relative_viscosity(load(x, e)); });
    solver.set_viscosity(relative);
  }
  Components<double> force("corpuscle::test::force", grid.index().size(), 3);
  const auto given = solver.boundaries().given();
  const auto views = grid.views();
  solver.set_body_force(force, [&](double t) {
    set_force(views, flow, t, force);
    set_velocity(views, flow, t, given);
  });
  auto start = solver.state();
  const double length[2] = {2 * dt / (1 + ratio), ratio * 2 * dt / (1 + ratio)};
  set_velocity(views, flow, -length[1], start.u_old);
  set_velocity(views, flow, 0, start.u);
  Kokkos::parallel_for(
      "corpuscle::test::pressure", Policy(0, views.index.size()),
      KOKKOS_LAMBDA(int e) { start.p(e) = flow.pressure(load(views.x, e), 0); });
  set_face_flux(views, flow, 0, start.flux);
  if (start.flux_old[0].data()) set_face_flux(views, flow, -length[1], start.flux_old);
  start.history_levels = 1;
  start.step_us = length[1];
  solver.restore(start);
  Errors errors;
  for (int n = 0; n < steps; ++n) {
    solver.begin_step(length[n % 2]);
    solver.solve((n / 2 * 2) * dt + (n % 2) * length[0] + length[n % 2], nullptr);
    errors.divergence = larger(errors.divergence, solver.statistics().divergence);
  }
  const double t = steps * dt, h = grid.mean_spacing();
  errors.divergence /= solver.statistics().reference_speed * h * h;
  double sums[4] = {0, 0, 0, 0};  // |u error|^2, p error, p error^2, volume
  const auto u = solver.velocity();
  const auto p = solver.pressure();
  for (int m = 0; m < 4; ++m) {
    reduce_owned(
        "corpuscle::test::error", views.index,
        KOKKOS_LAMBDA(int i, int j, int k, double& sum) {
          const int c = views.index.cell(i, j, k);
          const Vec3 e = load(u, c) - flow.velocity(load(views.x, c), t);
          const double ep = p(c) - flow.pressure(load(views.x, c), t);
          const double term[4] = {dot(e, e), ep, ep * ep, 1};
          sum += views.volume(c) * term[m];
        },
        Kokkos::Sum<double>(sums[m]));
  }
  comm.sum(sums, 4);
  errors.velocity = std::sqrt(sums[0] / sums[3]);
  const double mean = sums[1] / sums[3];
  errors.pressure = std::sqrt(std::max(sums[2] / sums[3] - mean * mean, 0.0));
  if (fields) *fields = {u, p};
  return errors;
}

}  // namespace corpuscle::manufactured
