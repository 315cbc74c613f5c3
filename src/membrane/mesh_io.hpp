// Reading and writing surface meshes.
#pragma once

#include <string>

#include "membrane/mesh.hpp"

namespace corpuscle {

/// What a surface file holds. Nothing is known of the surface yet: it may be open, or more than one.
struct MeshFile {
  TriangleMesh mesh;               // in the file's own unit
  std::vector<int> part;           // [triangle] the solid of an STL file that it belongs to; empty for OFF
  std::vector<std::string> parts;  // names of the solids, as messages put them
  std::vector<std::string> notes;  // what was left out or put right, for the user
};

/// Read an OFF or STL file (ASCII or binary, told apart by content). Vertices that coincide within 1e-6 of the size of
/// the surface become one where triangles do not share their corners: in STL files, and OFF files that are open as they
/// stand. Triangles that this leaves without area, and vertices that no triangle uses, are left out.
/// @throws InputError  if the file cannot be read, is damaged (naming line or byte), or is neither
MeshFile read_mesh(const std::string& path);

/// @throws InputError  if the file cannot be written
void write_off(const std::string& path, const TriangleMesh& mesh);

enum class StlFormat { ascii, binary };

/// Binary STL holds single precision. @throws InputError  if the file cannot be written
void write_stl(const std::string& path, const TriangleMesh& mesh, StlFormat format);

}  // namespace corpuscle
