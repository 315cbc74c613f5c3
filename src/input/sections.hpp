// Readers of the sections of a case file: each fills its settings, in internal units, from one Section.
#pragma once

#include "input/section.hpp"

namespace corpuscle {

// Beyond any cell's by orders of magnitude: what is larger is a slip of the unit, and sums of squares would overflow.
constexpr double most_um = 1e7, most_uN_per_m = 1e9, most_J = 1e-9, most_Pa = 1e12, most_N_s_per_m = 1, most_pg = 1e12, most_nN = 1e9;
constexpr double most_mm_per_s = 1e9, most_rad_per_s = 1e12, most_scale = 1e12;

/// @param short_start  the first steps are short unless the case says otherwise
TimeSettings read_time(Section& s, bool short_start = false);
GridSettings read_grid(Section& s);
FluidSettings read_fluid(Section& s);
BoundarySettings read_boundary(Section& s);
/// @param known  the types before it
CellTypeSettings read_cell_type(Section& s, const std::vector<CellTypeSettings>& known);
/// @param types   that it may name instead of keys of its own
/// @param placed  there is a fluid, so the cell must say where it is
CellSettings read_cell(Section& s, const std::vector<CellTypeSettings>& types, bool placed);
/// @param types  that it may name
PopulationSettings read_population(Section& s, const std::vector<CellTypeSettings>& types);
BodySettings read_body(Section& s);
CouplingSettings read_coupling(Section& s);
ContactSettings read_contact(Section& s);
BloodSettings read_blood(Section& s);
StretchingSettings read_stretching(Section& s);
OutputSettings read_output(Section& s, bool has_fluid, bool has_surfaces);

/// The key "type": which of the cell types it names. @throws InputError  none
int read_type(Section& s, const std::vector<CellTypeSettings>& types);
/// The key must name an OFF or STL file; "" is none.
void check_surface_file(Section& s, const std::string& key, const std::string& path);
/// The key "axis": a direction, by default z.
Triple read_axis(Section& s);

/// In place of a physical quantity in the units of the file, the same in internal units.
inline Triple scaled(Triple values, double factor) {
  for (auto& value : values) value *= factor;
  return values;
}

}  // namespace corpuscle
