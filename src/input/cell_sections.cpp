// [[cell_types]] and [[cells]].
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/nearest.hpp"
#include "core/units.hpp"
#include "input/sections.hpp"

namespace corpuscle {

void check_surface_file(Section& s, const std::string& key, const std::string& path) {
  const auto extension = std::filesystem::path(path).extension();
  if (!path.empty() && extension != ".off" && extension != ".stl" && extension != ".OFF" && extension != ".STL")
    s.fail(key, "must be an OFF or STL file (.off, .stl)");
}

Triple read_axis(Section& s) {
  const auto axis = s.triple({"axis", "Direction of the axis of symmetry; of any length but zero."}, between(-1e6, 1e6), Triple{0, 0, 1});
  if (std::hypot(axis[0], axis[1], axis[2]) < 1e-12) s.fail("axis", "must not be zero: it is a direction");
  return axis;
}

namespace {

using Shape = CellSettings::Shape;
using Law = CellSettings::Law;
using Reference = CellSettings::Reference;

constexpr double least_extent_um = 1, most_extent_um = 100;  // of a cell, as of one from a file

void read_semi_axes(Section& s, CellSettings& c) {
  c.semi_axes_um = s.triple({"semi_axes_um", "Half the lengths of the ellipsoid's three axes."}, positive(most_extent_um / 2));
  if (!s.has("semi_axes_um")) return;
  const auto [low, high] = std::minmax_element(c.semi_axes_um.begin(), c.semi_axes_um.end());
  if (*high < least_extent_um / 2)
    s.fail("semi_axes_um", fmt::format("the largest must be at least {}: are these um?", least_extent_um / 2));
  if (*high > 10 * *low) s.fail("semi_axes_um", "the largest may be ten times the smallest; give other shapes as a mesh file");
}

void read_built_in_shape(Section& s, CellSettings& c) {
  for (const char* key : {"scale", "recenter", "align"}) s.unused(key, "only a cell with a mesh file has this key");
  c.shape = s.choice<Shape>({"shape", "Built-in shape at rest."},
                            {{"biconcave", Shape::biconcave}, {"sphere", Shape::sphere}, {"ellipsoid", Shape::ellipsoid}}, c.shape);
  const auto has = [&](Shape shape, const char* name, const char* key) {
    if (c.shape != shape) s.unused(key, fmt::format("only shape = \"{}\" has this key", name));
    return c.shape == shape;
  };
  if (has(Shape::biconcave, "biconcave", "diameter_um"))
    c.diameter_um = s.number({"diameter_um", "Diameter of the biconcave disk."}, between(least_extent_um, most_extent_um), c.diameter_um);
  if (has(Shape::sphere, "sphere", "radius_um"))
    c.radius_um = s.number({"radius_um", "Radius of the sphere."}, between(least_extent_um / 2, most_extent_um / 2));
  if (has(Shape::ellipsoid, "ellipsoid", "semi_axes_um")) read_semi_axes(s, c);
  c.vertices = s.integer({"vertices", "How many particles the membrane has; any number, not only those of regular refinements."},
                         c.shape == Shape::biconcave ? 200 : 42, 30000, c.vertices);
}

void read_mesh_shape(Section& s, CellSettings& c) {
  s.unused("vertices", "the mesh file decides how many vertices the cell has: leave out vertices or mesh");
  for (const char* key : {"shape", "diameter_um", "radius_um", "semi_axes_um"})
    s.unused(key, "the mesh file decides the shape (scale = ... its size): leave out this key or mesh");
  c.vertices = 0;
  c.scale = s.number({"scale", "Factor from the file's unit of length to um."}, positive(most_scale), c.scale);
  c.recenter = s.flag({"recenter", "Whether center_um is where the centroid of the file's volume goes, or where the file's origin goes."},
                      c.recenter);
  c.align = s.flag({"align", "Whether a mesh that is a disc has its own axis turned to `axis`, or the file's z."}, c.align);
}

void read_rest(Section& s, CellSettings& c) {
  const bool built_in = c.mesh.empty();
  c.reference = s.choice<Reference>({"reference",
                                     "At which lengths and angles the membrane rests: those of its shape; the same lengths with the angles "
                                     "of a sphere; equal lengths and angles; those of an oblate spheroid of its area."},
                                    {{"shape", Reference::shape},
                                     {"spontaneous-angle", Reference::spontaneous_angle},
                                     {"uniform", Reference::uniform},
                                     {"spheroid", Reference::spheroid}},
                                    c.reference);
  if (c.reference == Reference::spheroid) {
    if (!built_in || c.shape != Shape::biconcave)
      s.fail("reference", "only the built-in biconcave shape rests on a spheroid: leave out reference, or mesh and shape");
    c.reference_reduced_volume =
        s.number({"reference_reduced_volume", "Volume of the stress-free spheroid over that of a sphere of its area."}, between(0.65, 1),
                 c.reference_reduced_volume);
  } else {
    s.unused("reference_reduced_volume", "only reference = \"spheroid\" has this key");
  }
  if (built_in && c.shape == Shape::sphere && c.reference == Reference::shape)
    c.inflation = s.number({"inflation", "The sphere's radius over that at which its sheet rests, less 1."}, between(0, 1), c.inflation);
  else
    s.unused("inflation", "only shape = \"sphere\" with reference = \"shape\" has this key");
}

void read_law(Section& s, CellSettings& c) {
  c.law = s.choice<Law>({"law", "Elastic law in the plane: springs (worm-like chains against a power), or a neo-Hookean or Skalak sheet."},
                        {{"wlc-pow", Law::wlc_pow}, {"neo-hookean", Law::neo_hookean}, {"skalak", Law::skalak}}, c.law);
  if (c.law == Law::skalak)
    c.skalak_c = s.number({"skalak_c", "C of the Skalak law: the modulus of area is the shear modulus times 1 + 2 C."}, not_negative(1e6),
                          c.skalak_c);
  else
    s.unused("skalak_c", "only law = \"skalak\" has this key");
  // Springs know nothing of areas; sheets do, and have further terms only where they are asked for.
  if (c.law != Law::wlc_pow) c.area_modulus_uN_per_m = c.local_area_modulus_uN_per_m = 0;
}

void read_membrane(Section& s, CellSettings& c) {
  using Dissipation = CellSettings::Dissipation;
  read_law(s, c);
  c.shear_modulus_uN_per_m = s.number({"shear_modulus_uN_per_m", "Shear modulus of the membrane at small strains."},
                                      positive(most_uN_per_m), c.shear_modulus_uN_per_m);
  // The default passes through the same conversion as a value from a file, so that the echo reads back to the same
  // bits.
  c.bending_modulus_fJ = s.number({"bending_modulus_J", "Bending modulus of the membrane."}, not_negative(most_J), 2.4e-19) * units::J;
  c.area_modulus_uN_per_m = s.number({"area_modulus_uN_per_m", "Stiffness against change of the whole surface."},
                                     not_negative(most_uN_per_m), c.area_modulus_uN_per_m);
  c.local_area_modulus_uN_per_m = s.number({"local_area_modulus_uN_per_m", "Stiffness against change of each triangle's area."},
                                           not_negative(most_uN_per_m), c.local_area_modulus_uN_per_m);
  if (c.law == Law::wlc_pow && c.local_area_modulus_uN_per_m == 0)
    s.fail("local_area_modulus_uN_per_m",
           "must be above 0: with springs and the total area alone triangles can collapse or fold at no cost, the problem "
           "is ill-posed and solutions get stuck");
  c.volume_modulus_Pa = s.number({"volume_modulus_Pa", "Stiffness against change of the enclosed volume where no fluid is inside."},
                                 not_negative(most_Pa), c.volume_modulus_Pa);
  c.membrane_viscosity_N_s_per_m = s.number({"membrane_viscosity_N_s_per_m", "Surface viscosity of the membrane."},
                                            not_negative(most_N_s_per_m), c.membrane_viscosity_N_s_per_m);
  c.dissipation = s.choice<Dissipation>(
      {"dissipation",
       "What of the relative velocity of two linked vertices dissipates: that along their link (\"central\"), or all of it (\"full\")."},
      {{"central", Dissipation::central}, {"full", Dissipation::full}}, c.dissipation);
}

Bounds viscosity_ratios() {
  Bounds bounds = between(0.1, 50);
  bounds.text += ", of the viscosity inside over that outside: a grid cannot show a sharper step from one to the other";
  return bounds;
}

/// What the cells of a type have in common.
void read_constants(Section& s, CellSettings& c) {
  using Interior = CellSettings::Interior;
  c.mesh = s.file({"mesh", "OFF or STL file of the cell's surface at rest, in place of a built-in shape."}, false);
  check_surface_file(s, "mesh", c.mesh);
  if (c.mesh.empty())
    read_built_in_shape(s, c);
  else
    read_mesh_shape(s, c);
  c.mass_pg = s.number({"mass_pg", "Mass of the membrane of a cell that cuts the grid."}, positive(most_pg), c.mass_pg);
  read_rest(s, c);
  c.interior = s.choice<Interior>({"interior", "What is inside: with \"empty\" a hole in the fluid where membranes cut the grid."},
                                  {{"empty", Interior::empty}, {"cytosol", Interior::cytosol}}, c.interior);
  if (c.interior == Interior::cytosol)
    s.fail("interior",
           "leave this key out, or use \"empty\": with coupling.scheme = \"force\" the cell is filled with fluid (viscosity_ratio), and "
           "with the "
           "others it has none and its volume is held exactly");
  c.viscosity_ratio =
      s.number({"viscosity_ratio", "Viscosity of the fluid inside over that of the fluid outside."}, viscosity_ratios(), c.viscosity_ratio);
  read_membrane(s, c);
}

void read_place(Section& s, CellSettings& c, bool placed) {
  const Bounds anywhere = between(-most_um, most_um);
  c.center_um = placed ? s.triple({"center_um", "Where the cell's centre starts."}, anywhere)
                       : s.triple({"center_um", "Where the cell's centre starts."}, anywhere, Triple{});
  c.axis = read_axis(s);
  c.spin_deg = s.number({"spin_deg", "Rotation about that axis."}, between(-360, 360), c.spin_deg);
  c.start_stretch = s.triple({"start_stretch", "Factors by which the cell starts drawn out along its own axes, its volume kept."},
                             between(0.5, 2), c.start_stretch);
  c.push_nN = s.triple({"push_nN", "Constant force on the cell from outside, the same share on each vertex."}, between(-most_nN, most_nN),
                       Triple{});
}

std::vector<std::string> known_constants(const Section& s) {
  Section nothing(s.source(), "", nullptr);
  CellSettings any;
  read_constants(nothing, any);
  return nothing.known();
}

/// The constants of the type that the cell names.
CellSettings of_type(Section& s, const std::vector<CellTypeSettings>& types) {
  if (types.empty())
    s.fail("type", "the case has no [[cell_types]]: add one with this name, or leave out type and give the cell's keys here");
  const auto& [name, cell] = types[read_type(s, types)];
  const auto constants = known_constants(s);
  for (const auto& key : s.present())
    if (std::find(constants.begin(), constants.end(), key) != constants.end())
      s.fail(key, fmt::format("this belongs to the cell's type, \"{}\": set {} (for all its cells), give this cell a type of its "
                              "own, or leave out type and give all its keys here",
                              name, constant_key(cell, key)));
  return cell;
}

}  // namespace

int read_type(Section& s, const std::vector<CellTypeSettings>& types) {
  const std::string name = s.text({"type", "The type of the cell, by its name."});
  if (!s.has("type")) return 0;  // finish() says that it is missing
  std::vector<std::string> names;
  for (const auto& type : types) names.push_back(type.name);
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) {
    const auto like = nearest(name, names);
    s.fail("type", fmt::format("unknown cell type; known: \"{}\"{}", fmt::join(names, "\", \""),
                               like.empty() ? "" : fmt::format("; did you mean \"{}\"?", like)));
  }
  return static_cast<int>(at - names.begin());
}

CellTypeSettings read_cell_type(Section& s, const std::vector<CellTypeSettings>& known) {
  CellTypeSettings type;
  type.name = s.text({"name", "What cells and populations call this type."});
  if (s.has("name") && type.name.empty()) s.fail("name", "must not be empty: cells say type = \"name\"");
  for (const auto& other : known)
    if (other.name == type.name) s.fail("name", fmt::format("cell_types.{} has this name already", other.cell.type));
  for (const char* key : {"center_um", "axis", "spin_deg", "start_stretch", "push_nN"})
    s.unused(key, "a type has no place: give it in the [[cells]] entry of each cell");
  type.cell.type = static_cast<int>(known.size());
  read_constants(s, type.cell);
  s.finish();
  return type;
}

CellSettings read_cell(Section& s, const std::vector<CellTypeSettings>& types, bool placed) {
  CellSettings c;
  if (s.node("type"))
    c = of_type(s, types);
  else
    read_constants(s, c);
  read_place(s, c, placed);
  s.finish();
  return c;
}

}  // namespace corpuscle
