// What the start of a run and `check` say of cell types and of surfaces that come from files.
#pragma once

#include "input/case.hpp"

namespace corpuscle {

/// Shape, vertices, law and number of the cells of each type; of cells with all keys in place where there are any types.
void print_cell_types(const Case& scene);

/// Sizes, area, volume and axis of each, and what was put right or may not have been meant. Those of equal settings once.
/// @throws InputError  as read_cell_surface() and read_body_surface()
void print_surfaces(const Case& scene);

}  // namespace corpuscle
