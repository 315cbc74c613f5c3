// Grids given as node coordinates in an HDF5 file.
#pragma once

#include "grid/generators.hpp"

#include <string>

namespace corpuscle {

/// Data set "nodes" [nk, nj, ni, 3], double, um.
/// @throws InputError  when the file is missing, is not HDF5, has another shape, or the build has no HDF5.
NodeSource read_node_file(const std::string& path);

/// How many cells such a file's grid has, without its nodes. Throws the same.
std::array<int, 3> cells_of_node_file(const std::string& path);

}  // namespace corpuscle
