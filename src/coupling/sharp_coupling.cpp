#include "coupling/sharp_coupling.hpp"

#include "core/error.hpp"
#include "coupling/surface_checks.hpp"

#include <fmt/format.h>

namespace corpuscle {

std::vector<TriangleMesh> body_meshes(const Case& scene, const Grid& grid) {
  std::vector<TriangleMesh> meshes;
  for (const auto& body : scene.bodies) meshes.push_back(make_body_mesh(body, grid.mean_spacing()));
  return meshes;
}

SharpCoupling::SharpCoupling(const Case& scene, FluidSolver& fluid, Timers& timers, std::unique_ptr<Membranes> membranes)
    : scene_(scene), fluid_(fluid), timers_(timers), membranes_(std::move(membranes)) {
  surfaces_ = std::make_unique<SurfaceSet>(membranes_ ? membranes_->surfaces() : make_surface_set(body_meshes(scene, fluid.grid())));
  if (!scene.bodies.empty()) {
    rigid_bodies_ = std::make_unique<RigidBodies>(scene.bodies, *surfaces_, static_cast<int>(scene.cells.size()));
    rigid_bodies_->move_to(0);
    fluid_.raise_reference_speed(rigid_bodies_->largest_speed());
  }
  Leaving leaving;
  leaving.vertices = membranes_ ? membranes_->vertices() : 0;
  for (const auto& boundary : scene.boundaries)
    leaving.sides[static_cast<int>(boundary.side)] = boundary.type == BoundarySettings::Type::outflow;
  immersed_ = std::make_unique<ImmersedFlow>(fluid_, *surfaces_, leaving, timers_);
}

void SharpCoupling::check_start() {
  immersed_->boundary().wrap(0, surfaces_->bodies, true);
  coarse_ = warn_of_coarse(check_surfaces(fluid_.grid(), scene_, *surfaces_));
  try {
    immersed_->update_geometry(starting_gap);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
  if (rigid_bodies_) check_body_steps();
}

/// @throws InputError  for bodies that would pass fluid nodes without their noticing
void SharpCoupling::check_body_steps() {
  const double dt = scene_.time.step_us, way = dt * rigid_bodies_->largest_speed(), spacing = immersed_->smallest_spacing_at_surfaces();
  if (!(way > spacing)) return;
  throw InputError(fmt::format(
      "bodies: one moves by {:.3g} um in a step, {:.3g} times the spacing of the grid's nodes there, {:.3g} um (its Courant number), "
      "and 1 is the most that the flow can follow: reduce time.step_us to {:.3g} us, or bodies.velocity_mm_per_s or "
      "bodies.angular_velocity_rad_per_s",
      way, way / spacing, spacing, dt * spacing / way));
}

void SharpCoupling::move_rigid_bodies(double time) {
  if (!rigid_bodies_) return;
  rigid_bodies_->move_to(time);
  immersed_->boundary().wrap(surfaces_->cells, surfaces_->bodies, true);
}

void SharpCoupling::move_bodies(double time) {
  if (!rigid_bodies_->moving()) return;
  move_rigid_bodies(time);
  immersed_->update_geometry(smallest_gap);
}

void SharpCoupling::solve_flow(double time) {
  immersed_->solve(time);
  has_flow_ = true;
}

StepStatistics SharpCoupling::advance(double time, double dt) {
  move_bodies(time + dt);
  solve_flow(time + dt);
  return {};
}

void SharpCoupling::resume(double time) {
  move_rigid_bodies(time);
  has_flow_ = true;
}

const Components<double>& SharpCoupling::tractions_for_output() {
  if (!membranes_ && has_flow_) immersed_->tractions();
  return immersed_->last_tractions();
}

}  // namespace corpuscle
