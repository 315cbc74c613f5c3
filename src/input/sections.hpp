// Readers of the sections of a case file: each fills its settings, in internal units, from one Section.
#pragma once

#include "input/section.hpp"

namespace corpuscle {

TimeSettings read_time(Section& s);
GridSettings read_grid(Section& s);
FluidSettings read_fluid(Section& s);
BoundarySettings read_boundary(Section& s);
/// @param placed  there is a fluid, so the cell must say where it is
CellSettings read_cell(Section& s, bool placed);
BodySettings read_body(Section& s);
CouplingSettings read_coupling(Section& s);
StretchingSettings read_stretching(Section& s);
OutputSettings read_output(Section& s, bool has_fluid, bool has_surfaces);

/// In place of a physical quantity in the units of the file, the same in internal units.
inline Triple scaled(Triple values, double factor) {
  for (auto& value : values) value *= factor;
  return values;
}

}  // namespace corpuscle
