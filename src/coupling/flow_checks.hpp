// Whether what a case prescribes on its sides can drive an incompressible fluid, and whether the steps see it.
#pragma once

#include "coupling/step_schedule.hpp"
#include "grid/grid.hpp"

namespace corpuscle {

/// @throws InputError  if a moving wall moves through itself; or if nothing but prescribed velocities lets fluid in or out,
///                     and what comes in differs from what goes out at some time (naming the sides, the flux and the time)
void check_prescribed_flow(const Grid& grid, const std::vector<BoundarySettings>& boundaries);

/// What walls that move past the opposite side strain the fluid between them by in a step, and with it the cells.
/// @param viscous  some membranes are: long steps follow these less well (a red cell of 5e-7 N s/m had 3 % too much area where a step
///                 strained it by 0.12, 1 % off by 0.084, 0.2 % by 0.03)
/// @returns the warning, of more than 0.5, or 0.1 of viscous ones, or ""
/// @throws InputError  beyond 2: a cell is torn before the next forces on it
std::string check_wall_strain(const Grid& grid, const std::vector<BoundarySettings>& boundaries, double step_us, bool viscous = false);

/// @param gradient  imposed, in any unit
/// @throws InputError  for one with a part across the shifts between the grid's periodic sides, which drives nothing
void check_pressure_gradient(const Grid& grid, const Triple& gradient);

/// Warns of ramps that end within the first step.
/// @throws InputError  for a table whose changes the steps pass over, naming the row
void check_courses(const std::vector<BoundarySettings>& boundaries, const StepSchedule& schedule);

}  // namespace corpuscle
