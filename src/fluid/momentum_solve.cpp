// The momentum equation of FluidSolver: residual, and its solution by Chebyshev iteration or BiCGStab.
#include "core/error.hpp"
#include "fluid/embedded_rows.hpp"
#include "fluid/fluid_solver.hpp"
#include "fluid/flux.hpp"
#include "fluid/integrals.hpp"

#include <fmt/format.h>

#include <KokkosBlas1_nrm2_squared.hpp>
#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// Smallest eigenvalue of the symmetric tridiagonal matrix, by bisection on the number of negative pivots.
double lowest_eigenvalue(const std::vector<double>& diagonal, const std::vector<double>& below) {
  double low = 1e300, high = 1e300;
  for (std::size_t n = 0; n < diagonal.size(); ++n) {
    const double left = n > 0 ? below[n - 1] : 0, right = n + 1 < diagonal.size() ? below[n] : 0;
    low = std::min(low, diagonal[n] - left - right);
    high = std::min(high, diagonal[n]);
  }
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    double pivot = 1;
    bool negative = false;
    for (std::size_t n = 0; n < diagonal.size() && !negative; ++n) {
      pivot = diagonal[n] - middle - (n > 0 ? below[n - 1] * below[n - 1] / pivot : 0.0);
      negative = pivot <= 0;
    }
    (negative ? high : low) = middle;
  }
  return low;
}

}  // namespace

/// out = D^-1 A u, compact.
void FluidSolver::apply_to_field(const Components<double>& u, const Array<double>& out) {
  const double rho = settings_.density_pg_per_um3;
  const bool implicit = settings_.convection == FluidSettings::Convection::implicit;
  const auto& f = implicit ? flux_extrapolated_ : flux_;
  if (skewed_ && implicit)
    apply_momentum<true, true>(grid_->views(), g_, kind_, diagonal_, mass_, mu_, rho, f, u, out);
  else if (skewed_)
    apply_momentum<true, false>(grid_->views(), g_, kind_, diagonal_, mass_, mu_, rho, f, u, out);
  else
    apply_momentum<false, true>(grid_->views(), g_, kind_, diagonal_, mass_, mu_, rho, f, u, out);
}

template <class Vector>
void FluidSolver::apply(const EmbeddedBodies* bodies, const Vector& v, const Array<double>& out) {
  field_from_compact(grid_->index(), v, work_);
  grid_->halo().exchange(work_);
  boundaries_.fill_homogeneous(work_);
  if (bodies) {  // immersed velocities follow from the fluid's: they are eliminated from the system
    apply_homogeneous_rows(*bodies, work_);
    exchange_immersed(work_);
  }
  apply_to_field(work_, out);
}

/// Right-hand side with the present pressure, and 2-norm of the momentum residual over that of the velocity.
double FluidSolver::momentum_residual() {
  const auto scope = timers_->scope("momentum");
  grid_->halo().exchange(p_);
  pressure_gradient(grid_->views(), kind_, mask_, p_, grad_p_);
  momentum_rhs(grid_->views(), kind_, diagonal_, history_, grad_p_, rhs_);
  double squares[2];
  if (krylov_) {
    apply_to_field(u_, krylov_->scratch);
    compact_residual(grid_->index(), rhs_, krylov_->scratch, krylov_->residual);
    squares[0] = KokkosBlas::nrm2_squared(krylov_->residual);
  } else {
    squares[0] = residual_square();
  }
  squares[1] = square_of(grid_->index(), u_);
  grid_->comm().sum(squares, 2);
  const double floor = 1e-30 + statistics_.reference_speed * statistics_.reference_speed;
  residual_norm_ = std::sqrt(squares[0]);
  return std::sqrt(squares[0] / std::max(squares[1], floor));
}

double FluidSolver::residual_square() {
  return momentum_residual_square(operator_, rhs_, u_);
}

void FluidSolver::solve_momentum(const EmbeddedBodies* bodies, double residual) {
  const auto scope = timers_->scope("momentum");
  const double norm = residual_norm_;
  // Relative to the velocity; to the first residual in the first steps from rest, where there is no velocity yet.
  const double size = residual > 0 ? norm / residual : 0;
  const double target = settings_.momentum_tolerance * std::max(size, norm);
  const auto result = krylov_ ? solve_krylov(bodies, target) : iterate_momentum(bodies, norm, target);
  statistics_.momentum_iterations += result.iterations;
  if (!result.converged)
    throw ComputationError(fmt::format(
        "velocity: the momentum equation did not converge in {} iterations (residual {:.3g} of the velocity, wanted "
        "{:.3g}). Likely cause: a step too long for the flow or a diverging run; reduce time.step_us or raise "
        "fluid.max_iterations",
        result.iterations, size > 0 ? result.residual / size : result.residual, settings_.momentum_tolerance));
}

KrylovResult FluidSolver::solve_krylov(const EmbeddedBodies* bodies, double target) {
  const auto result = krylov_->solver.solve(
      [&](const Array<double>& x, const Array<double>& y) { apply(bodies, x, y); }, krylov_->residual, krylov_->change,
      target, settings_.max_iterations);
  add_vector(grid_->index(), krylov_->change, u_);
  complete_velocity(bodies);
  return result;
}

/// Chebyshev iteration, in as many steps as theory says the reduction takes, and a few more at a time if it was not
/// enough (immersed rows change the spectrum a little).
KrylovResult FluidSolver::iterate_momentum(const EmbeddedBodies* bodies, double norm, double target) {
  constexpr int more = 3;
  KrylovResult result{0, norm, norm <= target};
  ChebyshevSteps steps(spectrum_.lowest, spectrum_.highest);
  const double centre = spectrum_.highest + spectrum_.lowest, radius = spectrum_.highest - spectrum_.lowest;
  double predicted = std::ceil(std::acosh(std::max(norm / target, 1.0)) / std::acosh(centre / radius));
  while (!result.converged && result.iterations < settings_.max_iterations && std::isfinite(result.residual)) {
    const int batch = std::min(static_cast<int>(std::max(predicted, 1.0)), settings_.max_iterations - result.iterations);
    for (int n = 0; n < batch; ++n) {
      const auto step = steps.next();
      momentum_step(operator_, step.momentum, step.weight, rhs_, u_, work_);
      std::swap(u_, work_);
      complete_velocity(bodies);
    }
    result.iterations += batch;
    result.residual = std::sqrt(grid_->comm().sum(residual_square()));
    result.converged = result.residual <= target;
    predicted = more;
  }
  return result;
}

/// Eigenvalues of the momentum operator without bodies (which only raise the lowest): from above by Gershgorin, from
/// below by a few steps of the Lanczos process.
void FluidSolver::bound_spectrum() {
  constexpr int steps = 30;
  constexpr double safety = 0.85;  // Ritz values approach the lowest eigenvalue from above
  const Comm& comm = grid_->comm();
  momentum_scales(grid_->index(), grid_->views().volume, grid_->views().base_kind, diagonal_, mass_, mu_, operator_);
  spectrum_.highest = comm.max(largest_row_sum(operator_));
  Components<double> v = work_, w = rhs_;
  std::vector<double> diagonal, below;
  lanczos_start(operator_, v);
  Kokkos::deep_copy(w, 0.0);
  double beta = 0, size = std::sqrt(comm.sum(diagonal_dot(operator_, v, v)));
  lanczos_combine(grid_->index(), 1 / size, 0, w, v);
  for (int n = 0; n < steps; ++n) {
    grid_->halo().exchange(v);
    boundaries_.fill_homogeneous(v);
    lanczos_operator(operator_, beta, v, w);
    const double alpha = comm.sum(diagonal_dot(operator_, v, w));
    lanczos_combine(grid_->index(), 1, alpha, v, w);
    diagonal.push_back(alpha);
    beta = std::sqrt(comm.sum(diagonal_dot(operator_, w, w)));
    if (!(beta > 1e-10 * spectrum_.highest)) break;
    below.push_back(beta);
    lanczos_combine(grid_->index(), 1 / beta, 0, v, w);
    std::swap(v, w);
  }
  spectrum_.lowest = safety * lowest_eigenvalue(diagonal, below);
}

}  // namespace corpuscle
