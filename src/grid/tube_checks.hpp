// Whether a tube swept along a centreline keeps clear of itself.
#pragma once

#include "grid/generators.hpp"

namespace corpuscle {

/// @throws InputError  for a bend too tight for the tube, or a tube that runs through itself, naming the place
void check_tube(const Centerline& line, double diameter_um);

}  // namespace corpuscle
