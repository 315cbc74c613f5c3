// The periodic directions of a grid, for bodies that leave at one end.
#pragma once

#include "grid/grid.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

PeriodicFrame periodic_frame(const Grid& grid);

}  // namespace corpuscle
