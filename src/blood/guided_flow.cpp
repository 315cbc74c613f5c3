#include "blood/guided_flow.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "fluid/boundary_conditions.hpp"
#include "fluid/flow_balances.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {

namespace {

using Type = BoundarySettings::Type;
using Generator = GridSettings::Generator;

Vec3 to_vec3(const Triple& a) { return {a[0], a[1], a[2]}; }

bool is_wall(const BoundarySettings& side) { return side.type == Type::wall || side.type == Type::moving_wall; }

const BoundarySettings& side_of(const Case& scene, int number) {
  return *std::find_if(scene.boundaries.begin(), scene.boundaries.end(),
                       [&](const BoundarySettings& b) { return static_cast<int>(b.side) == number; });
}

int entry_of(const Case& scene, int number) { return static_cast<int>(&side_of(scene, number) - scene.boundaries.data()); }

/// A unit vector across another.
Vec3 any_across(const Vec3& a) {
  const Vec3 helper = std::abs(a.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 b = helper - dot(helper, a) * a;
  return (1 / norm(b)) * b;
}

void complete(FlowFrame& frame) { frame.binormal = cross(frame.tangent, frame.normal); }

/// The centreline as the grid was made from it.
void set_line(const GridSettings& grid, FlowFrame& frame) {
  const Centerline line(grid);
  constexpr int most = 4000;  // as finely as Centerline has it
  frame.length = line.length();
  frame.stations = std::clamp(static_cast<int>(200 * frame.length / frame.width), 200, most) + 1;
  frame.spacing = frame.length / (frame.stations - 1);
  frame.stride = std::max(1, static_cast<int>(0.5 * frame.width / frame.spacing));
  frame.line = Table<double>(uninitialised("corpuscle::blood::line"), frame.stations, LineColumn::count);
  const auto host = Kokkos::create_mirror_view(frame.line);
  const auto put = [&](int s, int column, const Triple& a) {
    for (int d = 0; d < 3; ++d) host(s, column + d) = a[d];
  };
  for (int s = 0; s < frame.stations; ++s) {
    const auto at = line.at(s * frame.spacing);
    put(s, LineColumn::position, at.position);
    put(s, LineColumn::tangent, at.tangent);
    put(s, LineColumn::normal, at.normal);
    put(s, LineColumn::binormal, at.binormal);
  }
  for (int s = 0; s < frame.stations; ++s) {
    const int low = std::max(s - 1, 0), high = std::min(s + 1, frame.stations - 1);
    for (int d = 0; d < 3; ++d)
      host(s, LineColumn::curvature + d) =
          (host(high, LineColumn::tangent + d) - host(low, LineColumn::tangent + d)) / ((high - low) * frame.spacing);
  }
  Kokkos::deep_copy(frame.line, host);
}

GuidedFlow tube_flow(const Case& scene, FluidSolver& fluid) {
  const GridSettings& grid = *scene.grid;
  GuidedFlow flow;
  FlowFrame& frame = flow.frame;
  frame.width = 0.5 * grid.diameter_um;
  frame.periodic = side_of(scene, 4).type == Type::periodic;
  if (frame.periodic) frame.period = to_vec3(fluid.grid().period(2));
  if (grid.generator == Generator::straight_tube) {
    frame.kind = FlowFrame::Kind::straight;
    frame.length = grid.length_um;
    frame.origin = {0, 0, -0.5 * grid.length_um};
    frame.tangent = frame.station_axis = {0, 0, 1};
    frame.normal = {1, 0, 0};
    complete(frame);
  } else {
    frame.kind = FlowFrame::Kind::swept;
    set_line(grid, frame);
  }
  const double gradient = -fluid.imposed_gradient().z;
  const bool still =
      std::none_of(scene.boundaries.begin(), scene.boundaries.end(), [](const BoundarySettings& b) { return b.type == Type::moving_wall; });
  flow.driven = still && (norm(fluid.imposed_gradient()) > 0 || !frame.periodic);
  if (frame.kind == FlowFrame::Kind::swept)
    flow.no_viscosity = "what plasma alone does in a bent tube is not known";
  else if (!frame.periodic)
    flow.no_viscosity = "the pressure drop of a tube with an inlet has the inlet's own in it: make both ends periodic";
  else if (gradient == 0)
    flow.no_viscosity = "no pressure gradient is imposed";
  else if (!still)
    flow.no_viscosity = "the tube's wall moves";
  else
    flow.gradient = gradient;
  return flow;
}

/// Along which a pressure gradient or an inlet drives the fluid in a box, less what is across; zero if none does.
Vec3 drive(const Case& scene, const FluidSolver& fluid, const Vec3& across) {
  Vec3 down = -fluid.imposed_gradient();
  down -= dot(down, across) * across;
  for (int s = 0; s < 6; ++s)
    if (side_of(scene, s).type == Type::velocity_inlet && norm(down) == 0) down[s / 2] = s % 2 == 0 ? 1 : -1;
  return down;
}

Vec3 velocity_of(const Case& scene, int side) { return to_vec3(side_of(scene, side).velocity.value_or(Triple{})); }

/// By how much the upper wall is faster than the lower one, along both.
Vec3 shear_of_walls(const Case& scene, int d) {
  Vec3 shear = velocity_of(scene, 2 * d + 1) - velocity_of(scene, 2 * d);
  shear[d] = 0;
  return shear;
}

/// Between four walls there is no one direction across, but there is one along.
std::optional<GuidedFlow> duct_flow(const Case& scene, FluidSolver& fluid) {
  int along = -1, walls = 0;
  for (int s = 0; s < 6; ++s) {
    const BoundarySettings& side = side_of(scene, s);
    if (side.type == Type::moving_wall) return std::nullopt;
    walls += is_wall(side);
    if (!is_wall(side) && s % 2 == 0 && !is_wall(side_of(scene, s + 1))) along = s / 2;
  }
  if (walls != 4 || along < 0) return std::nullopt;
  GuidedFlow flow;
  FlowFrame& frame = flow.frame;
  const Triple &lower = scene.grid->lower_um, &upper = scene.grid->upper_um;
  const Vec3 down = drive(scene, fluid, Vec3{});
  if (down[along] == 0) return std::nullopt;
  frame.origin = to_vec3(lower);
  frame.tangent[along] = down[along] > 0 ? 1 : -1;
  frame.station_axis[along] = 1;
  frame.normal = any_across(frame.tangent);
  frame.length = upper[along] - lower[along];
  frame.periodic = fluid.grid().index().periodic[along];
  frame.width = 1e300;
  for (int d = 0; d < 3; ++d)
    if (d != along) frame.width = std::min(frame.width, upper[d] - lower[d]);
  complete(frame);
  flow.duct = along;
  flow.driven = true;
  flow.gradient = -dot(fluid.imposed_gradient(), frame.tangent);
  if (!frame.periodic || flow.gradient == 0) {
    flow.gradient = 0;
    flow.no_viscosity = "no pressure gradient is imposed";
  }
  return flow;
}

std::optional<GuidedFlow> box_flow(const Case& scene, FluidSolver& fluid) {
  int pairs = 0, d = -1, walls = 0;
  for (int e = 0; e < 3; ++e) {
    const bool low = is_wall(side_of(scene, 2 * e)), high = is_wall(side_of(scene, 2 * e + 1));
    walls += low + high;
    if (low && high) ++pairs, d = e;
  }
  if (walls > 0 && (pairs != 1 || walls != 2)) return duct_flow(scene, fluid);
  GuidedFlow flow;
  FlowFrame& frame = flow.frame;
  const Triple &lower = scene.grid->lower_um, &upper = scene.grid->upper_um;
  frame.origin = to_vec3(lower);
  if (walls > 0) frame.normal[d] = 1;
  const Vec3 shear = walls > 0 ? shear_of_walls(scene, d) : Vec3{}, down = drive(scene, fluid, frame.normal);
  if (norm(shear) == 0 && norm(down) == 0) return std::nullopt;
  const Vec3 along = norm(shear) > 0 ? shear : down;
  frame.tangent = (1 / norm(along)) * along;
  // Walls that move together carry the fluid with them: its mean speed is no longer what the gradient drives.
  const bool still = walls == 0 || (norm(velocity_of(scene, 2 * d)) == 0 && norm(velocity_of(scene, 2 * d + 1)) == 0);
  flow.driven = norm(down) > 0 && still;
  flow.sheared = norm(shear) > 0 && norm(down) == 0;
  int axis = 0;
  for (int e = 1; e < 3; ++e)
    if (std::abs(frame.tangent[e]) > std::abs(frame.tangent[axis])) axis = e;
  frame.station_axis[axis] = 1;
  frame.length = upper[axis] - lower[axis];
  frame.periodic = fluid.grid().index().periodic[axis];
  if (walls == 0) {
    frame.normal = any_across(frame.tangent);
    flow.no_viscosity = "there are no walls";
  } else {
    frame.kind = FlowFrame::Kind::slit;
    frame.width = upper[d] - lower[d];
    flow.across = d;
    for (int end = 0; end < 2; ++end) flow.wall[end] = entry_of(scene, 2 * d + end);
    const double gradient = -dot(fluid.imposed_gradient(), frame.tangent);
    if (flow.driven && gradient > 0)
      flow.gradient = gradient;
    else if (!flow.sheared)
      flow.no_viscosity = flow.driven ? "no pressure gradient is imposed" : "both moving walls and a pressure gradient drive the flow";
  }
  complete(frame);
  return flow;
}

}  // namespace

namespace {

std::optional<GuidedFlow> flow_in_grid(const Case& scene, FluidSolver& fluid) {
  switch (scene.grid->generator) {
    case Generator::box:
      return box_flow(scene, fluid);
    case Generator::straight_tube:
    case Generator::swept_tube:
      return tube_flow(scene, fluid);
    case Generator::file:
      break;
  }
  return std::nullopt;
}

/// What else than blood has a say in how much it takes to drive the flow; empty if nothing has.
std::string disturbed(const Case& scene, FluidSolver& fluid, const GuidedFlow& flow) {
  if (std::any_of(scene.cells.begin(), scene.cells.end(), [](const CellSettings& cell) { return cell.push_nN != Triple{}; }))
    return "cells are pushed (push_nN), which drives or holds the flow as well";
  if (!flow.sheared) return "";
  for (int e = 0; e < 3; ++e)
    if (std::abs(flow.frame.tangent[e]) > 1e-9 && !fluid.grid().index().periodic[e])
      return "the fluid that moving walls drag along turns back at the ends: make those sides periodic";
  return "";
}

}  // namespace

std::optional<GuidedFlow> find_guided_flow(const Case& scene, FluidSolver& fluid) {
  if (!scene.grid || scene.boundaries.size() != 6) return std::nullopt;
  std::optional<GuidedFlow> flow = flow_in_grid(scene, fluid);
  if (!flow || !flow->no_viscosity.empty()) return flow;
  flow->no_viscosity = disturbed(scene, fluid, *flow);
  if (!flow->no_viscosity.empty()) flow->gradient = 0;
  return flow;
}

std::string why_unguided(const Case& scene) {
  if (!scene.grid || scene.grid->generator == Generator::file) return "of a grid from a file it is not known where along flow goes";
  int walls = 0, pairs = 0;
  for (int e = 0; e < 3; ++e) {
    const bool low = is_wall(side_of(scene, 2 * e)), high = is_wall(side_of(scene, 2 * e + 1));
    walls += low + high, pairs += low && high;
  }
  if (walls > 0 && (pairs != 1 || walls != 2) && (pairs != 2 || walls != 4))
    return "there are walls on other sides than two that face each other";
  return "there is no pressure gradient, no inlet, and no wall that moves along another";
}

namespace {

/// Directions of the grid along which plasma's flow does not change.
std::array<bool, 3> unchanged(const GuidedFlow& flow) {
  std::array<bool, 3> same{};
  for (int d = 0; d < 3; ++d) same[d] = d != flow.across && !(flow.frame.tube() && d < 2) && (flow.duct < 0 || d == flow.duct);
  return same;
}

}  // namespace

std::array<int, 3> plasma_piece(const std::array<int, 3>& cells, const std::array<bool, 3>& unchanged) {
  constexpr int few = 4;
  std::array<int, 3> piece = cells;
  for (int d = 0; d < 3; ++d)
    if (unchanged[d]) piece[d] = few;
  return piece;
}

namespace {

double solved_plasma_speed(const Case& scene, const GuidedFlow& flow) {
  constexpr int steps = 5;
  GridSettings piece = *scene.grid;
  std::array<bool, 3> periodic{};
  std::array<int, 3> cells{};
  for (int d = 0; d < 3; ++d) periodic[d] = side_of(scene, 2 * d).type == Type::periodic, cells[d] = piece.nodes[d] - 1;
  // Long cells along the flow: what does not change along it does not depend on their length, and multigrid coarsens the section alone.
  const std::array<bool, 3> along = unchanged(flow);
  const std::array<int, 3> few = plasma_piece(cells, along);
  for (int d = 0; d < 3; ++d) {
    if (!along[d]) continue;
    piece.nodes[d] = few[d] + 1;
    const double length = few[d] * flow.frame.width;
    if (flow.frame.tube())
      piece.length_um = length;
    else
      piece.upper_um[d] = piece.lower_um[d] + length;
  }
  FluidSettings settings = *scene.fluid;
  settings.convection = FluidSettings::Convection::none;
  settings.momentum_tolerance = std::min(settings.momentum_tolerance, 1e-10);
  Grid grid(Comm::alone(), make_node_source(piece), periodic);
  FluidSolver fluid(grid, settings, scene.boundaries, &piece);
  const double decay = settings.density_pg_per_um3 * flow.frame.width * flow.frame.width / fluid.viscosity();
  for (int n = 1; n <= steps; ++n) {
    fluid.begin_step(100 * decay);  // leaves less than a hundredth of what was unsteady, each time
    fluid.solve(n * 100 * decay, nullptr);
  }
  const Triple mean = mean_velocity(fluid);
  return dot(to_vec3(mean), flow.frame.tangent);
}

}  // namespace

double plasma_speed(const Comm& comm, const Case& scene, const GuidedFlow& flow) {
  double speed = 0;
  std::string failure;
  try {
    if (comm.rank() == 0) speed = solved_plasma_speed(scene, flow);
  } catch (const ComputationError& error) {
    failure = error.what();
  }
  failure = agree(comm, failure);
  if (!failure.empty()) throw ComputationError("plasma alone, for blood.relative_apparent_viscosity: " + failure);
  return comm.sum(speed);
}

void find_wall_stress(const std::vector<BoundarySettings>& boundaries, FluidSolver& fluid, const Components<double>& stress) {
  const WallSides sides = walls_of(boundaries);
  const auto find = fluid.skewed() ? wall_stress_field<true> : wall_stress_field<false>;
  find(fluid.grid().views(), fluid.coefficients(), sides, fluid.viscosity(), fluid.velocity(), stress);
}

}  // namespace corpuscle
