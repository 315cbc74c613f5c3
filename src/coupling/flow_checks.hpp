// Whether the velocities that a case prescribes on its sides can be those of an incompressible fluid.
#pragma once

#include "grid/grid.hpp"

namespace corpuscle {

/// @throws InputError  if a moving wall moves through itself; or if nothing but prescribed velocities lets fluid in or out,
///                     and what comes in differs from what goes out at some time (naming the sides, the flux and the time)
void check_prescribed_flow(const Grid& grid, const std::vector<BoundarySettings>& boundaries);

}  // namespace corpuscle
