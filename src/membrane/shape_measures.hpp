// Measures of a cell's shape along a direction: how the parachute is told from the disk.
#pragma once

#include "membrane/mesh.hpp"

namespace corpuscle {

struct ParachuteMeasures {
  double rear_hollow_um = 0;   // how far the rear face on the axis lies ahead of the rearmost point of the cell
  double front_dimple_um = 0;  // how far the front face on the axis lies behind the foremost point; 0 for a dome
  double length_um = 0;        // extent along the axis
  double diameter_um = 0;      // mean extent across the axis, over angles
  double asymmetry = 0;        // (largest - smallest extent across the axis, over angles) / mean extent
};

/// Measures with respect to the axis through `centroid` along `forward` (need not be normalised).
ParachuteMeasures parachute_measures(const TriangleMesh& mesh, const Triple& centroid, const Triple& forward);

}  // namespace corpuscle
