// [[bodies]], [coupling], [stretching] and [output].
#include <fmt/format.h>

#include "core/units.hpp"
#include "input/sections.hpp"

namespace corpuscle {

BodySettings read_body(Section& s) {
  using Shape = BodySettings::Shape;
  BodySettings b;
  b.shape = s.choice<Shape>({"shape", "Shape of the rigid body."},
                            {{"sphere", Shape::sphere}, {"ellipsoid", Shape::ellipsoid}, {"file", Shape::file}});
  const auto needs = [&](Shape shape, const char* name, const char* key) {
    if (b.shape != shape) s.unused(key, fmt::format("only shape = \"{}\" has this key", name));
    return b.shape == shape;
  };
  if (needs(Shape::sphere, "sphere", "radius_um")) b.radius_um = s.number({"radius_um", "Radius of the sphere."}, positive(most_um));
  if (needs(Shape::ellipsoid, "ellipsoid", "semi_axes_um"))
    b.semi_axes_um = s.triple({"semi_axes_um", "Half the lengths of the ellipsoid's three axes."}, positive(most_um));
  if (needs(Shape::file, "file", "file")) b.file = s.file({"file", "OFF or STL file of the body's closed surface."}, true);
  check_surface_file(s, "file", b.file);
  if (needs(Shape::file, "file", "scale"))
    b.scale = s.number({"scale", "Factor from the file's unit of length to um."}, positive(most_scale), b.scale);
  if (needs(Shape::file, "file", "recenter"))
    b.recenter = s.flag({"recenter", "Whether center_um is where the centroid of the file's volume goes, or where the file's origin goes."},
                        b.recenter);
  if (b.shape == Shape::file)
    s.unused("vertices", "the file decides how many vertices the body has");
  else
    b.vertices = s.integer({"vertices", "How many vertices the surface has; 0 chooses them from the grid."}, 0, 100000, b.vertices);
  if (b.vertices != 0 && b.vertices < 42) s.fail("vertices", "must be 0 (chosen from the grid) or from 42 to 100000");
  b.center_um = s.triple({"center_um", "Where the body's centre is at the start."}, between(-most_um, most_um));
  if (b.shape == Shape::sphere) {
    for (const char* key : {"axis", "spin_deg"}) s.unused(key, "a sphere is the same whichever way it is turned");
  } else {
    b.axis = read_axis(s);
    b.spin_deg = s.number({"spin_deg", "Rotation about that axis."}, between(-360, 360), b.spin_deg);
  }
  b.velocity_um_per_us = scaled(s.triple({"velocity_mm_per_s", "Velocity of the body's centre, whatever the flow does."},
                                         between(-most_mm_per_s, most_mm_per_s), Triple{}),
                                units::mm_per_s);
  b.angular_velocity_rad_per_us =
      scaled(s.triple({"angular_velocity_rad_per_s", "Angular velocity of the body about its centre, whatever the flow does."},
                      between(-most_rad_per_s, most_rad_per_s), Triple{}),
             units::rad_per_s);
  s.finish();
  return b;
}

namespace {

/// Keys of membranes that are forces, and of those that cut the grid.
void read_transfer(Section& s, CouplingSettings& c) {
  using Kernel = CouplingSettings::Kernel;
  const Key robin{"robin_coefficient_pg_per_um2_per_us",
                  "Coefficient of the stabilising term, what the fluid is taken to resist a membrane with."};
  if (c.scheme == CouplingSettings::Scheme::force) {
    c.kernel = s.choice<Kernel>(
        {"kernel", "Peskin kernel that spreads the membranes' forces and brings velocities back, by its width in grid spacings."},
        {{"three-point", Kernel::three_point}, {"four-point", Kernel::four_point}}, c.kernel);
    c.slip = s.flag({"slip", "Whether a slip along the membrane corrects for the thickness that spreading its forces lends it."}, c.slip);
    using Pressure = CouplingSettings::Pressure;
    c.pressure =
        s.choice<Pressure>({"pressure", "Whether the jump of the pressure at membranes is spread over the kernel's width or stays sharp."},
                           {{"spread", Pressure::spread}, {"sharp", Pressure::sharp}}, c.pressure);
    s.unused(robin.name, "scheme = \"force\" has no such key: membranes move with the fluid");
    return;
  }
  for (const char* key : {"kernel", "slip", "pressure"})
    s.unused(key, "only scheme = \"force\" has this key: with the others membranes cut the grid");
  s.describe(robin, "a number, 0 or more", "pi times viscosity over grid spacing, or more where stability needs it");
  if (s.node(robin.name)) c.robin_coefficient = s.number(robin, not_negative(1e12));
}

}  // namespace

CouplingSettings read_coupling(Section& s) {
  using Scheme = CouplingSettings::Scheme;
  using Acceleration = CouplingSettings::Acceleration;
  CouplingSettings c;
  c.scheme =
      s.choice<Scheme>({"scheme",
                        "How membranes and fluid are coupled: membranes cut the grid and are exchanged once a step (\"robin\", \"loose\") "
                        "or iterated (\"iterated\"; \"aitken\" is its old name), or are forces in a fluid that is everywhere (\"force\")."},
                       {{"robin", Scheme::robin},
                        {"iterated", Scheme::iterated},
                        {"loose", Scheme::loose},
                        {"aitken", Scheme::iterated},
                        {"force", Scheme::force}},
                       c.scheme);
  read_transfer(s, c);
  // Up to version 0.1 the scheme was called "aitken", whichever acceleration it used.
  const std::string in_iterated = s.node("robin_in_aitken") ? "robin_in_aitken" : "robin_in_iterated";
  if (c.scheme != Scheme::iterated) {
    for (const auto& key : {std::string("tolerance"), std::string("max_iterations"), std::string("acceleration"), in_iterated})
      s.unused(key, "only scheme = \"iterated\" has this key: the others do not iterate");
    s.finish();
    return c;
  }
  c.tolerance = s.number({"tolerance", "Change of the surface velocity, over itself, at which iterations of a step end."},
                         between(1e-12, 0.5), c.tolerance);
  c.max_iterations = s.integer({"max_iterations", "Iterations after which a step has failed."}, 1, 10000, c.max_iterations);
  c.robin_in_iterated = s.flag({in_iterated, "Whether iterations keep the stabilising term of \"robin\"."}, c.robin_in_iterated);
  const bool robin_term = c.robin_in_iterated && c.robin_coefficient != 0;
  c.acceleration = s.choice<Acceleration>({"acceleration", "How iterations are accelerated."},
                                          {{"anderson", Acceleration::anderson}, {"aitken", Acceleration::aitken}},
                                          robin_term ? Acceleration::anderson : Acceleration::aitken);
  s.finish();
  return c;
}

StretchingSettings read_stretching(Section& s) {
  StretchingSettings p;
  p.force_pN = s.number({"force_pN", "Pull at each end in the last step."}, positive(10000), p.force_pN);
  p.steps = s.integer({"steps", "How many equal steps the pull rises in."}, 1, 10000, p.steps);
  p.patch_fraction =
      s.number({"patch_fraction", "Share of all vertices that carries the force at each end."}, between(1e-4, 0.25), p.patch_fraction);
  p.tolerance = s.number({"tolerance", "Largest residual force on a vertex, over the mean applied one, at which a shape is at rest."},
                         between(1e-12, 0.1), p.tolerance);
  p.max_iterations = s.integer({"max_iterations", "Iterations of the search for rest, in each step, after which it has failed."}, 1,
                               1000000000, p.max_iterations);
  p.experiment = s.file({"experiment", "CSV file of measured diameters to compare with."}, false);
  s.finish();
  return p;
}

namespace {

void read_fields(Section& s, OutputSettings& o, bool has_fluid) {
  const std::string allowed = "must be true, false or a list of \"velocity\", \"pressure\", \"kind\", \"wall_shear_stress\"";
  o.fields = o.velocity = o.pressure = o.kind = has_fluid;
  s.describe({"fields", "Which fields of the flow are written."}, allowed.substr(std::string("must be ").size()), "true");
  if (const auto* found = s.node("fields")) {
    if (found->is_boolean()) {
      o.fields = o.velocity = o.pressure = o.kind = *found->value<bool>();
    } else if (const auto* list = found->as_array()) {
      o.velocity = o.pressure = o.kind = false;
      for (const auto& entry : *list) {
        const auto name = entry.value<std::string>().value_or("");
        bool* chosen = name == "velocity"            ? &o.velocity
                       : name == "pressure"          ? &o.pressure
                       : name == "kind"              ? &o.kind
                       : name == "wall_shear_stress" ? &o.wall_shear_stress
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
  for (const auto& [chosen, name] :
       {std::pair{o.velocity, "velocity"}, {o.pressure, "pressure"}, {o.kind, "kind"}, {o.wall_shear_stress, "wall_shear_stress"}})
    if (chosen) names += (names.empty() ? "" : ", ") + toml_text(std::string(name));
  s.echo_line("fields", o.fields ? "[" + names + "]" : "false");
}

}  // namespace

OutputSettings read_output(Section& s, bool has_fluid, bool has_surfaces) {
  OutputSettings o;
  o.every_us = s.number({"every_us", "Time between two outputs of fields and surfaces; 0: at the end alone."}, not_negative(), o.every_us);
  o.history_every_us =
      s.number({"history_every_us", "Time between two lines of history.csv; 0: every step."}, not_negative(), o.history_every_us);
  o.checkpoint_every_us = s.number({"checkpoint_every_us", "Time between two checkpoints to restart from; 0: at the end alone."},
                                   not_negative(), o.checkpoint_every_us);
  read_fields(s, o, has_fluid);
  o.cells = s.flag({"cells", "Write the surfaces of cells and bodies."}, has_surfaces);
  o.cells_in_history = s.integer(
      {"cells_in_history",
       "Up to how many cells each has lines in history.csv; figures of more go into cell_series.h5, with history_every_us above 0."},
      0, 1000000, o.cells_in_history);
  s.finish();
  if (o.cells && !has_surfaces) s.fail("cells", "there are no [[cells]] or [[bodies]] to write");
  return o;
}

}  // namespace corpuscle
