// How uniform a mesh is.
#pragma once

#include "membrane/mesh.hpp"

namespace corpuscle {

struct MeshQuality {
  double edge_mean = 0;               // um
  double edge_spread = 0;             // standard deviation over mean
  double edge_min = 0, edge_max = 0;  // over the mean
  double smallest_angle_deg = 0;
  int valence_min = 0, valence_max = 0;
};

/// The mesh must be closed.
MeshQuality mesh_quality(const TriangleMesh& mesh);

}  // namespace corpuscle
