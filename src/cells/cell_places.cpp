#include "cells/cell_places.hpp"

namespace corpuscle {

CellPlaces places_of(const std::vector<CellSettings>& cells) {
  CellTypes types = find_cell_types(cells);
  CellPlaces all;
  all.types = std::move(types.references);
  // The fluid, inside and out, is incompressible: whatever a type's volume of rest, its cells keep the one that they start with.
  for (CellReference& type : all.types) type.law.rest_volume = volume(type.mesh);
  for (std::size_t c = 0; c < cells.size(); ++c)
    all.cells.push_back({types.of_cell[c], cells[c].center_um, cells[c].axis, cells[c].spin_deg, cells[c].start_stretch});
  all.names.listed = static_cast<int>(cells.size());
  return all;
}

}  // namespace corpuscle
