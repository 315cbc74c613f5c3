// Making the set of immersed surfaces from meshes, and meshes and names from it.
#pragma once

#include <string>
#include <vector>

#include "immersed/surface_views.hpp"
#include "membrane/mesh.hpp"

namespace corpuscle {

/// All arrays allocated and filled: positions as given, velocities zero, normals and areas up to date.
/// @param cells  how many of the first bodies are membranes, all of them this rank's own
/// @throws InputError  if a mesh is not a closed surface
SurfaceSet make_surface_set(const std::vector<TriangleMesh>& bodies, int cells = 0);

/// How the cells of a scene are called: first those of [[cells]], then those of each of the [[populations]].
struct CellNames {
  int listed = 0;
  std::vector<int> count;  // [population]

  /// "cells.3", "populations.0 cell 17"
  std::string of(int number) const;
};

/// As the case file addresses it: "cells.0", "populations.0 cell 17", "bodies.2".
std::string body_name(const SurfaceSet& surfaces, int body);

/// [triangle, 3] vertex numbers.
HostMirror<Table<int>> triangles_on_host(const SurfaceSet& set);

/// Positions of one body's vertices and its triangles, copied back to the host.
TriangleMesh body_mesh(const SurfaceSet& surfaces, int body);

}  // namespace corpuscle
