// One reader for each format of surface files. All throw InputError naming the file, and the line or byte, that is wrong.
#pragma once

#include <cstdint>

#include "membrane/mesh_io.hpp"

namespace corpuscle {

inline constexpr std::size_t stl_header = 84, stl_record = 50;  // bytes of a binary STL file

MeshFile read_off(const std::string& path, const std::string& content);

/// Corners unshared.
MeshFile read_ascii_stl(const std::string& path, const std::string& content);

/// The number of triangles that a binary STL file of this content would have; 0 if it is too short for one.
std::uint32_t claimed_triangles(const std::string& content);

/// Corners unshared.
MeshFile read_binary_stl(const std::string& path, const std::string& content);

}  // namespace corpuscle
