#include "fluid/fluid_solver.hpp"

#include "core/error.hpp"
#include "fluid/embedded_rows.hpp"
#include "fluid/flux.hpp"
#include "fluid/integrals.hpp"
#include "fluid/projection_failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

Vec3 to_vec3(const Triple& a) { return {a[0], a[1], a[2]}; }

/// The lowest-numbered fluid cell of the whole grid, as a padded number on the rank that owns it and -1 elsewhere.
int cell_to_pin(Grid& grid, const Array<NodeKind>& kind) {
  const int first = first_fluid_cell(grid.index(), kind);
  const double mine = first >= 0 ? grid.comm().rank() : grid.comm().size();
  return grid.comm().min(mine) == mine && first >= 0 ? first : -1;
}

}  // namespace

FluidSolver::FluidSolver(Grid& grid, const FluidSettings& settings, const std::vector<BoundarySettings>& boundaries,
                         const GridSettings* shape, Timers* timers)
    : grid_(&grid),
      timers_(timers ? timers : &own_timers_),
      settings_(settings),
      boundaries_(grid, boundaries, shape),
      mu_(settings.density_pg_per_um3 * settings.kinematic_viscosity_um2_per_us),
      imposed_gradient_(1e-3 * to_vec3(settings.pressure_gradient_Pa_per_um)),
      skewed_(!grid.orthogonal()) {
  const int n = grid.index().size(), owned = grid.index().owned();
  for (auto* field : {&u_, &u_old_, &u_older_, &work_, &history_, &grad_p_})
    *field = Components<double>("corpuscle::fluid::velocity", n, 3);
  for (auto* field : {&p_, &p_old_, &psi_field_, &diagonal_}) *field = Array<double>("corpuscle::fluid::scalar", n);
  const bool convective = settings_.convection != FluidSettings::Convection::none;
  for (int d = 0; d < 3; ++d) {
    flux_[d] = Array<double>("corpuscle::fluid::flux", n);
    if (convective) {
      flux_old_[d] = Array<double>("corpuscle::fluid::flux_old", n);
      flux_extrapolated_[d] = Array<double>("corpuscle::fluid::flux_extrapolated", n);
    }
    g_.normal[d] = Array<double>("corpuscle::fluid::coefficient", n);
    for (int e = 0; e < 3 && skewed_; ++e)
      if (e != d) g_.cross[d][e] = Array<double>("corpuscle::fluid::cross_coefficient", n);
  }
  negative_divergence_ = Array<double>("corpuscle::fluid::scalar_vector", owned);
  kind_ = grid.views().base_kind;
  mask_ = PressureMask("corpuscle::fluid::pressure_mask", n);
  statistics_.reference_speed = boundaries_.largest_speed();
  if (skewed_)
    viscous_coefficients<true>(grid.views(), g_);
  else
    viscous_coefficients<false>(grid.views(), g_);
  hierarchy_ = std::make_unique<MultigridHierarchy>(grid, g_.normal);
  make_momentum(*hierarchy_);
  pressure_cycle_ = std::make_unique<PressureCycle>(*hierarchy_);
  if (skewed_) {
    psi_ = Array<double>("corpuscle::fluid::scalar_vector", owned);
    pressure_system_ = std::make_unique<HypreSystem>(grid.comm(), grid.index(), grid.halo(), true);
    pressure_krylov_ = std::make_unique<PressureKrylov>(
        *pressure_system_, [cycle = pressure_cycle_.get()](const Array<double>& b, const Array<double>& x) { cycle->apply(b, x); },
        settings.max_iterations);
  } else {
    multigrid_ = std::make_unique<PressureMultigrid>(*hierarchy_, *pressure_cycle_, g_.normal, settings.max_iterations);
  }
  update_pressure_equation();
}

void FluidSolver::make_momentum(MultigridHierarchy& hierarchy) {
  momentum_ = std::make_unique<Momentum>(hierarchy, grid_->index().size());
  for (auto& level : momentum_->cycle.levels())
    for (int d = 0; d < 3; ++d)
      for (int side = 0; side < 2; ++side) level.views.closed[d][side] = !level.views.shared[d][side];
}

void FluidSolver::set_viscosity(const Array<double>& relative, double least, const Array<double>& fluidity) {
  fluidity_ = fluidity;
  smooth_viscosity_ = fluidity.data() ? Array<double>("corpuscle::fluid::smooth_viscosity", grid_->index().size()) : Array<double>();
  relative_viscosity_ = relative;
  least_viscosity_ = least;
  // Only where cells are it is ever written: what a run takes of memory must not grow as they come to other places.
  for (auto& excess : excess_) excess = Components<double>("corpuscle::fluid::excess_flux", grid_->index().size(), 3);
  excess_force_ = Components<double>("corpuscle::fluid::excess_force", grid_->index().size(), 3);
  excess_marks_ = Array<unsigned char>("corpuscle::fluid::excess_marks", grid_->index().size());
  momentum_.reset();
  viscous_hierarchy_ = std::make_unique<MultigridHierarchy>(*grid_, g_.normal);
  make_momentum(*viscous_hierarchy_);
}

void FluidSolver::update_pressure_equation() {
  mark_pressure(kind_, boundaries_.outflow(), mask_);
  if (!boundaries_.has_outflow()) pinned_ = cell_to_pin(*grid_, kind_);
  hierarchy_->update(mask_);
  momentum_->stale = true;
  pressure_cycle_->update(pinned_);
  if (multigrid_) return multigrid_->update(mask_);
  pressure_rows<true>(grid_->views(), g_.normal, kind_, mask_, pressure_system_->pattern(), pinned_, pressure_system_->values());
  pressure_system_->set_values();
}

KrylovResult FluidSolver::solve_pressure(double target) {
  const KrylovResult result = multigrid_ ? multigrid_->solve(negative_divergence_, psi_field_, target)
                                         : pressure_krylov_->solve(negative_divergence_, psi_, target);
  if (!result.converged) pressure_cycle_->raise();
  if (!multigrid_) scalar_from_compact(grid_->index(), psi_, psi_field_);
  return result;
}

void FluidSolver::set_kinds(const Array<NodeKind>& kind) {
  kind_ = kind;
  update_pressure_equation();
}

void FluidSolver::mend_pressure(const std::function<void(const Array<double>&)>& change) {
  change(p_);
  grid_->halo().exchange(p_);
  Kokkos::deep_copy(Exec(), p_old_, p_);
}

void FluidSolver::set_body_force(const Components<double>& force, std::function<void(double)> update) {
  body_force_ = force;
  update_force_ = std::move(update);
}

void FluidSolver::fill_halos(const Components<double>& u) {
  grid_->halo().exchange(u);
  boundaries_.fill(u);
}

/// Immersed nodes of neighbouring ranks; a rank alone has set its own.
template <class Velocity>
void FluidSolver::exchange_immersed(const Velocity& u) {
  if (shares_nodes()) grid_->halo().exchange(u);
}

template void FluidSolver::exchange_immersed(const Components<double>&);
template void FluidSolver::exchange_immersed(const Components<float>&);

/// Everything that follows from the velocity at fluid nodes: halos, boundary nodes, immersed nodes.
void FluidSolver::complete_velocity(const EmbeddedBodies* bodies) {
  fill_halos(u_);
  if (!bodies) return;
  apply_velocity_rows(bodies->velocity, bodies->rows, bodies->u_surface, u_);
  exchange_immersed(u_);
}

void FluidSolver::update_diagonal() {
  with_viscosity([&](const auto& viscosity) { momentum_diagonal(grid_->views(), g_, mass_, mu_, viscosity, diagonal_); });
}

void FluidSolver::begin_step(double dt) {
  const auto scope = timers_->scope("momentum");
  const double rho = settings_.density_pg_per_um3;
  std::swap(u_older_, u_old_);
  std::swap(u_old_, u_);
  Kokkos::deep_copy(p_old_, p_);
  const bool second_order = history_levels_ >= 1;
  // Backward differences on steps dt and dt / ratio (Hairer, Norsett and Wanner, Solving ODEs I, section III.5).
  ratio_ = second_order ? dt / last_step_ : 0;
  last_step_ = dt;
  mass_ = rho * (1 + 2 * ratio_) / ((1 + ratio_) * dt);
  mass1_ = rho * (1 + ratio_) / dt;
  mass2_ = -rho * ratio_ * ratio_ / ((1 + ratio_) * dt);
  if (!relative_viscosity_.data()) update_diagonal();
  if (mass_ != momentum_->mass) momentum_->mass = mass_, momentum_->stale = true;
  // First guess: extrapolated in time (u_ still holds the oldest level and is overwritten).
  if (second_order)
    extrapolate(ratio_, u_old_, u_older_, u_);
  else
    Kokkos::deep_copy(u_, u_old_);
  if (settings_.convection != FluidSettings::Convection::none) {
    for (int d = 0; d < 3; ++d) {
      if (second_order)
        extrapolate(ratio_, flux_[d], flux_old_[d], flux_extrapolated_[d]);
      else
        Kokkos::deep_copy(flux_extrapolated_[d], flux_[d]);
      std::swap(flux_[d], flux_old_[d]);
    }
    if (settings_.convection == FluidSettings::Convection::extrapolated) Kokkos::deep_copy(work_, u_);
  }
  ++history_levels_;
  const FluidStatistics before = statistics_;
  statistics_ = {};
  statistics_.reference_speed = before.reference_speed;
  statistics_.speed = before.speed;
}

void FluidSolver::assemble_history(double time) {
  boundaries_.set_time(time);
  if (update_force_) update_force_(time);
  momentum_history(grid_->views(), mass1_, mass2_, u_old_, u_older_, -imposed_gradient_, history_);
  if (body_force_.data()) add_body_force(grid_->views(), body_force_, history_);
  if (settings_.convection == FluidSettings::Convection::extrapolated && history_levels_ > 0) {
    if (history_levels_ > 1)
      extrapolate(ratio_, u_old_, u_older_, work_);
    else
      Kokkos::deep_copy(work_, u_old_);
    subtract_convection(grid_->views(), kind_, settings_.density_pg_per_um3, flux_extrapolated_, work_, history_);
  }
}

void FluidSolver::make_flux(const EmbeddedBodies* bodies) {
  with_face_force([&](const auto& force) {
    if (skewed_)
      interpolate_flux<true>(grid_->views(), g_.normal, kind_, mask_, diagonal_, u_, p_, grad_p_, flux_, force);
    else
      interpolate_flux<false>(grid_->views(), g_.normal, kind_, mask_, diagonal_, u_, p_, grad_p_, flux_, force);
  });
  boundaries_.close_moving_walls(flux_);
  const double growth = bodies && bodies->bodies > 0 ? give_bodies_their_flux(*bodies) : 0;
  if (boundaries_.has_inlet() && !boundaries_.has_outflow()) note_correction(boundaries_.balance(flux_, growth));
}

/// @param speed  change of the mean velocity through some faces, um/us
void FluidSolver::note_correction(double speed) {
  const double reference = std::max(statistics_.reference_speed, 1e-30);
  statistics_.flux_correction = larger(statistics_.flux_correction, speed / reference);
}

/// The fluxes around each body add up to its growth. Where nothing can leave the block, what all bodies together grow by
/// (the round-off of rigid motions and of membranes that keep their volume) is shared out over their faces.
/// @returns the growth of all bodies, um3/us
double FluidSolver::give_bodies_their_flux(const EmbeddedBodies& bodies) {
  if (static_cast<int>(body_sums_.extent(0)) != bodies.bodies) {
    body_sums_ = Table<double>("corpuscle::immersed::body_sums", bodies.bodies, 2);
    body_sums_host_ = HostCopy(body_sums_);
  }
  if (!growth_host_.is_of(bodies.growth)) growth_host_ = HostCopy(bodies.growth);
  body_flux_sums(grid_->views(), bodies, flux_, body_sums_);
  const auto& sums = body_sums_host_.read();
  grid_->comm().sum(sums.data(), 2 * bodies.bodies);
  const auto& growth = growth_host_.read();
  double total = 0, area = 0;
  for (int b = 0; b < bodies.bodies; ++b) total += growth(b), area += sums(b, 1);
  const bool closed = !boundaries_.has_outflow() && !boundaries_.has_inlet();
  const double surplus = closed && area > 0 ? total / area : 0;
  for (int b = 0; b < bodies.bodies; ++b) {
    sums(b, 0) += surplus * sums(b, 1);
    if (sums(b, 1) > 0) note_correction(std::abs(growth(b) - sums(b, 0)) / sums(b, 1));
  }
  body_sums_host_.write();
  correct_body_flux(grid_->views(), bodies, body_sums_, flux_);
  return total;
}

/// Fluid nodes, of all ranks, from which no path leads to where the pressure is given: their equation has no solution.
long FluidSolver::cut_off_nodes() {
  const IndexSpace& index = grid_->index();
  Array<int> mark("corpuscle::fluid::mark", index.size()), next("corpuscle::fluid::mark", index.size());
  for (const auto& seeded : {mark, next}) seed_marks(boundaries_.outflow(), boundaries_.has_outflow() ? -1 : pinned_, seeded);
  for (long added = 1; added > 0;) {
    grid_->halo().exchange(mark);
    added = grid_->comm().sum(static_cast<long>(spread_marks(index, kind_, mark, next)));
    std::swap(mark, next);
  }
  return grid_->comm().sum(static_cast<long>(unmarked_cells(index, kind_, mark)));
}

void FluidSolver::check_connected() {
  const long cut_off = cut_off_nodes();
  if (cut_off == 0) return;
  throw ComputationError(
      fmt::format("pressure: on this grid the bodies cut off {} fluid nodes from {}. Likely cause: a gap of less than two or three grid "
                  "spacings all around, between a body and a wall, between two bodies or in a body's fold: refine the grid (grid.nodes), "
                  "widen the channel, move the bodies apart (center_um), or end the run before (time.end_us)",
                  cut_off, boundaries_.has_outflow() ? "the outflow" : "the rest"));
}

/// @param before  the divergence that the last solve started from; its potential has not been applied yet if `attempted`
void FluidSolver::fail_projection(double before, double target, bool attempted) {
  check_connected();
  ProjectionFailure failure;
  failure.target = target, failure.before = before;
  failure.iterations = statistics_.pressure_iterations;
  failure.skewed = skewed_;
  if (attempted) {
    apply_potential();
    negative_divergence(grid_->views(), kind_, flux_, negative_divergence_);
  }
  failure.divergence = grid_->comm().max(largest_magnitude(negative_divergence_));
  if (!boundaries_.has_outflow()) failure.net_inflow = grid_->comm().sum(sum_of(negative_divergence_));
  for (const auto& flux : flux_) failure.face_flux = larger(failure.face_flux, grid_->comm().max(largest_magnitude(flux)));
  failure.speed = grid_->comm().max(largest_speed(grid_->index(), kind_, u_));
  failure.earlier_speed = std::max(boundaries_.largest_speed(), grid_->comm().max(largest_speed(grid_->index(), kind_, u_old_)));
  throw ComputationError(explain(failure));
}

/// The fluxes less the gradient of the last solve's potential.
void FluidSolver::apply_potential() {
  grid_->halo().exchange(psi_field_);
  if (skewed_)
    correct_flux<true>(grid_->views(), g_.normal, mask_, psi_field_, flux_);
  else
    correct_flux<false>(grid_->views(), g_.normal, mask_, psi_field_, flux_);
}

void FluidSolver::project(const EmbeddedBodies* bodies) {
  const auto scope = timers_->scope("pressure");
  make_flux(bodies);
  const double spacing = grid_->mean_spacing();
  const double target = settings_.divergence_tolerance * statistics_.reference_speed * spacing * spacing;
  // The target is for the largest divergence, the solver's tolerance for the 2-norm, which grows with the cells.
  const IndexSpace& index = grid_->index();
  const double cells = static_cast<double>(index.global[0]) * index.global[1] * index.global[2];
  const double share = std::max(1.0, 0.1 * std::sqrt(cells));
  // A round starts from the divergence that the corrected fluxes have, so its round-off is not that of the potential,
  // which an impulsive start makes large.
  constexpr int rounds = 4;
  for (int round = 0;; ++round) {
    negative_divergence(grid_->views(), kind_, flux_, negative_divergence_);
    const double largest = grid_->comm().max(largest_magnitude(negative_divergence_));
    statistics_.divergence = largest + 0.0;  // no -0
    if (largest <= (round > 0 ? 1.5 * target : 0.0)) break;
    const auto result = round < rounds ? solve_pressure(round > 0 ? target : share * target) : KrylovResult{};
    statistics_.pressure_iterations += result.iterations;
    if (!result.converged) fail_projection(largest, target, round < rounds);
    apply_potential();
    correct_velocity(grid_->views(), kind_, mask_, psi_field_, u_);
    with_viscosity([&](const auto& viscosity) {
      update_pressure(grid_->views(), kind_, mass_, mu_, viscosity, psi_field_, negative_divergence_, p_);
    });
  }
  complete_velocity(bodies);
}

/// @param residual  of the momentum equation with the present velocity and pressure, over the velocity
void FluidSolver::solve_and_project(const EmbeddedBodies* bodies, double residual) {
  solve_momentum(bodies, residual);
  statistics_.speed = grid_->comm().max(largest_speed(grid_->index(), kind_, u_));
  statistics_.reference_speed = larger(statistics_.reference_speed, statistics_.speed);
  project(bodies);
  ++statistics_.projections;
}

void FluidSolver::solve(double time, const EmbeddedBodies* bodies) {
  if (relative_viscosity_.data()) update_diagonal();  // with what it is now
  if (fluidity_.data()) smooth_viscosity(grid_->index(), relative_viscosity_, smooth_viscosity_);
  has_bodies_ = bodies != nullptr;
  visit_varying_viscosity([this](const VaryingViscosity& v) { mark_excess(v, kind_, grid_->index()); });
  update_momentum_cycle();
  assemble_history(time);
  complete_velocity(bodies);
  // The answer depends on the pressure it starts from: every solve of a step starts from the same.
  if (statistics_.solves > 0) Kokkos::deep_copy(Exec(), p_, p_old_);
  constexpr double senseless = 1e12;  // um/us; single precision overflows beyond
  const double residual = momentum_residual();
  if (!std::isfinite(residual) || residual_norm_ > senseless)
    throw ComputationError(fmt::format(
        "velocity: {} in the flow field. Likely cause: a diverging run, with convection most often a step too long, longer than the "
        "flow takes across a cell; reduce time.step_us, or set fluid.convection = \"implicit\"",
        std::isfinite(residual) ? "senselessly large numbers" : "not a number"));
  solve_and_project(bodies, residual);
  if (settings_.repeat_projection) repeat_projection(bodies);
  ++statistics_.solves;
  grid_->halo().exchange(p_);
  if (bodies) {
    apply_pressure_rows(bodies->pressure, bodies->rows, p_);
    grid_->halo().exchange(p_);
  }
}

std::vector<int> FluidSolver::multigrid_cells() const {
  std::vector<int> counts;
  for (const auto& level : hierarchy_->levels()) counts.push_back(level.views.index.owned());
  return counts;
}

}  // namespace corpuscle
