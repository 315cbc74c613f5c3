// The momentum equation of FluidSolver: residual, and corrections in single precision by BiCGStab with a multigrid cycle.
#include "core/error.hpp"
#include "fluid/bicgstab.hpp"
#include "fluid/embedded_rows.hpp"
#include "fluid/fluid_solver.hpp"
#include "fluid/flux.hpp"
#include "fluid/integrals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

/// Calls `use` with the operator of this grid and these settings.
template <class Use>
void FluidSolver::with_operator(const Use& use) const {
  with_viscosity([&](const auto& viscosity) { with_operator(viscosity, use); });
}

template <class Viscosity, class Use>
void FluidSolver::with_operator(const Viscosity& viscosity, const Use& use) const {
  const auto fill = [&](auto a) {
    static_cast<Viscosity&>(a) = viscosity;
    a.index = grid_->index(), a.volume = grid_->views().volume, a.kind = kind_, a.g = g_;
    if constexpr (std::is_base_of_v<FaceFluxes, decltype(a)>)
      for (int d = 0; d < 3; ++d) a.flux[d] = flux_extrapolated_[d];
    a.mass_over_mu = mass_ / mu_, a.density_over_mu = settings_.density_pg_per_um3 / mu_;
    use(a);
  };
  const bool implicit = settings_.convection == FluidSettings::Convection::implicit;
  if (skewed_ && implicit)
    fill(MomentumOperator<true, true, Viscosity>());
  else if (skewed_)
    fill(MomentumOperator<true, false, Viscosity>());
  else if (implicit)
    fill(MomentumOperator<false, true, Viscosity>());
  else
    fill(MomentumOperator<false, false, Viscosity>());
}

/// The system A change = residual for bicgstab(). Inner products are those of velocities.
class FluidSolver::Correction {
 public:
  Correction(FluidSolver& fluid, const EmbeddedBodies* bodies)
      : f_(fluid), m_(*fluid.momentum_), finest_(m_.cycle.levels()[0]), index_(fluid.grid_->index()), bodies_(bodies) {}

  void start() {
    Kokkos::deep_copy(Exec(), m_.shadow, m_.r);
    Kokkos::deep_copy(Exec(), m_.p, m_.r);
  }
  double apply_p() {
    apply(m_.p, m_.v);
    return f_.grid_->comm().sum(scaled_dot(index_, finest_.views.inverse, m_.shadow, m_.v));
  }
  std::array<double, 2> apply_r() {
    apply(m_.r, m_.t);
    scaled_dots(index_, finest_.views.inverse, m_.t, m_.r, m_.two);
    return f_.two_sums();
  }
  double advance_v(double alpha) {
    advance_velocity(index_, finest_.views.inverse, alpha, finest_.x, m_.v, m_.shadow, f_.u_, m_.r, m_.two);
    return f_.two_sums()[0];
  }
  std::array<double, 2> advance_t(double omega) {
    advance_velocity(index_, finest_.views.inverse, omega, finest_.x, m_.t, m_.shadow, f_.u_, m_.r, m_.two);
    return f_.two_sums();
  }
  void next_p(double beta, double w) { next_direction(index_, beta, w, m_.r, m_.v, m_.p); }

 private:
  /// The direction, one multigrid cycle for `b`, stays in the cycle's x. Bodies count as fixed nodes in the cycle.
  void apply(const Components<float>& b, const Components<float>& image) {
    f_.boundaries_.clear_natural(finest_.x);
    finest_.b = b;
    m_.cycle.run(m_.depth);
    const auto& direction = finest_.x;
    f_.grid_->halo().exchange(direction);
    f_.boundaries_.fill_homogeneous(direction);
    if (bodies_) {  // immersed velocities follow from the fluid's: they are eliminated from the system
      apply_homogeneous_rows(*bodies_, direction);
      f_.exchange_immersed(direction);
    }
    f_.with_operator([&](const auto& a) { apply_momentum(a, finest_.views.inverse, direction, image); });
  }

  FluidSolver& f_;
  Momentum& m_;
  MultigridCycle<Components<CycleReal>>::Level& finest_;
  const IndexSpace& index_;
  const EmbeddedBodies* bodies_;
};

/// Over all ranks, of the last reduction of two.
std::array<double, 2> FluidSolver::two_sums() {
  Sums<2> both = momentum_->two_host.read()();
  grid_->comm().sum(both.value, 2);
  return {both[0], both[1]};
}

/// Squares of the momentum residual with the present pressure and velocity, and of the velocity, (um/us)^2, summed over nodes.
std::array<double, 2> FluidSolver::residual_squares() {
  with_operator([&](const auto& a) {
    corpuscle::momentum_residual(a, mu_, history_, grad_p_, u_, momentum_->cycle.levels()[0].views.inverse, momentum_->r, momentum_->two);
  });
  return two_sums();
}

/// The residual's 2-norm over all nodes, kept in residual_norm_, over that of the velocity.
double FluidSolver::momentum_residual() {
  const auto scope = timers_->scope("momentum");
  grid_->halo().exchange(p_);
  with_face_force([&](const auto& force) { pressure_gradient(grid_->views(), kind_, mask_, p_, grad_p_, force); });
  const auto [residual, velocity] = residual_squares();
  residual_norm_ = std::sqrt(residual);
  velocity_norm_ = std::sqrt(velocity);
  const double floor = 1e-30 + statistics_.reference_speed * statistics_.reference_speed;
  return residual_norm_ / std::sqrt(std::max(velocity, floor));
}

/// A share of the velocity is no small share of what drives a slow flow: where less than that is asked for in a step, nothing
/// would be solved, and the flow would go on as extrapolated. So a tolerance looser than the default asks for a hundredth of
/// the change over the step at least, which the residual then falsifies by a hundredth; as the flow comes to rest, both vanish.
/// @param size  of the velocity, as a residual; 0 at rest, where the first residual is the change
double FluidSolver::residual_target(double size) {
  constexpr double strict = 1e-6, share = 0.01;
  const double tolerance = settings_.momentum_tolerance, scale = std::max(size, residual_norm_);
  if (tolerance <= strict) return tolerance * scale;
  if (size == 0) return std::min(tolerance, share) * scale;
  const double change = std::sqrt(
      grid_->comm().sum(inertia_square(grid_->views(), kind_, mass_ / mu_, momentum_->cycle.levels()[0].views.inverse, u_, u_old_)));
  return std::max(strict * scale, std::min(tolerance * scale, share * change));
}

/// Corrections until the residual is small enough, each of at most four digits: single precision has no more to give. Several
/// are needed where an immersed node is the last one before an outflow, whose velocity lags behind it by one correction.
void FluidSolver::solve_momentum(const EmbeddedBodies* bodies, double residual) {
  const auto scope = timers_->scope("momentum");
  constexpr double least_reduction = 1e-4, margin = 0.9;
  // Relative to the velocity; to the first residual in the first steps from rest, where there is no velocity yet.
  const double size = residual > 0 ? residual_norm_ / residual : 0;
  const double target = residual_target(size);
  Correction correction(*this, bodies);
  const double start = residual_norm_;
  int iterations = 0;
  while (residual_norm_ > target && iterations < settings_.max_iterations) {
    const auto result = bicgstab(correction, residual_norm_ * residual_norm_, std::max(margin * target, least_reduction * residual_norm_),
                                 settings_.max_iterations - iterations);
    if (result.iterations == 0) break;  // not finite in single precision
    iterations += result.iterations;
    complete_velocity(bodies);
    residual_norm_ = std::sqrt(residual_squares()[0]);
  }
  statistics_.momentum_iterations += iterations;
  if (residual_norm_ <= target) return;
  // Round-off of sums of a few dozen terms; a solve that has come this far has converged as far as it can.
  constexpr double round_off = 1e-14, falling = 0.5;
  const double scale = size > 0 ? size : 1;
  const char* cause = residual_norm_ <= round_off * scale ? "the tolerance is finer than double precision; raise fluid.momentum_tolerance"
                      : iterations >= settings_.max_iterations && residual_norm_ <= falling * start
                          ? "too few iterations: the residual was still falling; raise fluid.max_iterations"
                          : "a step too long for the flow or a diverging run; reduce time.step_us";
  throw ComputationError(
      fmt::format("velocity: the momentum equation did not converge in {} iterations (residual {:.3g} of the velocity, from {:.3g}, wanted "
                  "{:.3g}). Likely cause: {}",
                  iterations, residual_norm_ / scale, start / scale, target / scale, cause));
}

/// The cycle's equation for the present mass, node kinds and viscosity, where they changed; after the hierarchy's update.
void FluidSolver::update_momentum_cycle() {
  visit_varying_viscosity([this](const VaryingViscosity& viscosity) {
    viscous_hierarchy_->update(mask_, viscosity);
    momentum_->stale = true;
  });
  if (!momentum_->stale) return;
  momentum_->stale = false;
  momentum_->depth = momentum_depth();
  auto& finest = momentum_->cycle.levels()[0];
  velocity_own_diagonal(grid_->views(), g_, kind_, mass_ / mu_, boundaries_.natural(), finest.own);
  momentum_->cycle.update();
}

/// Coarser levels are of use where neighbours couple more strongly than inertia holds a cell: elsewhere smoothing solves.
int FluidSolver::momentum_depth() const {
  const double inertia = mass_ / mu_ * grid_->total_volume();
  int depth = 0;
  for (const auto& level : hierarchy_->levels()) depth += level.strength > 2 * inertia;
  return depth;
}

}  // namespace corpuscle
