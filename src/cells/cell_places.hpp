// Where the cells of a scene start: types, and of each cell its type, place and direction.
#pragma once

#include <vector>

#include "membrane/membranes.hpp"

namespace corpuscle {

/// As in [[cells]].
struct CellPlace {
  int type = 0;  // of CellPlaces::types
  Triple center_um{}, axis{0, 0, 1};
  double spin_deg = 0;
  Triple start_stretch{1, 1, 1};
};

struct CellPlaces {
  std::vector<CellReference> types;
  std::vector<CellPlace> cells;  // in the order of CellNames
  CellNames names;
  double size = 1;  // that packed cells start with, over that of their types: the others have no room
};

/// Of cells that all have places of their own.
/// @throws InputError  as find_cell_types()
CellPlaces places_of(const std::vector<CellSettings>& cells);

}  // namespace corpuscle
