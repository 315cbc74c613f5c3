// Allocation and filling of the membranes' device arrays.
#pragma once

#include <memory>
#include <vector>

#include "membrane/membrane_views.hpp"
#include "membrane/motion.hpp"
#include "membrane/reference.hpp"
#include "membrane/stiffness.hpp"

namespace corpuscle {

/// @param surface       its first bodies are the cells
/// @param type_of_cell  [cell] index into types
MembraneViews make_membrane_views(const SurfaceSet& surface, const std::vector<CellReference>& types, const std::vector<int>& type_of_cell);

/// The rest states of all types as if their cells were `size` times as large.
void fill_reference(MembraneViews& m, const std::vector<CellReference>& types, double size = 1);

/// The kernels of the cells' in-plane laws: one set for a scene of one law, further ones for each further law.
/// @param type_of_cell  [cell] index into types
std::unique_ptr<Elasticity> make_elasticity(const std::vector<CellReference>& types, const std::vector<int>& type_of_cell);

MotionViews make_motion_views(const MembraneViews& membranes);

StiffnessViews make_stiffness_views(const MembraneViews& membranes);

}  // namespace corpuscle
