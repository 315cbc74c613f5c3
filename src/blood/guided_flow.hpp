// What a scene's flow is: along a tube, between two walls, or through a periodic box, and what plasma alone does there.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "blood/flow_frame.hpp"
#include "blood/wall_stress.hpp"
#include "fluid/fluid_solver.hpp"
#include "input/case.hpp"

namespace corpuscle {

struct GuidedFlow {
  FlowFrame frame;
  bool driven = false;       // by a pressure gradient or an inlet along the frame's tangent
  bool sheared = false;      // by walls that move past each other along it, and by nothing else
  double gradient = 0;       // kPa/um, imposed along the tangent, where plasma alone would flow steadily; 0: not so
  int across = -1;           // between walls: direction of the grid from one to the other
  int duct = -1;             // between four walls: direction of the grid along them
  int wall[2] = {-1, -1};    // sheared: entries of the two walls in the case
  std::string no_viscosity;  // why there is no relative viscosity
};

/// Nothing where there is no direction of flow: in a box without walls or gradient, on grids from files.
std::optional<GuidedFlow> find_guided_flow(const Case& scene, FluidSolver& fluid);

/// Why there is nothing, where there is.
std::string why_unguided(const Case& scene);

/// Cells along each direction of a piece of a grid in which plasma alone is solved for. @param unchanged  along which it flows alike
std::array<int, 3> plasma_piece(const std::array<int, 3>& cells, const std::array<bool, 3>& unchanged);

/// Mean speed at which plasma alone flows in a straight tube or between walls, um/us: solved for on a piece of the same
/// grid a few cells long, so that its error is the same as that of the scene and leaves no trace in their ratio. Every rank calls; the
/// first one has the piece. @pre flow.gradient is not 0
/// @throws ComputationError  on all ranks
double plasma_speed(const Comm& comm, const Case& scene, const GuidedFlow& flow);

/// Stress of the flow on the walls around this block, resting and moving ones, into `stress` [cell, 3] of owned cells,
/// kPa. Cells nearer to a wall than the kernel reaches act on it besides, by what is not in it.
void find_wall_stress(const std::vector<BoundarySettings>& boundaries, FluidSolver& fluid, const Components<double>& stress);

}  // namespace corpuscle
