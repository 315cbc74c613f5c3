// [[cells]], [[bodies]], [coupling], [stretching] and [output].
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "core/units.hpp"
#include "input/sections.hpp"

namespace corpuscle {
namespace {

void check_surface_file(Section& s, const std::string& key, const std::string& path) {
  const auto extension = std::filesystem::path(path).extension();
  if (!path.empty() && extension != ".off" && extension != ".stl" && extension != ".OFF" && extension != ".STL")
    s.fail(key, "must be an OFF or STL file (.off, .stl)");
}

Triple read_axis(Section& s) {
  const auto axis = s.triple("axis", any_number(), Triple{0, 0, 1});
  if (std::hypot(axis[0], axis[1], axis[2]) < 1e-12) s.fail("axis", "must not be zero: it is a direction");
  return axis;
}

void read_membrane(Section& s, CellSettings& c) {
  using Dissipation = CellSettings::Dissipation;
  c.shear_modulus_uN_per_m = s.number("shear_modulus_uN_per_m", positive(), c.shear_modulus_uN_per_m);
  // The default passes through the same conversion as a value from a file, so that the echo reads back to the same
  // bits.
  c.bending_modulus_fJ = s.number("bending_modulus_J", not_negative(), 2.4e-19) * units::J;
  c.area_modulus_uN_per_m = s.number("area_modulus_uN_per_m", not_negative(), c.area_modulus_uN_per_m);
  c.local_area_modulus_uN_per_m =
      s.number("local_area_modulus_uN_per_m", not_negative(), c.local_area_modulus_uN_per_m);
  if (c.local_area_modulus_uN_per_m == 0)
    s.fail(
        "local_area_modulus_uN_per_m",
        "must be above 0: with springs and the total area alone triangles can collapse or fold at no cost, the problem "
        "is ill-posed and solutions get stuck");
  c.volume_modulus_Pa = s.number("volume_modulus_Pa", not_negative(), c.volume_modulus_Pa);
  c.membrane_viscosity_N_s_per_m =
      s.number("membrane_viscosity_N_s_per_m", not_negative(), c.membrane_viscosity_N_s_per_m);
  c.dissipation = s.choice<Dissipation>("dissipation", {{"central", Dissipation::central}, {"full", Dissipation::full}},
                                        c.dissipation);
}

}  // namespace

CellSettings read_cell(Section& s, bool placed) {
  using Reference = CellSettings::Reference;
  using Interior = CellSettings::Interior;
  CellSettings c;
  c.mesh = s.file("mesh", false);
  check_surface_file(s, "mesh", c.mesh);
  if (c.mesh.empty()) {
    c.vertices = s.integer("vertices", 200, 30000, c.vertices);
  } else {
    s.unused("vertices", "the mesh file decides how many vertices the cell has: leave out vertices or mesh");
    c.vertices = 0;
  }
  for (const char* key : {"scale", "recenter", "align"})
    if (c.mesh.empty()) s.unused(key, "only a cell with a mesh file has this key");
  if (!c.mesh.empty()) {
    c.scale = s.number("scale", positive(), c.scale);
    c.recenter = s.flag("recenter", c.recenter);
    c.align = s.flag("align", c.align);
  }
  c.center_um = placed ? s.triple("center_um", any_number()) : s.triple("center_um", any_number(), Triple{});
  c.axis = read_axis(s);
  c.spin_deg = s.number("spin_deg", between(-360, 360), c.spin_deg);
  c.mass_pg = s.number("mass_pg", positive(), c.mass_pg);
  c.reference = s.choice<Reference>("reference",
                                    {{"shape", Reference::shape},
                                     {"spontaneous-angle", Reference::spontaneous_angle},
                                     {"uniform", Reference::uniform}},
                                    c.reference);
  c.interior = s.choice<Interior>("interior", {{"empty", Interior::empty}, {"cytosol", Interior::cytosol}}, c.interior);
  if (c.interior == Interior::cytosol)
    s.fail("interior", "a fluid inside the cell does not exist yet; use \"empty\" (the volume is held exactly)");
  read_membrane(s, c);
  s.finish();
  return c;
}

BodySettings read_body(Section& s) {
  using Shape = BodySettings::Shape;
  BodySettings b;
  b.shape =
      s.choice<Shape>("shape", {{"sphere", Shape::sphere}, {"ellipsoid", Shape::ellipsoid}, {"file", Shape::file}});
  const auto needs = [&](Shape shape, const char* name, const char* key) {
    if (b.shape != shape) s.unused(key, fmt::format("only shape = \"{}\" has this key", name));
    return b.shape == shape;
  };
  if (needs(Shape::sphere, "sphere", "radius_um")) b.radius_um = s.number("radius_um", positive());
  if (needs(Shape::ellipsoid, "ellipsoid", "semi_axes_um")) b.semi_axes_um = s.triple("semi_axes_um", positive());
  if (needs(Shape::file, "file", "file")) b.file = s.file("file", true);
  check_surface_file(s, "file", b.file);
  if (needs(Shape::file, "file", "scale")) b.scale = s.number("scale", positive(), b.scale);
  if (needs(Shape::file, "file", "recenter")) b.recenter = s.flag("recenter", b.recenter);
  if (b.shape == Shape::file)
    s.unused("vertices", "the file decides how many vertices the body has");
  else
    b.vertices = s.integer("vertices", 0, 100000, b.vertices);
  if (b.vertices != 0 && b.vertices < 42) s.fail("vertices", "must be 0 (chosen from the grid) or from 42 to 100000");
  b.center_um = s.triple("center_um", any_number());
  if (b.shape == Shape::sphere) {
    for (const char* key : {"axis", "spin_deg"}) s.unused(key, "a sphere is the same whichever way it is turned");
  } else {
    b.axis = read_axis(s);
    b.spin_deg = s.number("spin_deg", between(-360, 360), b.spin_deg);
  }
  b.velocity_um_per_us = scaled(s.triple("velocity_mm_per_s", any_number(), Triple{}), units::mm_per_s);
  b.angular_velocity_rad_per_us =
      scaled(s.triple("angular_velocity_rad_per_s", any_number(), Triple{}), units::rad_per_s);
  s.finish();
  return b;
}

namespace {

CouplingSettings read_force_coupling(Section& s, CouplingSettings c) {
  using Kernel = CouplingSettings::Kernel;
  c.kernel = s.choice<Kernel>("kernel", {{"three-point", Kernel::three_point}, {"four-point", Kernel::four_point}}, c.kernel);
  c.slip = s.flag("slip", c.slip);
  for (const char* key : {"tolerance", "max_iterations", "robin_coefficient_pg_per_um2_per_us", "robin_in_iterated",
                          "robin_in_aitken", "acceleration"})
    s.unused(key, "scheme = \"force\" has no such key: membranes move with the fluid, and nothing is iterated");
  s.finish();
  return c;
}

}  // namespace

CouplingSettings read_coupling(Section& s) {
  using Scheme = CouplingSettings::Scheme;
  using Acceleration = CouplingSettings::Acceleration;
  CouplingSettings c;
  c.scheme = s.choice<Scheme>(
      "scheme",
      {{"robin", Scheme::robin}, {"iterated", Scheme::iterated}, {"loose", Scheme::loose}, {"aitken", Scheme::iterated},
       {"force", Scheme::force}},
      c.scheme);
  if (c.scheme == Scheme::force) return read_force_coupling(s, c);
  for (const char* key : {"kernel", "slip"})
    s.unused(key, "only scheme = \"force\" has this key: with the others membranes cut the grid");
  c.tolerance = s.number("tolerance", between(1e-12, 0.5), c.tolerance);
  c.max_iterations = s.integer("max_iterations", 1, 10000, c.max_iterations);
  const std::string robin = "robin_coefficient_pg_per_um2_per_us";
  if (s.node(robin)) c.robin_coefficient = s.number(robin, not_negative());
  // Up to version 0.1 the scheme was called "aitken", whichever acceleration it used.
  const std::string in_iterated = s.node("robin_in_aitken") ? "robin_in_aitken" : "robin_in_iterated";
  c.robin_in_iterated = s.flag(in_iterated, c.robin_in_iterated);
  const bool robin_term = c.robin_in_iterated && c.robin_coefficient != 0;
  c.acceleration = s.choice<Acceleration>("acceleration", {{"anderson", Acceleration::anderson}, {"aitken", Acceleration::aitken}},
                                          robin_term ? Acceleration::anderson : Acceleration::aitken);
  s.finish();
  return c;
}

StretchingSettings read_stretching(Section& s) {
  StretchingSettings p;
  p.force_pN = s.number("force_pN", positive(10000), p.force_pN);
  p.steps = s.integer("steps", 1, 10000, p.steps);
  p.patch_fraction = s.number("patch_fraction", between(1e-4, 0.5), p.patch_fraction);
  p.tolerance = s.number("tolerance", between(1e-12, 0.1), p.tolerance);
  p.max_iterations = s.integer("max_iterations", 1, 1000000000, p.max_iterations);
  p.experiment = s.file("experiment", false);
  s.finish();
  return p;
}

namespace {

void read_fields(Section& s, OutputSettings& o, bool has_fluid) {
  const std::string allowed = "must be true, false or a list of \"velocity\", \"pressure\", \"kind\"";
  o.fields = o.velocity = o.pressure = o.kind = has_fluid;
  if (const auto* found = s.node("fields")) {
    if (found->is_boolean()) {
      o.fields = o.velocity = o.pressure = o.kind = *found->value<bool>();
    } else if (const auto* list = found->as_array()) {
      o.velocity = o.pressure = o.kind = false;
      for (const auto& entry : *list) {
        const auto name = entry.value<std::string>().value_or("");
        bool* chosen = name == "velocity"   ? &o.velocity
                       : name == "pressure" ? &o.pressure
                       : name == "kind"     ? &o.kind
                                            : nullptr;
        if (!entry.is_string() || !chosen) s.fail("fields", allowed);
        *chosen = true;
      }
      o.fields = !list->empty();
    } else {
      s.fail("fields", allowed);
    }
    if (o.fields && !has_fluid) s.fail("fields", "there is no [fluid], so there are no fields to write");
  }
  std::string names;
  for (const auto& [chosen, name] : {std::pair{o.velocity, "velocity"}, {o.pressure, "pressure"}, {o.kind, "kind"}})
    if (chosen) names += (names.empty() ? "" : ", ") + toml_text(std::string(name));
  s.echo_line("fields", o.fields ? "[" + names + "]" : "false");
}

}  // namespace

OutputSettings read_output(Section& s, bool has_fluid, bool has_surfaces) {
  OutputSettings o;
  o.every_us = s.number("every_us", not_negative(), o.every_us);
  o.history_every_us = s.number("history_every_us", not_negative(), o.history_every_us);
  o.checkpoint_every_us = s.number("checkpoint_every_us", not_negative(), o.checkpoint_every_us);
  read_fields(s, o, has_fluid);
  o.cells = s.flag("cells", has_surfaces);
  s.finish();
  if (o.cells && !has_surfaces) s.fail("cells", "there are no [[cells]] or [[bodies]] to write");
  return o;
}

}  // namespace corpuscle
