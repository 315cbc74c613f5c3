// Capsules beside balls that are held, for the tests of rigid bodies among membranes that are forces.
#pragma once

#include "scenes.hpp"

namespace corpuscle::scenes {

inline CellSettings capsule(double radius, const Triple& centre, double modulus = 5) {
  CellSettings cell;
  cell.shape = CellSettings::Shape::sphere;
  cell.radius_um = radius;
  cell.vertices = 162;
  cell.law = CellSettings::Law::neo_hookean;
  cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
  cell.shear_modulus_uN_per_m = modulus;
  cell.center_um = centre;
  return cell;
}

inline BodySettings ball(double radius, const Triple& centre) {
  BodySettings body;
  body.radius_um = radius;
  body.center_um = centre;
  return body;
}

/// A ball in the middle of a box that is periodic all round, a gradient along x past it, and a capsule beside it; spacing 0.75 um.
inline Case past_a_ball(double end_us) {
  Case scene;
  scene.time = {10, end_us};
  scene.grid = cube(12, 16);
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-11;
  scene.fluid->pressure_gradient_Pa_per_um = {-0.2, 0, 0};
  scene.boundaries = sides(BoundarySettings::Type::periodic);
  scene.bodies = {ball(2.5, {0.11, -0.07, 0.05})};
  scene.cells = {capsule(1.5, {-0.4, 4.6, 0.3})};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  scene.contact = ContactSettings{};
  return scene;
}

/// The same with the capsule ahead of the ball, pushed onto it.
inline Case pushed_onto_a_ball(double push_nN, double end_us) {
  Case scene = past_a_ball(end_us);
  scene.time.step_us = 20;
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, 0};
  scene.cells = {capsule(1.5, {-4, -0.07, 0.05})};
  scene.cells[0].push_nN = {push_nN, 0, 0};
  return scene;
}

/// Balls that move through a box that is periodic all round, one past a capsule and through a side; one presses a capsule against a ball
/// that is held beyond a side.
inline Case balls_among_capsules(double end_us) {
  Case scene = past_a_ball(end_us);
  scene.time.step_us = 20;
  scene.bodies = {ball(1.9, {-3.4, 0.2, -3.1}), ball(1.9, {3.2, -0.3, 2.9}), ball(1.9, {3.0, -5.6, 3.1})};
  scene.bodies[0].velocity_um_per_us = {-2e-3, 0, 0};
  scene.bodies[1].velocity_um_per_us = {0, 1.5e-3, 0.2e-3};
  scene.bodies[1].angular_velocity_rad_per_us = {0, 0, 5e-4};
  scene.cells = {capsule(1.2, {-0.2, -3.2, 0.3}, 4), capsule(1.2, {3.2, 3.1, 3.0}, 4), capsule(1.2, {-4.9, 3.4, -3.0}, 4)};
  return scene;
}

}  // namespace corpuscle::scenes
