// What a flow amounts to as a whole: means, energy, momentum, and the size of what was left out. For output; copies to the
// host.
#pragma once

#include "fluid/fluid_solver.hpp"

namespace corpuscle {

/// The flow's energy at one time. Powers are those of the fluid outside bodies.
struct FluidEnergy {
  double boundaries_nW = 0;   // in through the sides of the grid: pressure, viscous stress, carried kinetic energy
  double gradient_nW = 0;     // of the imposed pressure gradient, over the whole volume
  double dissipation_nW = 0;  // mu times the integral of |grad u|^2
  double kinetic_fJ = 0;
  double inflow_um3_per_us = 0;  // through all sides
};

/// @param body_volume  um3, of all bodies: what is left of the cells that their surfaces cut
FluidEnergy flow_energy(FluidSolver& fluid, double body_volume);

/// rms of the convective term over the rms of the viscous term in the present solution: what leaving it out neglects.
double convection_over_viscosity(FluidSolver& fluid);

/// Mean velocity over the whole volume (superficial, bodies count as present), um/us.
Triple mean_velocity(FluidSolver& fluid);

/// Force on each body from the momentum balance over the faces around it: pressure and viscous stress, nN.
std::vector<Triple> body_forces(FluidSolver& fluid, const EmbeddedBodies& bodies);

}  // namespace corpuscle
