// Host copies of boxes of cells, as files hold them, and the way back. For output and restart, not for a time step.
#pragma once

#include "grid/box_values.hpp"

#include <cstdint>
#include <vector>

namespace corpuscle {

/// [box position] values of a scalar field.
std::vector<double> box_values(const IndexSpace& index, const CellBox& box, const Array<double>& field);
/// [box position, 3] values of a vector field.
std::vector<double> interleaved(const IndexSpace& index, const CellBox& box, const Components<double>& field);
std::vector<std::int64_t> box_integers(const IndexSpace& index, const CellBox& box, const Array<NodeKind>& kind);

void set_box_values(const IndexSpace& index, const CellBox& box, const std::vector<double>& values, const Array<double>& field);
void set_interleaved(const IndexSpace& index, const CellBox& box, const std::vector<double>& values, const Components<double>& field);

/// [vertex, 3] values of the first `count` vertices.
std::vector<double> vertex_values(int count, const Components<double>& field);

}  // namespace corpuscle
