// Reading and writing surface meshes.
#pragma once

#include <string>

#include "membrane/mesh.hpp"

namespace corpuscle {

/// Read an OFF or STL file (ASCII or binary, told apart by content). Coordinates are taken as um. Vertices of an STL
/// file that coincide within 1e-6 of its size are merged.
/// @throws InputError  if the file cannot be read, is truncated, or is neither
TriangleMesh read_mesh(const std::string& path);

/// @throws InputError  if the file cannot be written
void write_off(const std::string& path, const TriangleMesh& mesh);

enum class StlFormat { ascii, binary };

/// Binary STL holds single precision. @throws InputError  if the file cannot be written
void write_stl(const std::string& path, const TriangleMesh& mesh, StlFormat format);

}  // namespace corpuscle
