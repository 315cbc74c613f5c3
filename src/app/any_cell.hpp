// Properties of a scene's cells, of those that are packed as well.
#pragma once

#include <algorithm>

#include "input/case.hpp"

namespace corpuscle {

/// Whether any cell has it, placed or yet to be packed.
template <class Property>
bool any_cell(const Case& scene, const Property& has) {
  return std::any_of(scene.cells.begin(), scene.cells.end(), has) ||
         std::any_of(scene.populations.begin(), scene.populations.end(),
                     [&](const PopulationSettings& p) { return has(scene.cell_types[p.type].cell); });
}

}  // namespace corpuscle
