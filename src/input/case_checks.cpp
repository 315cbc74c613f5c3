#include "input/case_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace corpuscle {
namespace {

using Side = BoundarySettings::Side;
using Type = BoundarySettings::Type;

std::string entry(std::size_t b) { return fmt::format("boundary.{}", b); }

void check_sides_given_once(const Case& scene, const std::array<int, 6>& entry_of, const Complaint& complain) {
  for (std::size_t b = 0; b < scene.boundaries.size(); ++b) {
    const auto side = scene.boundaries[b].side;
    const int first = entry_of[static_cast<int>(side)];
    if (first != static_cast<int>(b))
      complain(entry(b), "side", fmt::format("this side already has a [[boundary]] (boundary.{}); give each side one", first));
  }
  std::string missing;
  for (int s = 0; s < 6; ++s)
    if (entry_of[s] < 0) missing += (missing.empty() ? "" : ", ") + std::string(name_of(static_cast<Side>(s)));
  if (!missing.empty()) complain("boundary", "", fmt::format("no [[boundary]] for {}; each of the six sides needs one", missing));
}

void check_tube_sides(const Case& scene, const Complaint& complain) {
  const auto generator = scene.grid->generator;
  if (generator != GridSettings::Generator::straight_tube && generator != GridSettings::Generator::swept_tube) return;
  for (std::size_t b = 0; b < scene.boundaries.size(); ++b) {
    const auto& boundary = scene.boundaries[b];
    const bool lateral = boundary.side != Side::k_min && boundary.side != Side::k_max;
    if (lateral && boundary.type != Type::wall && boundary.type != Type::moving_wall)
      complain(entry(b), "type", "this side is part of the tube's wall: it must be \"wall\" or \"moving_wall\"");
  }
}

std::string constants_entry(const Case& scene, std::size_t c) {
  return scene.cells[c].type < 0 ? fmt::format("cells.{}", c) : fmt::format("cell_types.{}", scene.cells[c].type);
}

void check_sharp_scheme(const Case& scene, const Complaint& complain) {
  for (std::size_t c = 0; c < scene.cells.size(); ++c)
    if (scene.cells[c].viscosity_ratio != 1)
      complain(constants_entry(scene, c), "viscosity_ratio",
               "needs coupling.scheme = \"force\": with the others cells have no fluid inside. Leave it out, or set that scheme");
}

/// What rigid bodies beside membranes that are forces need, and what there is not with them.
void check_force_scheme(const Case& scene, const Complaint& complain) {
  if (scene.bodies.empty()) return;
  if (!scene.contact)
    complain(
        "bodies", "",
        "cells that are forces (coupling.scheme = \"force\") feel rigid bodies through contact, which also tells of one that gets into "
        "a body: add [contact]");
  if (!scene.populations.empty())
    complain("populations", "", "cells are not packed around rigid bodies: leave these out, or place the cells one by one in [[cells]]");
  if (scene.blood)
    complain("blood", "",
             "blood is measured in channels without obstacles, where its volume, profiles and plasma's flow are known: leave this section "
             "out, or the rigid bodies ([[bodies]])");
}

/// Cells that the program places.
void check_populations(const Case& scene, const Complaint& complain) {
  for (std::size_t p = 0; p < scene.populations.size(); ++p) {
    const CellSettings& cell = scene.cell_types[scene.populations[p].type].cell;
    if (!cell.mesh.empty() && !cell.recenter)
      complain(fmt::format("cell_types.{}", cell.type), "recenter",
               fmt::format("populations.{} places its cells by the centroid of their volume: set it to true, or leave it out", p));
    if (scene.coupling->scheme != CouplingSettings::Scheme::force)
      complain(
          fmt::format("populations.{}", p), "",
          "cells are packed only as membranes that are forces: set coupling.scheme = \"force\", or place them one by one in [[cells]]");
  }
}

/// Forces between vertices along what their velocities differ by have no sum, but a torque: they hold a cell as it turns.
void check_dissipation(const Case& scene, const Complaint& complain) {
  if (!scene.coupling || scene.coupling->scheme != CouplingSettings::Scheme::force) return;
  const auto check = [&](const std::string& section, const CellSettings& cell) {
    if (cell.dissipation == CellSettings::Dissipation::full)
      complain(section, "dissipation",
               "\"full\" resists turning as well as straining, and a free cell would not turn with the fluid that its "
               "membrane is part of in coupling.scheme = \"force\": use \"central\", or leave it out");
  };
  for (std::size_t c = 0; c < scene.cells.size(); ++c) check(constants_entry(scene, c), scene.cells[c]);
  for (std::size_t t = 0; t < scene.cell_types.size(); ++t) check(fmt::format("cell_types.{}", t), scene.cell_types[t].cell);
}

/// What pushes cells from outside must have something that holds them.
void check_pushes(const Case& scene, const std::array<int, 6>& entry_of, const Complaint& complain) {
  Triple sum{};
  int first = -1;
  for (std::size_t c = 0; c < scene.cells.size(); ++c)
    for (int d = 0; d < 3; ++d) {
      if (scene.cells[c].push_nN[d] != 0 && first < 0) first = static_cast<int>(c);
      sum[d] += scene.cells[c].push_nN[d];
    }
  if (first < 0) return;
  const std::string cell = fmt::format("cells.{}", first);
  if (!scene.coupling || scene.coupling->scheme != CouplingSettings::Scheme::force)
    complain(cell, "push_nN",
             "only membranes that are forces (coupling.scheme = \"force\") can be pushed: leave it out, or use that scheme");
  if (!scene.bodies.empty()) return;  // which are held
  for (int side : entry_of) {
    const auto type = scene.boundaries[side].type;
    if (type != Type::periodic && type != Type::symmetry) return;
  }
  constexpr double rounding = 1e-9;  // nN
  for (int d = 0; d < 3; ++d)
    if (std::abs(sum[d]) > rounding)
      complain(cell, "push_nN",
               fmt::format("all pushes add up to [{:g}, {:g}, {:g}] nN, and with periodic or symmetry sides all round nothing holds the "
                           "fluid: it would go ever faster; make them add up to zero, or give the grid a wall",
                           sum[0], sum[1], sum[2]));
}

/// Whether each part of the gradient has periodic sides to drive fluid between, on grids whose index directions are x, y, z;
/// on others their geometry decides, see check_pressure_gradient().
void check_gradient(const Case& scene, const std::array<int, 6>& entry_of, const Complaint& complain) {
  const auto& gradient = scene.fluid->pressure_gradient_Pa_per_um;
  const auto generator = scene.grid->generator;
  const bool straight = generator == GridSettings::Generator::box || generator == GridSettings::Generator::straight_tube;
  const auto periodic = [&](int d) { return scene.boundaries[entry_of[2 * d]].type == Type::periodic; };
  const bool any = periodic(0) || periodic(1) || periodic(2);
  for (int d = 0; d < 3; ++d) {
    if (gradient[d] == 0 || (straight ? periodic(d) : any)) continue;
    if (!any) complain("fluid", "pressure_gradient_Pa_per_um", "an imposed pressure gradient needs a pair of periodic sides");
    complain("fluid", "pressure_gradient_Pa_per_um",
             fmt::format("its {} component drives nothing, since {} and {} are not periodic: give it along a periodic direction, or make "
                         "both sides \"periodic\"",
                         "xyz"[d], name_of(static_cast<Side>(2 * d)), name_of(static_cast<Side>(2 * d + 1))));
  }
}

}  // namespace

const char* name_of(BoundarySettings::Side side) {
  static constexpr std::array names{"i_min", "i_max", "j_min", "j_max", "k_min", "k_max"};
  return names[static_cast<int>(side)];
}

void check_boundaries(const Case& scene, const Complaint& complain) {
  std::array<int, 6> entry_of;
  entry_of.fill(-1);
  for (std::size_t b = scene.boundaries.size(); b-- > 0;) entry_of[static_cast<int>(scene.boundaries[b].side)] = static_cast<int>(b);
  check_sides_given_once(scene, entry_of, complain);

  int inlets = 0, outflows = 0, inlet = 0;
  for (std::size_t b = 0; b < scene.boundaries.size(); ++b) {
    const auto& boundary = scene.boundaries[b];
    const auto opposite = static_cast<Side>(static_cast<int>(boundary.side) ^ 1);
    const auto& partner = scene.boundaries[entry_of[static_cast<int>(opposite)]];
    if (boundary.type == Type::periodic && partner.type != Type::periodic)
      complain(entry(b), "type", fmt::format("periodic sides come in pairs: make {} periodic as well", name_of(opposite)));
    if (boundary.type == Type::velocity_inlet) ++inlets, inlet = static_cast<int>(b);
    if (boundary.type == Type::outflow) ++outflows;
  }
  check_tube_sides(scene, complain);
  if (inlets == 1 && outflows == 0) complain(entry(inlet), "type", "fluid flows in but has no way out: make one side \"outflow\"");

  check_gradient(scene, entry_of, complain);
  check_pushes(scene, entry_of, complain);
  check_dissipation(scene, complain);
}

void check_modules(const Case& scene, const Complaint& complain) {
  if (scene.stretching) {
    for (const auto& [present, name] : std::initializer_list<std::pair<bool, const char*>>{{scene.fluid.has_value(), "fluid"},
                                                                                           {scene.grid.has_value(), "grid"},
                                                                                           {!scene.boundaries.empty(), "boundary"},
                                                                                           {!scene.bodies.empty(), "bodies"},
                                                                                           {scene.coupling.has_value(), "coupling"},
                                                                                           {scene.contact.has_value(), "contact"},
                                                                                           {scene.blood.has_value(), "blood"},
                                                                                           {!scene.populations.empty(), "populations"}})
      if (present) complain(name, "", "a stretching test has no fluid: leave out this section or [stretching]");
    if (scene.cells.size() != 1)
      complain("stretching", "", fmt::format("a stretching test pulls one cell; the case has {} [[cells]]", scene.cells.size()));
    for (std::size_t c = 0; c < scene.cells.size(); ++c)
      if (scene.cells[c].push_nN != Triple{})
        complain(fmt::format("cells.{}", c), "push_nN", "a stretching test pulls with stretching.force_pN: leave this out");
    return;
  }
  if (!scene.fluid && !scene.bodies.empty()) complain("bodies", "", "rigid bodies need a [fluid]");
  if (!scene.fluid && !scene.boundaries.empty()) complain("boundary", "", "boundaries need a [fluid]");
  if (!scene.fluid && scene.grid) complain("grid", "", "a grid without a [fluid] has no use");
  if (!scene.fluid)
    complain(!scene.cells.empty()        ? "cells"
             : scene.populations.empty() ? ""
                                         : "populations",
             "", "nothing to compute: add [fluid] or [stretching]");
  if (!scene.grid) complain("fluid", "", "a fluid needs a [grid]");
  if (scene.coupling && !scene.has_cells())
    complain("coupling", "", "there are no [[cells]] to couple to the fluid: leave this section out");
  if (scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force)
    check_force_scheme(scene, complain);
  else
    check_sharp_scheme(scene, complain);
  if (scene.contact && (!scene.coupling || scene.coupling->scheme != CouplingSettings::Scheme::force))
    complain("contact", "",
             !scene.has_cells() ? "there are no [[cells]] to touch each other: leave this section out"
                                : "only membranes that are forces may touch: set coupling.scheme = \"force\", or leave this section out");
  if (scene.blood && (!scene.coupling || scene.coupling->scheme != CouplingSettings::Scheme::force))
    complain("blood", "",
             !scene.has_cells()
                 ? "there are no [[cells]] to measure: leave this section out"
                 : "blood is measured where the fluid is everywhere, in cells too: set coupling.scheme = \"force\", or leave "
                   "this section out");
  check_populations(scene, complain);
  check_boundaries(scene, complain);
}

void check_output(const Case& scene, const Complaint& complain) {
  const auto is_wall = [](const BoundarySettings& b) { return b.type == Type::wall || b.type == Type::moving_wall; };
  if (scene.output.wall_shear_stress && std::none_of(scene.boundaries.begin(), scene.boundaries.end(), is_wall))
    complain("output", "fields", "no side is a wall, so there is no \"wall_shear_stress\": leave it out");
}

void check_sampling(const Case& scene, const Complaint& complain) {
  if (scene.blood && !(scene.blood->from_us < scene.time.end_us))
    complain("blood", "from_us",
             fmt::format("sampling would begin at {:g} us, and the run ends at {:g} us (time.end_us): begin earlier, or run longer",
                         scene.blood->from_us, scene.time.end_us));
  else if (scene.blood && scene.blood->sample_every_us > 0 && !is_sampled(scene))
    complain(
        "blood", "sample_every_us",
        fmt::format(
            "no sample, of those at whole multiples of it, falls between blood.from_us = {:g} us and time.end_us = {:g} us: sample more "
            "often, or run longer",
            scene.blood->from_us, scene.time.end_us));
}

bool is_sampled(const Case& scene) {
  constexpr double rounding = 1e-9;
  const double step = scene.time.step_us, every = scene.blood->interval_us(step);
  const double last = every * std::floor(scene.time.end_us / every + rounding);
  const double taken = step * std::ceil(last / step - rounding);  // at the end of the step that has come to it
  return last > 0 && taken >= scene.blood->from_us * (1 - rounding);
}

}  // namespace corpuscle
