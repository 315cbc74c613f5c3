#include "coupling/flow_simulation.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "immersed/surface_motion.hpp"
#include "membrane/interface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

std::array<bool, 3> periodic_directions(const std::vector<BoundarySettings>& boundaries) {
  std::array<bool, 3> periodic{};
  for (const auto& b : boundaries)
    if (b.type == BoundarySettings::Type::periodic) periodic[static_cast<int>(b.side) / 2] = true;
  return periodic;
}

/// An iterated coupling cannot see changes below what the fluid's own solver leaves. A residual of 1e-8 of the velocity,
/// as 2-norms, left changes of 3e-4 in the interface's velocity on the tube: residuals are local, and the error is the
/// residual over the operator's lowest eigenvalue (0.03 there).
FluidSettings fluid_settings(const Case& scene) {
  FluidSettings settings = *scene.fluid;
  if (scene.coupling && !scene.cells.empty() && scene.coupling->scheme == CouplingSettings::Scheme::aitken)
    settings.momentum_tolerance = std::min(settings.momentum_tolerance, 1e-6 * scene.coupling->tolerance);
  return settings;
}

/// A speed that no cell tells from rest, um/us: shear modulus over viscosity is that with which a deformed cell returns to
/// its shape. Tolerances relative to the speed of a flow at rest would ask for less than round-off.
double negligible_speed(const Case& scene) {
  constexpr double share = 1e-4;
  double modulus = 0;
  for (const auto& cell : scene.cells) modulus = std::max(modulus, cell.shear_modulus_uN_per_m * units::uN_per_m);
  return share * modulus / (scene.fluid->density_pg_per_um3 * scene.fluid->kinematic_viscosity_um2_per_us);
}

}  // namespace

FlowSimulation::FlowSimulation(const Comm& comm, const Case& scene, Timers& timers)
    : scene_(scene), timers_(timers), schedule_(scene.time) {
  const auto scope = timers_.scope("set-up");
  grid_ = std::make_unique<Grid>(comm, make_node_source(*scene.grid), periodic_directions(scene.boundaries));
  fluid_ = std::make_unique<FluidSolver>(*grid_, fluid_settings(scene), scene.boundaries, &*scene.grid, &timers_);
  if (scene.cells.empty() && scene.bodies.empty()) return;
  make_surfaces();
  immersed_ = std::make_unique<ImmersedFlow>(*fluid_, *surfaces_, timers_);
  if (rigid_bodies_) fluid_->raise_reference_speed(rigid_bodies_->largest_speed());
  if (membranes_) fluid_->raise_reference_speed(quiet_speed_ = negligible_speed(scene));
  check_start();
  if (!membranes_) return;
  measure_stability();
  const int vertices = membranes_->vertices();
  x_start_ = Components<double>("corpuscle::coupling::x_start", vertices, 3);
  v_interface_ = Components<double>("corpuscle::coupling::v_interface", vertices, 3);
  v_answer_ = Components<double>("corpuscle::coupling::v_answer", vertices, 3);
  residual_ = Components<double>("corpuscle::coupling::residual", vertices, 3);
  previous_residual_ = Components<double>("corpuscle::coupling::previous_residual", vertices, 3);
  constexpr int remembered = 10;
  const bool iterated = scene.coupling->scheme == CouplingSettings::Scheme::aitken;
  if (iterated) x_predicted_ = Components<double>("corpuscle::coupling::x_predicted", vertices, 3);
  if (iterated && stability_.beta > 0)
    anderson_ = std::make_unique<AndersonAcceleration>(vertices, remembered);
}

void FlowSimulation::make_surfaces() {
  std::vector<TriangleMesh> meshes;
  for (const auto& body : scene_.bodies) meshes.push_back(make_body_mesh(body, grid_->mean_spacing()));
  if (!scene_.cells.empty()) {
    membranes_ = std::make_unique<Membranes>(scene_.cells, meshes);
    surfaces_ = std::make_unique<SurfaceSet>(membranes_->surfaces());
  } else {
    surfaces_ = std::make_unique<SurfaceSet>(make_surface_set(meshes));
  }
  if (!scene_.bodies.empty()) {
    rigid_bodies_ = std::make_unique<RigidBodies>(scene_.bodies, *surfaces_, static_cast<int>(scene_.cells.size()));
    rigid_bodies_->move_to(0);
  }
}

void FlowSimulation::check_start() {
  immersed_->boundary().wrap(0, surfaces_->bodies, true);
  try {
    immersed_->update_geometry(starting_gap);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
}

/// A loosely coupled membrane is unstable where the fluid's reaction to its velocity, over one step, exceeds its inertia
/// twice: M / (A dt) + beta < Lambda / 2. The reaction Lambda is viscous or inertial. Viscous, it is largest for the
/// shortest wave that the tractions resolve: 4 mu / h with fits that are quadratic; measured by bisection on beta, 6.2
/// pg/um2/us for a spacing h of 0.333 um (box) and 8.7 for 0.25 um (tube), both 1.9 to 2.0 mu / h. Inertial, it is 3/2
/// rho c / dt with c the added mass over the cell's area: for a disk that moves along its axis 8/3 R^3 / A (Lamb,
/// Hydrodynamics, section 102) in free fluid; measured in a tube of 10 um, by bisection on the mass at dt = 0.1 us, on the
/// step and on the viscosity: twice that.
StabilityEstimate FlowSimulation::stability_of(double dt) const {
  constexpr double room = 2.0;
  const auto& coupling = *scene_.coupling;
  const double viscous = 2 * fluid_->viscosity() / smallest_spacing_, inertial = 0.75 * added_mass_per_area_ / dt;
  const bool robin = coupling.scheme == CouplingSettings::Scheme::robin ||
                     (coupling.scheme == CouplingSettings::Scheme::aitken && coupling.robin_in_aitken);
  const double beta = coupling.robin_coefficient >= 0
                          ? coupling.robin_coefficient
                          : std::max(fluid_->viscosity() * std::acos(-1.0) / smallest_spacing_, room * inertial);
  return {least_mass_per_area_ / dt, robin ? beta : 0.0, viscous, inertial};
}

/// What stability_of() needs; refuses a coupling that cannot be stable with one of the schedule's steps.
void FlowSimulation::measure_stability() {
  constexpr double confined = 2.0;
  smallest_spacing_ = immersed_->smallest_spacing_at_surfaces();
  const auto cells = membranes_->diagnostics();
  for (int c = 0; c < membranes_->cells(); ++c) {
    const Triple extent = cells[c].extent_um();
    const double radius = 0.5 * std::max({extent[0], extent[1], extent[2]});
    least_mass_per_area_ = std::min(least_mass_per_area_, scene_.cells[c].mass_pg / cells[c].rest_area_um2);
    added_mass_per_area_ =
        std::max(added_mass_per_area_, scene_.fluid->density_pg_per_um3 * confined * 8.0 / 3 * std::pow(radius, 3) / cells[c].rest_area_um2);
  }
  stability_ = stability_of(next_step_us());
  if (scene_.coupling->scheme == CouplingSettings::Scheme::aitken) return;
  for (double dt : schedule_.lengths_us()) require_stability(stability_of(dt));
}

void FlowSimulation::require_stability(const StabilityEstimate& s) const {
  if (s.margin() >= 1) return;
  throw InputError(fmt::format(
      "coupling: M / (A dt) + beta = {:.3g} + {:.3g} pg/um2/us is below {:.3g}, half the fluid's reaction (the larger of "
      "2 mu / h = {:.3g}, to the shortest membrane wave the grid resolves, and 3/4 of the fluid carried along over the "
      "step, {:.3g}), so this run would diverge. Use coupling.scheme = \"robin\" with its default coefficient, or a "
      "cell of at least {:.3g} pg (cells.0.mass_pg), or coupling.scheme = \"aitken\"",
      s.mass_term, s.beta, s.threshold(), s.viscous, s.inertial,
      (s.threshold() - s.beta) / s.mass_term * scene_.cells[0].mass_pg));
}

/// An unstable staggered coupling swings to and fro: the velocity after a step has little to do with that before it, and
/// grows. Ten such steps in a row are no start from rest.
void FlowSimulation::watch_growth(double change, double speed_square) {
  constexpr int most = 10;
  constexpr double unrelated = 0.9;
  const bool at_rest = speed_square < membranes_->vertices() * quiet_speed_ * quiet_speed_;
  if (!(change > unrelated) || at_rest) {
    swings_ = 0;
    return;
  }
  if (swings_ == 0) swing_start_ = speed_square;
  if (++swings_ < most || !(speed_square > 4 * swing_start_)) return;
  throw ComputationError(fmt::format(
      "coupling: the velocity of the membrane has swung to and fro for {} steps and grown {:.2g}-fold. Likely cause: the "
      "fluid's reaction exceeds what the coupling anticipates; raise coupling.robin_coefficient_pg_per_um2_per_us (it is "
      "{:.3g}) or cells.0.mass_pg, or use coupling.scheme = \"aitken\"",
      swings_, std::sqrt(speed_square / swing_start_), stability_.beta));
}

void FlowSimulation::step() {
  const double dt = next_step_us();
  statistics_ = {};
  if (membranes_) stability_ = stability_of(dt);
  fluid_->begin_step(dt);
  if (!immersed_) {
    fluid_->solve(time_ + dt, nullptr);
  } else if (!membranes_) {
    step_rigid(dt);
  } else if (scene_.coupling->scheme == CouplingSettings::Scheme::aitken) {
    step_iterated(dt);
  } else {
    step_staggered(dt);
  }
  ++steps_;
  tick_ += schedule_.ticks(tick_);
  time_ = schedule_.time_us(tick_);
  last_step_ = dt;
}

void FlowSimulation::move_rigid_bodies(double time) {
  rigid_bodies_->move_to(time);
  immersed_->boundary().wrap(surfaces_->cells, surfaces_->bodies, true);
}

void FlowSimulation::step_rigid(double dt) {
  if (rigid_bodies_->moving()) {
    move_rigid_bodies(time_ + dt);
    immersed_->update_geometry(smallest_gap);
  }
  immersed_->solve(time_ + dt);
}

/// Nodes are classified once a step, where the surfaces are expected at its end.
void FlowSimulation::place_bodies(double dt) {
  immersed_->boundary().wrap(0, surfaces_->cells, false);
  copy_vertices(membranes_->vertices(), surfaces_->x, x_start_);
  predict_positions(*surfaces_, membranes_->vertices(), dt);
  if (rigid_bodies_) move_rigid_bodies(time_ + dt);
  immersed_->update_geometry(smallest_gap);
}

/// One fluid solve with the membrane's velocity on its surface, one membrane step with the tractions, which with
/// beta > 0 anticipates the fluid's reaction to the change of velocity.
void FlowSimulation::step_staggered(double dt) {
  const int n = membranes_->vertices();
  place_bodies(dt);
  copy_vertices(n, surfaces_->v, v_interface_);
  immersed_->solve(time_ + dt);
  const auto& traction = immersed_->tractions();
  const auto scope = timers_.scope("membrane");
  copy_vertices(n, x_start_, surfaces_->x);
  statistics_.substeps = membranes_->advance(dt, traction, stability_.beta, v_interface_);
  const auto norms = interface_residual(n, surfaces_->v, v_interface_, previous_residual_, residual_);
  statistics_.coupling_iterations = 1;
  statistics_.coupling_residual = norms.answer > 0 ? std::sqrt(norms.residual / norms.answer) : 0;
  watch_growth(statistics_.coupling_residual, norms.answer);
}

/// Fixed point on the mean velocity of the interface over the step: fluid with that velocity, membrane with the
/// tractions, compare. With the Robin term a pass multiplies the error of a mode on which the fluid reacts with Lambda
/// by (beta - Lambda) / (M / (A dt) + beta), below one for every mode but close to it for the rigid ones, which Anderson
/// acceleration takes out in a few passes; without it the factor is -Lambda A dt / M and Aitken's relaxation (Kuettler
/// and Wall, Comput. Mech. 43, 2008) makes it converge.
void FlowSimulation::step_iterated(double dt) {
  const auto& coupling = *scene_.coupling;
  const int n = membranes_->vertices();
  place_bodies(dt);
  // Tractions are taken where nodes were classified, in every pass: which points a fit uses depends on the positions,
  // and would let the iteration end in a cycle.
  copy_vertices(n, surfaces_->x, x_predicted_);
  copy_vertices(n, x_start_, surfaces_->x);
  membranes_->save_state();
  copy_vertices(n, surfaces_->v, v_interface_);
  relaxation_ = std::clamp(relaxation_, 0.01, 0.5);
  if (anderson_) anderson_->start();
  double residual = 0;
  for (int k = 0; k < coupling.max_iterations; ++k) {
    copy_vertices(n, v_interface_, surfaces_->v);
    copy_vertices(n, x_predicted_, surfaces_->x);
    immersed_->solve(time_ + dt);
    const auto& traction = immersed_->tractions();
    const auto scope = timers_.scope("membrane");
    membranes_->restore_state();
    statistics_.substeps = membranes_->advance(dt, traction, stability_.beta, v_interface_);
    mean_velocity(n, surfaces_->x, x_start_, dt, v_answer_);
    const auto norms = interface_residual(n, v_answer_, v_interface_, previous_residual_, residual_);
    statistics_.coupling_iterations = k + 1;
    residual = std::sqrt(norms.residual / std::max(norms.answer, n * quiet_speed_ * quiet_speed_));
    statistics_.coupling_residual = residual;
    if (!std::isfinite(residual)) break;
    if (residual <= coupling.tolerance) return;
    if (anderson_) {
      anderson_->advance(v_interface_, residual_);
      continue;
    }
    if (k > 0 && norms.change > 0)
      relaxation_ = std::clamp(-relaxation_ * norms.product / norms.change, 0.005, 1.5);
    relax_interface(n, relaxation_, residual_, v_interface_, previous_residual_);
  }
  throw ComputationError(fmt::format(
      "coupling: the interface velocity still changes by {:.3g} of itself after {} iterations (wanted {:.3g}) at {:.6g} "
      "us. Likely cause: a light membrane without the Robin term, or a step too long; use coupling.scheme = \"robin\" or "
      "coupling.robin_in_aitken = true, reduce time.step_us, or raise coupling.max_iterations",
      residual, coupling.max_iterations, coupling.tolerance, time_ + dt));
}

void FlowSimulation::resume(const Progress& progress) {
  tick_ = schedule_.tick_at(progress.time);
  if (tick_ < 0)
    throw InputError(fmt::format("no step of this case begins at {} us, where the checkpoint is: use another time.step_us or "
                                 "time.first_step_us", progress.time));
  constexpr double most = 2;  // beyond 1 + sqrt(2), errors of second-order backward differences grow (Hairer et al., III.5)
  if (next_step_us() > most * progress.last_step * (1 + 1e-9))
    throw InputError(fmt::format("the step can at most double at a restart: the checkpoint was written with steps of {} us, and "
                                 "this case goes on with {} us; reduce time.step_us", progress.last_step, next_step_us()));
  time_ = schedule_.time_us(tick_);
  last_step_ = progress.last_step;
  steps_ = progress.steps;
  relaxation_ = progress.relaxation;
}

}  // namespace corpuscle
