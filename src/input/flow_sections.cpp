// [time], [grid], [fluid] and [[boundary]].
#include <fmt/format.h>

#include <cmath>

#include "core/units.hpp"
#include "input/sections.hpp"

namespace corpuscle {
namespace {

void read_centerline(Section& s, GridSettings& grid) {
  using Centerline = GridSettings::Centerline;
  grid.centerline = s.choice<Centerline>({"centerline", "What curve the middle of a swept tube follows."},
                                         {{"arc", Centerline::arc}, {"helix", Centerline::helix}, {"spline", Centerline::spline}});
  const auto needs = [&](Centerline one, const char* name, const char* key) {
    if (grid.centerline != one) s.unused(key, fmt::format("only centerline = \"{}\" has this key", name));
    return grid.centerline == one;
  };
  if (needs(Centerline::spline, "spline", "points_um")) {
    grid.points_um = s.rows<3>({"points_um", "Points that the centreline passes through, joined by a smooth spline."}, 3);
    s.require({"points_um", ""}, "a list of 3 or more points [x, y, z]");
  }
  if (needs(Centerline::arc, "arc", "arc_radius_um"))
    grid.arc_radius_um = s.number({"arc_radius_um", "Radius of the circle that the centreline is a part of."}, positive(most_um));
  if (needs(Centerline::arc, "arc", "arc_angle_deg"))
    grid.arc_angle_deg = s.number({"arc_angle_deg", "How much of that circle the tube goes round."}, positive(350));
  if (needs(Centerline::helix, "helix", "helix_radius_um"))
    grid.helix_radius_um =
        s.number({"helix_radius_um", "Distance of the centreline from the axis that it winds about."}, positive(most_um));
  if (needs(Centerline::helix, "helix", "helix_pitch_um"))
    grid.helix_pitch_um = s.number({"helix_pitch_um", "How far along its axis the centreline goes in one turn."}, positive(most_um));
  if (needs(Centerline::helix, "helix", "helix_turns"))
    grid.helix_turns = s.number({"helix_turns", "How many turns the tube makes."}, positive(1000));
}

void check_grid(const Section& s, const GridSettings& grid) {
  using Generator = GridSettings::Generator;
  for (const auto& point : grid.points_um)
    for (double x : point)
      if (std::abs(x) > most_um) s.fail("points_um", fmt::format("must lie within {} um of the origin", most_um));
  for (int d = 0; d < 3 && grid.generator == Generator::box; ++d)
    if (grid.upper_um[d] <= grid.lower_um[d])
      s.fail("upper_um", fmt::format("must exceed lower_um = {} in every direction", toml_text(grid.lower_um.data(), 3)));
  if (grid.generator != Generator::swept_tube) return;
  for (std::size_t p = 1; p < grid.points_um.size(); ++p)
    if (grid.points_um[p] == grid.points_um[p - 1]) s.fail("points_um", fmt::format("points {} and {} coincide", p - 1, p));
  if (grid.centerline == GridSettings::Centerline::arc && grid.arc_radius_um <= grid.diameter_um / 2)
    s.fail("arc_radius_um", fmt::format("must exceed half the diameter, {} um: the tube would cut itself", grid.diameter_um / 2));
}

}  // namespace

namespace {

/// Of whole steps, with which those begin that membrane viscosity makes follow a load late.
constexpr double short_start_share = 1.0 / 16;

double read_first_step(Section& s, const TimeSettings& time, bool short_start) {
  const Key key{"first_step_us", "Length of the first steps, which then double until they are whole ones."};
  Bounds allowed = not_negative();
  if (s.recording()) {
    s.describe(key, allowed.text + "; 0: step_us",
               fmt::format("0, or step_us / {:g} where membranes are forces and have membrane viscosity", 1 / short_start_share));
    return 0;
  }
  return s.number(key, allowed, short_start ? short_start_share * time.step_us : 0.0);
}

}  // namespace

TimeSettings read_time(Section& s, bool short_start) {
  TimeSettings time;
  time.step_us = s.number({"step_us", "Length of a time step."}, positive(1e12));
  time.end_us = s.number({"end_us", "Simulated time at which the run is done."}, positive(1e15));
  time.first_step_us = read_first_step(s, time, short_start);
  time.stop_before_outflow_um =
      s.number({"stop_before_outflow_um",
                "The run ends, with all results and exit code 5, when a cell is this near to an outflow, along the grid line."},
               not_negative(), time.stop_before_outflow_um);
  s.finish();
  if (time.step_us > time.end_us) s.fail("step_us", fmt::format("must not exceed end_us = {}", time.end_us));
  return time;
}

GridSettings read_grid(Section& s) {
  using Generator = GridSettings::Generator;
  using CrossSection = GridSettings::CrossSection;
  GridSettings grid;
  grid.generator = s.choice<Generator>({"generator", "How the grid is made: a box, a straight or swept tube, or nodes from a file."},
                                       {{"box", Generator::box},
                                        {"straight_tube", Generator::straight_tube},
                                        {"swept_tube", Generator::swept_tube},
                                        {"file", Generator::file}});
  const bool box = grid.generator == Generator::box, file = grid.generator == Generator::file;
  const bool straight = grid.generator == Generator::straight_tube, swept = grid.generator == Generator::swept_tube;
  const auto needs = [&](bool present, const char* generators, const char* key) {
    if (!present) s.unused(key, fmt::format("only generator = {} has this key", generators));
    return present;
  };
  if (file) s.unused("nodes", "the file decides how many nodes the grid has: leave this key out");
  if (!file)
    grid.nodes = s.integers({"nodes", "Nodes along the three grid directions, cells plus one; a tube has its length along k."}, 4, 100000);
  if (needs(box, "\"box\"", "lower_um"))
    grid.lower_um = s.triple({"lower_um", "Corner of the box with the lowest coordinates."}, between(-most_um, most_um));
  if (needs(box, "\"box\"", "upper_um"))
    grid.upper_um = s.triple({"upper_um", "Corner of the box with the highest coordinates."}, between(-most_um, most_um));
  const char* tubes = "\"straight_tube\" or \"swept_tube\"";
  if (needs(straight || swept, tubes, "diameter_um"))
    grid.diameter_um = s.number({"diameter_um", "Inner diameter of the tube."}, positive(most_um));
  if (needs(straight, "\"straight_tube\"", "length_um"))
    grid.length_um = s.number({"length_um", "Length of the tube, along z and centred at the origin."}, positive(most_um));
  if (needs(straight || swept, tubes, "cross_section"))
    grid.cross_section =
        s.choice<CrossSection>({"cross_section",
                                "How the square of grid lines is mapped to the round section: \"conformal\" keeps right angles, "
                                "\"elliptical\" is more even in spacing."},
                               {{"conformal", CrossSection::conformal}, {"elliptical", CrossSection::elliptical}}, grid.cross_section);
  if (swept) read_centerline(s, grid);
  for (const char* key : {"centerline", "points_um", "arc_radius_um", "arc_angle_deg", "helix_radius_um", "helix_pitch_um", "helix_turns"})
    if (!swept) needs(false, "\"swept_tube\"", key);
  if (needs(file, "\"file\"", "file"))
    grid.file = s.file({"file", "HDF5 file of the grid's nodes: a data set \"nodes\" [nk, nj, ni, 3] of doubles, x, y, z in um."}, true);
  s.finish();
  check_grid(s, grid);
  return grid;
}

namespace {

FluidSettings::Convection read_convection(Section& s) {
  using Convection = FluidSettings::Convection;
  const std::string allowed = "must be false, true (the same as \"extrapolated\"), \"extrapolated\" or \"implicit\"";
  Convection convection = Convection::extrapolated;
  s.describe({"convection", "Whether the flow carries its own momentum, and how that enters a step; false is Stokes flow."},
             allowed.substr(std::string("must be ").size()), "\"extrapolated\"");
  if (const auto* found = s.node("convection")) {
    const auto text = found->value<std::string>();
    if (found->is_boolean()) {
      convection = *found->value<bool>() ? Convection::extrapolated : Convection::none;
    } else if (text && (*text == "extrapolated" || *text == "implicit")) {
      convection = *text == "implicit" ? Convection::implicit : Convection::extrapolated;
    } else {
      s.fail("convection", allowed);
    }
  }
  s.echo_line("convection", convection == Convection::none       ? "false"
                            : convection == Convection::implicit ? "\"implicit\""
                                                                 : "\"extrapolated\"");
  return convection;
}

}  // namespace

FluidSettings read_fluid(Section& s) {
  FluidSettings f;
  f.density_pg_per_um3 = s.number({"density_pg_per_um3", "Mass density of the fluid; water has 1."}, positive(1e6), f.density_pg_per_um3);
  f.kinematic_viscosity_um2_per_us = s.number({"kinematic_viscosity_um2_per_us", "Viscosity of the fluid over its density."},
                                              positive(1e12), f.kinematic_viscosity_um2_per_us);
  f.convection = read_convection(s);
  f.momentum_tolerance =
      s.number({"momentum_tolerance", "Residual of the momentum equation, over the velocity, at which its solution ends."},
               between(1e-15, 0.1), f.momentum_tolerance);
  f.divergence_tolerance =
      s.number({"divergence_tolerance",
                "Largest net flow out of a grid cell that the pressure may leave, over the fastest speed and the spacing squared."},
               between(1e-16, 0.1), f.divergence_tolerance);
  f.max_iterations =
      s.integer({"max_iterations", "Iterations of either linear solver after which a step has failed."}, 1, 100000, f.max_iterations);
  f.pressure_gradient_Pa_per_um =
      s.triple({"pressure_gradient_Pa_per_um",
                "Uniform pressure gradient that drives the flow, most often between periodic sides; the flow goes against it."},
               between(-1e12, 1e12), f.pressure_gradient_Pa_per_um);
  s.finish();
  return f;
}

namespace {

// A number is a mean speed along the inward normal, a triple is a vector.
void read_boundary_velocity(Section& s, BoundarySettings& b) {
  const std::string key = "velocity_mm_per_s";
  const Key known{key, "Velocity of an inlet or a moving wall."};
  const Bounds allowed = between(-1e9, 1e9);
  const bool inlet = b.type == BoundarySettings::Type::velocity_inlet;
  const bool moving = b.type == BoundarySettings::Type::moving_wall;
  if (!inlet && !moving) {
    s.unused(key, "only \"velocity_inlet\" and \"moving_wall\" have a velocity");
    return;
  }
  const auto* found = s.node(key);
  if (found && inlet && found->is_number()) {
    b.speed = s.number(known, allowed) * units::mm_per_s;
  } else if (found && inlet && !found->is_array()) {
    s.fail(key, "must be a number (mean speed along the inward normal) or three numbers [x, y, z]");
  } else if (found) {
    b.velocity = scaled(s.triple(known, allowed), units::mm_per_s);
  } else {
    s.require(known, inlet ? "a number (mean speed along the inward normal) or three numbers [x, y, z]" : "three numbers [x, y, z]");
  }
}

void check_profile(Section& s, const BoundarySettings& b) {
  using Profile = BoundarySettings::Profile;
  if (b.velocity && b.profile != Profile::uniform)
    s.fail("profile", "a velocity of three numbers is the same everywhere: give a mean speed to have a profile");
  for (std::size_t r = 0; r < b.radial_table.size(); ++r) {
    const bool rises = r == 0 ? b.radial_table[r][0] == 0 : b.radial_table[r][0] > b.radial_table[r - 1][0];
    if (!rises || b.radial_table[r][0] > 1) s.fail("radial_table", "r/R must start at 0 and rise from row to row to at most 1");
  }
  for (std::size_t r = 1; r < b.time_table.size(); ++r)
    if (b.time_table[r][0] <= b.time_table[r - 1][0]) s.fail("time_table", "times must rise from row to row");
  if (!b.time_table.empty() && b.ramp_us > 0) s.fail("ramp_us", "give either ramp_us or time_table, not both");
}

}  // namespace

BoundarySettings read_boundary(Section& s) {
  using Side = BoundarySettings::Side;
  using Type = BoundarySettings::Type;
  using Profile = BoundarySettings::Profile;
  BoundarySettings b;
  b.side = s.choice<Side>({"side", "The side of the grid that this entry is for: each direction has one of low and one of high index."},
                          {{"i_min", Side::i_min},
                           {"i_max", Side::i_max},
                           {"j_min", Side::j_min},
                           {"j_max", Side::j_max},
                           {"k_min", Side::k_min},
                           {"k_max", Side::k_max}});
  b.type = s.choice<Type>({"type", "What happens at the side."}, {{"velocity_inlet", Type::velocity_inlet},
                                                                  {"outflow", Type::outflow},
                                                                  {"wall", Type::wall},
                                                                  {"moving_wall", Type::moving_wall},
                                                                  {"symmetry", Type::symmetry},
                                                                  {"periodic", Type::periodic}});
  const bool inlet = b.type == Type::velocity_inlet, moves = inlet || b.type == Type::moving_wall;
  read_boundary_velocity(s, b);
  if (inlet)
    b.profile = s.choice<Profile>({"profile", "How the speed at an inlet varies over its section."},
                                  {{"uniform", Profile::uniform}, {"parabolic", Profile::parabolic}, {"table", Profile::table}}, b.profile);
  else
    s.unused("profile", "only a \"velocity_inlet\" has a profile");
  if (b.profile == Profile::table) {
    b.radial_table =
        s.rows<2>({"radial_table", "Rows of a distance from the middle, over the radius, and the speed there over the mean speed."}, 2);
    s.require({"radial_table", ""}, "rows [r/R, speed over mean speed], since profile = \"table\"");
  } else {
    s.unused("radial_table", "only profile = \"table\" has this key");
  }
  if (moves) {
    b.ramp_us = s.number({"ramp_us", "Time over which the velocity rises from zero, linearly."}, not_negative(), 0.0);
    b.time_table =
        s.rows<2>({"time_table", "Rows of a time in us and the factor of the velocity then; linear between, constant beyond."}, 2);
  }
  for (const char* key : {"ramp_us", "time_table"})
    if (!moves) s.unused(key, "only \"velocity_inlet\" and \"moving_wall\" change with time");
  s.finish();
  check_profile(s, b);
  return b;
}

}  // namespace corpuscle
