// Whether cells and bodies fit the grid and each other, before the first step.
#pragma once

#include "grid/spacing_map.hpp"
#include "immersed/surface.hpp"

namespace corpuscle {

/// How a grid resolves a body: at each of its vertices, the spacing of nodes across it over how thick it is there.
struct Resolution {
  double largest = 0;                       // where the body is thinnest, as the grid sees it
  double typical = 0;                       // exceeded over half of the surface
  double thickness_um = 0, spacing_um = 0;  // where it is largest
  std::array<double, 3> share{};            // of the grid's index directions in `typical`: the ones to refine
};

/// Resolution of each body at its present position, by a few hundred of its vertices.
/// @param types  [own cell], or empty: as in the scene
std::vector<Resolution> measure_resolution(const SpacingMap& map, const Case& scene, const SurfaceSet& surfaces,
                                           const std::vector<int>& types = {});

/// A body that the grid resolves coarsely, or a membrane whose mesh is coarser than the grid.
struct CoarseSurface {
  int type = -1;  // of a cell that is shared out
  bool mesh = false;
  double degree = 0;
  std::string text;
};

/// Where cells are shared out, each rank looks at its own and at what comes near its block.
/// @returns the bodies to warn of
/// @throws InputError  for a body that is larger than the grid, not resolved by it, inside another or across it
std::vector<CoarseSurface> check_surfaces(const Grid& grid, const Case& scene, const SurfaceSet& surfaces,
                                          const std::vector<int>& types = {});
/// Of a set with cells and rigid bodies, images of these among them.
/// @throws InputError  where one is in the other
void check_clear_of_bodies(const SurfaceSet& surfaces);
/// Of each type and kind the worst on any rank, the same on all. Every rank calls.
std::vector<CoarseSurface> worst_of_types(const Comm& comm, int types, const std::vector<CoarseSurface>& here);
/// @returns all texts, for messages about a run that breaks down later; "" if there are none
std::string warn_of_coarse(const std::vector<CoarseSurface>& surfaces);

}  // namespace corpuscle
