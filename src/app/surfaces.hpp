// What the start of a run and `check` say of surfaces that come from files.
#pragma once

#include "input/case.hpp"

namespace corpuscle {

/// Sizes, area, volume and axis of each, and what was put right or may not have been meant. Those of equal settings once.
/// @throws InputError  as read_cell_surface() and read_body_surface()
void print_surfaces(const Case& scene);

}  // namespace corpuscle
