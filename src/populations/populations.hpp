// [[populations]]: how many cells they have, and where.
#pragma once

#include "cells/cell_places.hpp"
#include "grid/grid.hpp"
#include "populations/packing_report.hpp"

namespace corpuscle {

/// Cells of a population that the fluid has room for when it asks for a hematocrit: to the nearest whole cell.
/// @throws InputError  for less than one
int population_count(const PopulationSettings& population, int number, double fluid_volume, double cell_volume);

/// Where packing has put the cells of all populations, one population after the other. The same on any number of ranks, to
/// the bit: it is found from the case alone, by every rank for itself, on rigid shapes.
struct PackedCells {
  std::vector<CellPlace> cells;
  std::vector<int> count;  // [population]
  double size = 1;         // of the largest shapes that fit, over their own: membranes grow from there
};

/// What a rank keeps of it.
struct PackedShare {
  std::vector<CellPlace> cells;  // of all, those from `first` on
  std::int64_t first = 0, total = 0;
  std::vector<int> count;  // [population]
  double size = 1;         // as PackedCells
};
PackedShare share_of(const CellPlaces& places, const Comm& comm);
/// Without gaps.
PackingReport report_of(const Case& scene, const CellPlaces& places, double fluid_volume);

/// @param places  types, and the cells of [[cells]]
/// @param types   [population] of its cells
/// @throws InputError  for populations that cannot be placed, with how many cells and which hematocrit can
PackedCells pack_populations(const Case& scene, const Grid& grid, const CellPlaces& places, const std::vector<int>& types);

/// All cells of a scene.
/// @param packed  those of the populations, where they are known; else they are packed
CellPlaces find_places(const Case& scene, const Grid& grid, const PackedCells* packed = nullptr);

}  // namespace corpuscle
