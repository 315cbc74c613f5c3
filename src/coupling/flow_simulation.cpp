#include "coupling/flow_simulation.hpp"

#include "core/error.hpp"
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

}  // namespace

FlowSimulation::FlowSimulation(const Comm& comm, const Case& scene, Timers& timers) : scene_(scene), timers_(timers) {
  const auto scope = timers_.scope("set-up");
  total_steps_ = std::llround(scene.time.end_us / scene.time.step_us);
  if (std::abs(total_steps_ * scene.time.step_us - scene.time.end_us) > 1e-9 * scene.time.end_us)
    throw InputError(fmt::format("time.end_us = {} is not a whole number of steps of {} us (time.step_us); use {}",
                                 scene.time.end_us, scene.time.step_us, total_steps_ * scene.time.step_us));
  grid_ = std::make_unique<Grid>(comm, make_node_source(*scene.grid), periodic_directions(scene.boundaries));
  fluid_ = std::make_unique<FluidSolver>(*grid_, *scene.fluid, scene.boundaries, &*scene.grid, &timers_);
  if (scene.cells.empty() && scene.bodies.empty()) return;
  make_surfaces();
  immersed_ = std::make_unique<ImmersedFlow>(*fluid_, *surfaces_, timers_);
  if (rigid_bodies_) fluid_->raise_reference_speed(rigid_bodies_->largest_speed());
  check_start();
  if (!membranes_) return;
  estimate_stability();
  const int vertices = membranes_->vertices();
  x_start_ = Components<double>("corpuscle::coupling::x_start", vertices, 3);
  v_interface_ = Components<double>("corpuscle::coupling::v_interface", vertices, 3);
  v_answer_ = Components<double>("corpuscle::coupling::v_answer", vertices, 3);
  residual_ = Components<double>("corpuscle::coupling::residual", vertices, 3);
  previous_residual_ = Components<double>("corpuscle::coupling::previous_residual", vertices, 3);
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
  try {
    immersed_->update_geometry(starting_gap);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
}

/// A loosely coupled membrane is unstable where the fluid's reaction to its velocity, over one step, exceeds its inertia
/// twice: M / (A dt) + beta < Lambda / 2. The reaction Lambda is largest for the shortest wave that the tractions
/// resolve; with fits that are quadratic it is 4 mu / h. Measured by bisection on beta: 6.2 pg/um2/us for a spacing h
/// of 0.333 um (box), 8.7 for 0.25 um (tube), both 1.9 to 2.0 mu / h.
void FlowSimulation::estimate_stability() {
  const auto& coupling = *scene_.coupling;
  const double h = immersed_->smallest_spacing_at_surfaces(), mu = fluid_->viscosity();
  double mass_term = 1e300;
  const auto cells = membranes_->diagnostics();
  for (int c = 0; c < membranes_->cells(); ++c)
    mass_term = std::min(mass_term, scene_.cells[c].mass_pg / (cells[c].rest_area_um2 * scene_.time.step_us));
  const bool robin = coupling.scheme == CouplingSettings::Scheme::robin ||
                     (coupling.scheme == CouplingSettings::Scheme::aitken && coupling.robin_in_aitken);
  const double beta = coupling.robin_coefficient >= 0 ? coupling.robin_coefficient : mu * std::acos(-1.0) / h;
  stability_ = {mass_term, robin ? beta : 0.0, 2 * mu / h};
  if (coupling.scheme != CouplingSettings::Scheme::aitken && stability_.margin() < 1)
    throw InputError(fmt::format(
        "coupling: M / (A dt) + beta = {:.3g} + {:.3g} pg/um2/us is below 2 mu / h = {:.3g}, half the fluid's reaction to "
        "the shortest membrane wave the grid resolves, so this run would diverge. Use coupling.scheme = \"robin\" with "
        "its default coefficient, or a cell of at least {:.3g} pg (cells.0.mass_pg), or coupling.scheme = \"aitken\"",
        mass_term, stability_.beta, stability_.threshold,
        (stability_.threshold - stability_.beta) / mass_term * scene_.cells[0].mass_pg));
}

void FlowSimulation::step() {
  const double dt = scene_.time.step_us;
  statistics_ = {};
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
  // Multiples of the step, not a running sum: a restarted run must see the same times.
  time_ = static_cast<double>(steps_) * scene_.time.step_us;
}

void FlowSimulation::step_rigid(double dt) {
  if (rigid_bodies_->moving()) {
    rigid_bodies_->move_to(time_ + dt);
    immersed_->update_geometry(smallest_gap);
  }
  immersed_->solve(time_ + dt);
}

/// Nodes are classified once a step, where the surfaces are expected at its end.
void FlowSimulation::place_bodies(double dt) {
  copy_vertices(membranes_->vertices(), surfaces_->x, x_start_);
  predict_positions(*surfaces_, membranes_->vertices(), dt);
  if (rigid_bodies_) rigid_bodies_->move_to(time_ + dt);
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
}

/// Fixed point on the mean velocity of the interface over the step: fluid with that velocity, membrane with the
/// tractions, compare. With the Robin term a pass multiplies the error of a mode on which the fluid reacts with Lambda
/// by (beta - Lambda) / (M / (A dt) + beta), below one for every mode, so nothing is relaxed; without it the factor is
/// -Lambda A dt / M and Aitken's relaxation (Kuettler and Wall, Comput. Mech. 43, 2008) makes it converge.
void FlowSimulation::step_iterated(double dt) {
  const auto& coupling = *scene_.coupling;
  const int n = membranes_->vertices();
  place_bodies(dt);
  copy_vertices(n, x_start_, surfaces_->x);
  membranes_->save_state();
  copy_vertices(n, surfaces_->v, v_interface_);
  relaxation_ = stability_.beta > 0 ? 1.0 : std::clamp(relaxation_, 0.01, 0.5);
  double residual = 0;
  for (int k = 0; k < coupling.max_iterations; ++k) {
    copy_vertices(n, v_interface_, surfaces_->v);
    immersed_->solve(time_ + dt);
    const auto& traction = immersed_->tractions();
    const auto scope = timers_.scope("membrane");
    membranes_->restore_state();
    statistics_.substeps = membranes_->advance(dt, traction, stability_.beta, v_interface_);
    mean_velocity(n, surfaces_->x, x_start_, dt, v_answer_);
    const auto norms = interface_residual(n, v_answer_, v_interface_, previous_residual_, residual_);
    statistics_.coupling_iterations = k + 1;
    residual = norms.answer > 0 ? std::sqrt(norms.residual / norms.answer) : 0;
    statistics_.coupling_residual = residual;
    if (!std::isfinite(residual)) break;
    if (residual <= coupling.tolerance) return;
    if (stability_.beta == 0 && k > 0 && norms.change > 0)
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
  time_ = progress.time;
  steps_ = progress.steps;
  relaxation_ = progress.relaxation;
}

}  // namespace corpuscle
