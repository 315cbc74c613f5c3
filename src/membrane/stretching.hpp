// A cell pulled by two opposite forces, quasi-statically (Mills et al. 2004), and its comparison with the experiment.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "membrane/membranes.hpp"

namespace corpuscle {

/// The cell at rest under one force.
struct StretchingStep {
  double force_pN = 0;
  double axial_um = 0;       // extent along x
  double transverse_um = 0;  // extent along y
  int iterations = 0;
  double residual = 0;  // largest residual vertex force over the mean applied vertex force (of the first step at 0)
  CellDiagnostics cell;
};

/// Of a cell about the centroid of its volume and its own axis; of one that is no disc, about z.
struct DiscShape {
  double diameter_um = 0;          // mean of the extents along two directions across the axis
  double thickness_center_um = 0;  // along the axis through the centroid
  double thickness_max_um = 0;     // along the axis through the middle of any triangle
};

struct StretchingResult {
  std::vector<StretchingStep> steps;  // settings.steps + 1 of them, the first without force
  DiscShape rest;                     // after the first
  int patch_vertices = 0;             // at each end
};

/// Pull the only cell of `membranes` with +-F along x, F = 0, F/steps, ..., F, on the `patch_fraction` of its vertices
/// with the largest and smallest x before anything moves; relax to rest at each force. The volume is held by its
/// modulus alone here. The velocities end at zero.
/// @param progress  called after each force
/// @throws InputError  if there is not exactly one cell, or a setting is out of range
/// @throws ComputationError  if a cell does not come to rest or a link is overstretched
StretchingResult stretch_cell(Membranes& membranes, const StretchingSettings& settings,
                              const std::function<void(const StretchingStep&)>& progress = {});

DiscShape disc_shape(const TriangleMesh& mesh);

struct ExperimentPoint {
  double force_pN, transverse_um, axial_um;
  double transverse_lo_um, transverse_hi_um, axial_lo_um, axial_hi_um;  // ends of the error bars
};

/// Read a table of measured diameters: lines beginning with # are left out, the first other line names the columns
/// (force_pN, transverse_um, axial_um, and each diameter's _lo_um and _hi_um before the unit), in any order.
/// @throws InputError  if the file is missing, a column is missing, or a value is not a number
std::vector<ExperimentPoint> read_experiment(const std::string& path);

struct ExperimentComparison {
  int points = 0;       // within the range of forces computed
  int inside_both = 0;  // where both diameters lie within the error bars
  double rms_axial_um = 0, rms_transverse_um = 0;
  double interpolation_um = 0;  // about the most by which the curve departs from the straight lines between computed forces
};

/// Differences at the experiment's forces, between which the computed curve is interpolated linearly.
ExperimentComparison compare(const StretchingResult& result, const std::vector<ExperimentPoint>& experiment);

}  // namespace corpuscle
