#include "coupling/membrane_coupling.hpp"

#include "core/error.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "coupling/force_coupling.hpp"
#include "immersed/surface_motion.hpp"
#include "membrane/interface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

Components<double> vertex_vectors(const char* name, int vertices) {
  return Components<double>(std::string("corpuscle::coupling::") + name, vertices, 3);
}

bool uses_robin(const CouplingSettings& coupling) {
  return coupling.scheme == CouplingSettings::Scheme::robin ||
         (coupling.scheme == CouplingSettings::Scheme::iterated && coupling.robin_in_iterated);
}

}  // namespace

double negligible_speed(const Case& scene, double viscosity) {
  constexpr double share = 1e-4;
  double modulus = 0;
  for (const auto& population : scene.populations)
    modulus = std::max(modulus, scene.cell_types[population.type].cell.shear_modulus_uN_per_m * units::uN_per_m);
  for (const auto& cell : scene.cells) modulus = std::max(modulus, cell.shear_modulus_uN_per_m * units::uN_per_m);
  return share * modulus / viscosity;
}

MembraneCoupling::MembraneCoupling(const Case& scene, FluidSolver& fluid, Timers& timers)
    : SharpCoupling(scene, fluid, timers, std::make_unique<Membranes>(scene.cells, body_meshes(scene, fluid.grid()))),
      quiet_speed_(negligible_speed(scene, fluid.viscosity())) {
  fluid_.raise_reference_speed(quiet_speed_);
  const int vertices = membranes_->vertices();
  x_start_ = vertex_vectors("x_start", vertices);
  v_interface_ = vertex_vectors("v_interface", vertices);
  residual_ = vertex_vectors("residual", vertices);
  previous_residual_ = vertex_vectors("previous_residual", vertices);
}

void MembraneCoupling::check_start() {
  SharpCoupling::check_start();
  watch_outflow();
  constexpr double confined = 2.0;
  smallest_spacing_ = immersed_->smallest_spacing_at_surfaces();
  const auto cells = membranes_->diagnostics();
  for (int c = 0; c < membranes_->cells(); ++c) {
    const Triple extent = cells[c].extent_um();
    const double radius = 0.5 * std::max({extent[0], extent[1], extent[2]}), area = cells[c].rest_area_um2;
    least_mass_per_area_ = std::min(least_mass_per_area_, scene_.cells[c].mass_pg / area);
    added_mass_per_area_ =
        std::max(added_mass_per_area_, scene_.fluid->density_pg_per_um3 * confined * 8.0 / 3 * std::pow(radius, 3) / area);
  }
  try {
    load();
    immersed_->forget_tractions();
    membranes_->stable_step_us();
    membranes_->substeps(scene_.time.step_us, stability(scene_.time.step_us)->beta);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
}

const SurfaceStress& MembraneCoupling::load() {
  const auto& stress = immersed_->tractions();
  if (const int vertex = immersed_->unseen_vertex(); vertex < membranes_->vertices())
    throw ComputationError(
        fmt::format("film between bodies: {} and its neighbours have another body so near that the grid has no fluid node between "
                    "them: its pressure is not known. Refine the grid (grid.nodes), move them apart (center_um, axis), or use "
                    "coupling.scheme = \"force\", with fluid everywhere",
                    immersed_->vertex_text(vertex)));
  return stress;
}

/// A cell may start nearer to an outflow than it may come to it later: it then stops half way.
void MembraneCoupling::watch_outflow() {
  outflow_limit_ = scene_.time.stop_before_outflow_um;
  if (!(immersed_->outflow_um() < outflow_limit_)) return;
  outflow_limit_ = 0.5 * immersed_->outflow_um();
  warn(
      "{}, where the end of the grid disturbs the flow: the run ends when {:.2g} um are left; move the cell (center_um) or "
      "lengthen the grid",
      nearest_outflow(), outflow_limit_);
}

/// How far the fluid gets in two steps at the fastest that it has been: a cell that is nearer may leave the grid before it is
/// looked at again. A reference speed that is only the one told from rest says nothing of it.
double MembraneCoupling::two_steps_um(double dt) const {
  const auto& fluid = fluid_.statistics();
  return 2 * dt * (fluid.reference_speed > quiet_speed_ ? fluid.reference_speed : fluid.speed);
}

bool MembraneCoupling::at_outflow(double dt) const { return immersed_->outflow_um() < std::max(outflow_limit_, two_steps_um(dt)); }

std::string MembraneCoupling::outflow_limit(double dt) const {
  const double two_steps = two_steps_um(dt);
  if (two_steps > outflow_limit_) return fmt::format("{:.3g} um, as far as the flow gets in two steps (time.step_us)", two_steps);
  return fmt::format("{:.3g} um (time.stop_before_outflow_um)", outflow_limit_);
}

std::string MembraneCoupling::nearest_outflow() const {
  const auto near = immersed_->nearest_outflow();
  return near ? fmt::format("{} is {:.3g} um from an outflow", near->vertex, near->distance_um) : "";
}

/// A loosely coupled membrane is unstable where the fluid's reaction to its velocity, over one step, exceeds its inertia
/// twice: M / (A dt) + beta < Lambda / 2. The reaction Lambda is viscous or inertial. Viscous, it is largest for the
/// shortest wave that the tractions resolve: 4 mu / h with fits that are quadratic; measured by bisection on beta, 6.2
/// pg/um2/us for a spacing h of 0.333 um (box) and 8.7 for 0.25 um (tube), both 1.9 to 2.0 mu / h. Inertial, it is 3/2
/// rho c / dt with c the added mass over the cell's area: for a disk that moves along its axis 8/3 R^3 / A (Lamb,
/// Hydrodynamics, section 102) in free fluid; measured in a tube of 10 um, by bisection on the mass at dt = 0.1 us, on the
/// step and on the viscosity: twice that.
std::optional<StabilityEstimate> MembraneCoupling::stability(double dt) const {
  const auto& coupling = *scene_.coupling;
  const double viscous = 2 * fluid_.viscosity() / smallest_spacing_, inertial = 0.75 * added_mass_per_area_ / dt;
  const double beta = coupling.robin_coefficient >= 0 ? coupling.robin_coefficient : default_beta(dt);
  return StabilityEstimate{least_mass_per_area_ / dt, uses_robin(coupling) ? beta : 0.0, viscous, inertial};
}

double MembraneCoupling::default_beta(double dt) const {
  constexpr double room = 2.0;
  return std::max(fluid_.viscosity() * std::acos(-1.0) / smallest_spacing_, room * 0.75 * added_mass_per_area_ / dt);
}

/// The membrane follows the fluid's velocity of the step before the more closely, the larger the coefficient is against the
/// fluid's reaction: in a tube of 10 um with steps of 2 us, a cell has after 20 us 0.98 of its speed with 1.3 times the
/// default, 0.86 with 4 times and 0.42 with 13 times.
void MembraneCoupling::check_beta(double dt) const {
  constexpr double most = 2;
  const double given = scene_.coupling->robin_coefficient, usual = default_beta(dt);
  if (scene_.coupling->scheme != CouplingSettings::Scheme::robin || !(given > most * usual)) return;
  warn(
      "coupling.robin_coefficient_pg_per_um2_per_us = {:.3g} is {:.3g} times its default here, {:.3g}: the membrane follows the flow "
      "that much more slowly; leave it out, or use {:.3g} at most",
      given, given / usual, usual, most * usual);
}

std::map<std::string, double> MembraneCoupling::report(double dt) const {
  const StabilityEstimate s = *stability(dt);
  return {{"mass_term_pg_per_um2_per_us", s.mass_term},
          {"beta_pg_per_um2_per_us", s.beta},
          {"threshold_pg_per_um2_per_us", s.threshold()},
          {"margin", s.margin()}};
}

/// Nodes are classified once a step, where the surfaces are expected at its end.
void MembraneCoupling::place_bodies(double time, double dt) {
  beta_ = stability(dt)->beta;
  immersed_->boundary().wrap(0, surfaces_->cells, false);
  copy_vertices(membranes_->vertices(), surfaces_->x, x_start_);
  predict_positions(*surfaces_, membranes_->vertices(), dt);
  move_rigid_bodies(time + dt);
  immersed_->update_geometry(smallest_gap);
}

StaggeredCoupling::StaggeredCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers)
    : MembraneCoupling(scene, fluid, timers), lengths_us_(schedule.lengths_us()) {}

void StaggeredCoupling::check_start() {
  MembraneCoupling::check_start();
  check_beta(lengths_us_.back());
  for (double dt : lengths_us_) require_stability(*stability(dt));
}

void StaggeredCoupling::require_stability(const StabilityEstimate& s) const {
  if (s.margin() >= 1) return;
  throw InputError(fmt::format(
      "coupling: M / (A dt) + beta = {:.3g} + {:.3g} pg/um2/us is below {:.3g}, half the fluid's reaction (the larger of "
      "2 mu / h = {:.3g}, to the shortest membrane wave the grid resolves, and 3/4 of the fluid carried along over the "
      "step, {:.3g}), so this run would diverge. Use coupling.scheme = \"robin\" with its default coefficient, or a "
      "cell of at least {:.3g} pg (cells.0.mass_pg), or coupling.scheme = \"iterated\"",
      s.mass_term, s.beta, s.threshold(), s.viscous, s.inertial, (s.threshold() - s.beta) / s.mass_term * scene_.cells[0].mass_pg));
}

/// An unstable staggered coupling swings to and fro: the velocity after a step has little to do with that before it, and
/// grows. Ten such steps in a row are no start from rest.
void StaggeredCoupling::watch_growth(double change, double speed_square) {
  constexpr int most = 10;
  constexpr double unrelated = 0.9;
  const bool at_rest = speed_square < membranes_->vertices() * quiet_speed_ * quiet_speed_;
  if (!(change > unrelated) || at_rest) {
    swings_ = 0;
    return;
  }
  if (swings_ == 0) swing_start_ = speed_square;
  if (++swings_ < most || !(speed_square > 4 * swing_start_)) return;
  throw ComputationError(
      fmt::format("coupling: the velocity of the membrane has swung to and fro for {} steps and grown {:.2g}-fold. Likely cause: the "
                  "fluid's reaction exceeds what the coupling anticipates; raise coupling.robin_coefficient_pg_per_um2_per_us (it is "
                  "{:.3g}) or cells.0.mass_pg, or use coupling.scheme = \"iterated\"",
                  swings_, std::sqrt(speed_square / swing_start_), beta_));
}

StepStatistics StaggeredCoupling::advance(double time, double dt) {
  const int n = membranes_->vertices();
  place_bodies(time, dt);
  copy_vertices(n, surfaces_->v, v_interface_);
  immersed_->solve(time + dt);
  const auto& stress = load();
  const auto scope = timers_.scope("membrane");
  copy_vertices(n, x_start_, surfaces_->x);
  StepStatistics statistics;
  statistics.substeps = membranes_->advance(dt, stress, beta_, v_interface_);
  const auto norms = interface_residual(n, surfaces_->v, v_interface_, previous_residual_, residual_);
  statistics.coupling_iterations = 1;
  statistics.coupling_residual = std::sqrt(norms.residual / std::max(norms.answer, n * quiet_speed_ * quiet_speed_));
  watch_growth(statistics.coupling_residual, norms.answer);
  return statistics;
}

IteratedCoupling::IteratedCoupling(const Case& scene, FluidSolver& fluid, Timers& timers) : MembraneCoupling(scene, fluid, timers) {
  const int vertices = membranes_->vertices();
  x_predicted_ = vertex_vectors("x_predicted", vertices);
  v_answer_ = vertex_vectors("v_answer", vertices);
  constexpr int remembered = 10;
  using Acceleration = CouplingSettings::Acceleration;
  const bool robin_term = uses_robin(*scene.coupling) && scene.coupling->robin_coefficient != 0;
  if (scene.coupling->acceleration.value_or(robin_term ? Acceleration::anderson : Acceleration::aitken) == Acceleration::anderson)
    anderson_ = std::make_unique<AndersonAcceleration>(3 * vertices, remembered);
}

/// Fluid with the guess of the interface's velocity, membrane with the tractions, compare. With the Robin term a pass
/// multiplies the error of a mode on which the fluid reacts with Lambda by (beta - Lambda) / (M / (A dt) + beta), below one
/// for every mode but close to it for the rigid ones, which Anderson acceleration takes out in a few passes; without it the
/// factor is -Lambda A dt / M and Aitken's relaxation (Kuettler and Wall, Comput. Mech. 43, 2008) makes it converge.
StepStatistics IteratedCoupling::advance(double time, double dt) {
  const auto& coupling = *scene_.coupling;
  const int n = membranes_->vertices();
  place_bodies(time, dt);
  // Tractions are taken where nodes were classified, in every pass: which points a fit uses depends on the positions,
  // and would let the iteration end in a cycle.
  copy_vertices(n, surfaces_->x, x_predicted_);
  copy_vertices(n, x_start_, surfaces_->x);
  membranes_->save_state();
  copy_vertices(n, surfaces_->v, v_interface_);
  relaxation_ = std::clamp(relaxation_, 0.01, 0.5);
  if (anderson_) anderson_->start();
  StepStatistics statistics;
  double residual = 0;
  for (int k = 0; k < coupling.max_iterations; ++k) {
    copy_vertices(n, v_interface_, surfaces_->v);
    copy_vertices(n, x_predicted_, surfaces_->x);
    immersed_->solve(time + dt);
    const auto& stress = load();
    const auto scope = timers_.scope("membrane");
    membranes_->restore_state();
    statistics.substeps = membranes_->advance(dt, stress, beta_, v_interface_);
    mean_velocity(n, surfaces_->x, x_start_, dt, v_answer_);
    const auto norms = interface_residual(n, v_answer_, v_interface_, previous_residual_, residual_);
    statistics.coupling_iterations = k + 1;
    // The ranks' sums may differ by round-off; that they end in the same pass may not depend on it.
    residual = fluid_.grid().comm().max(std::sqrt(norms.residual / std::max(norms.answer, n * quiet_speed_ * quiet_speed_)));
    statistics.coupling_residual = residual;
    if (!std::isfinite(residual)) break;
    if (residual <= coupling.tolerance) return statistics;
    if (anderson_) {
      anderson_->advance(flat(v_interface_), flat(residual_));
      continue;
    }
    if (k > 0 && norms.change > 0) relaxation_ = std::clamp(-relaxation_ * norms.product / norms.change, 0.005, 1.5);
    relax_interface(n, relaxation_, residual_, v_interface_, previous_residual_);
  }
  throw ComputationError(
      fmt::format("coupling: the interface velocity still changes by {:.3g} of itself after {} iterations (wanted {:.3g}) at {:.6g} "
                  "us. Likely cause: a light membrane without the Robin term, or a step too long; use coupling.scheme = \"robin\" or "
                  "coupling.robin_in_iterated = true, reduce time.step_us, or raise coupling.max_iterations",
                  residual, coupling.max_iterations, coupling.tolerance, time + dt));
}

std::unique_ptr<Coupling> make_coupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers,
                                        const PackedCells* packed) {
  std::unique_ptr<Coupling> coupling;
  if (!scene.has_cells())
    coupling = std::make_unique<SharpCoupling>(scene, fluid, timers, nullptr);
  else if (scene.coupling->scheme == CouplingSettings::Scheme::force)
    coupling = std::make_unique<ForceCoupling>(scene, schedule, fluid, timers, packed);
  else if (scene.coupling->scheme == CouplingSettings::Scheme::iterated)
    coupling = std::make_unique<IteratedCoupling>(scene, fluid, timers);
  else
    coupling = std::make_unique<StaggeredCoupling>(scene, schedule, fluid, timers);
  coupling->check_start();
  return coupling;
}

}  // namespace corpuscle
