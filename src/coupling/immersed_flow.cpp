#include "coupling/immersed_flow.hpp"

#include "common/extremes.hpp"
#include "core/error.hpp"
#include "coupling/periodic_frame.hpp"
#include "immersed/surface.hpp"
#include "immersed/surface_motion.hpp"
#include "input/case_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

ImmersedFlow::ImmersedFlow(FluidSolver& fluid, const SurfaceSet& surfaces, const Leaving& leaving, Timers& timers)
    : fluid_(fluid), surfaces_(surfaces), timers_(timers) {
  ImmersedOptions options;
  for (int side = 0; side < 6; ++side) options.guarded[side] = !fluid.boundaries().bounded_by(side).empty();
  options.frame = periodic_frame(fluid.grid());
  if (fluid.shares_nodes()) {
    Grid* grid = &fluid.grid();
    options.sum = [grid](long value) { return grid->comm().sum(value); };
    options.exchange = [grid](const Array<std::int8_t>& field) { grid->halo().exchange(field); };
    options.exchange_band = [grid](const BandViews& band) {
      grid->halo().exchange(band.key);
      grid->halo().exchange(band.cut);
    };
  }
  options.outflow = leaving.sides;
  if (fluid.boundaries().has_outflow()) options.pressure_given = fluid.boundaries().outflow();
  options.travellers = leaving.vertices;
  boundary_ = std::make_unique<ImmersedBoundary>(fluid.grid().views(), surfaces, options);
  bodies_.bodies = surfaces.bodies;
  bodies_.images = boundary_->images();
  bodies_.growth = Array<double>("corpuscle::immersed::growth", surfaces.bodies);
  mean_velocity_ = Table<double>("corpuscle::immersed::mean_velocity", surfaces.bodies, 3);
  traction_ = Components<double>("corpuscle::coupling::traction", surfaces.vertices, 3);
  stress_ = make_surface_stress("corpuscle::coupling::stress", surfaces.vertices);
  if (fluid.grid().comm().size() > 1) found_host_ = HostCopy(boundary_->found_stress().values);
  x_classified_ = Components<double>("corpuscle::immersed::x_classified", surfaces.vertices, 3);
}

/// The lowest vertex that no rank finds in its block. For error messages: copies to the host.
int ImmersedFlow::first_unowned_vertex() {
  std::vector<double> owners;
  for (char owned : boundary_->owned_vertices()) owners.push_back(owned);
  fluid_.grid().comm().sum(owners.data(), static_cast<int>(owners.size()));
  return static_cast<int>(std::find(owners.begin(), owners.end(), 0.0) - owners.begin());
}

void ImmersedFlow::check_positions(double smallest_gap) {
  const auto& counts = boundary_->counts();
  const Comm& comm = fluid_.grid().comm();
  double worst[6] = {static_cast<double>(counts.lost_vertex),   -counts.wall_spacings,
                     static_cast<double>(counts.crossed_links), -counts.body_spacings,
                     static_cast<double>(counts.uncovered),     -counts.outflow_um};
  comm.max(worst, 6);
  any_uncovered_ = worst[4] > 0;
  const double to_wall = -worst[1], between = -worst[3];
  outflow_um_ = -worst[5];
  outflow_vertex_ = counts.outflow_um == outflow_um_ ? counts.outflow_vertex : -1;
  report_.least_wall_spacings = smaller(report_.least_wall_spacings, to_wall);
  report_.least_body_spacings = smaller(report_.least_body_spacings, between);
  double sums[5] = {static_cast<double>(counts.owned_vertices), static_cast<double>(counts.immersed), static_cast<double>(counts.inside),
                    static_cast<double>(counts.isolated), static_cast<double>(counts.uncovered)};
  comm.sum(sums, 5);
  const long found = std::lround(sums[0]);
  report_.classifications += 1;
  report_.immersed = std::max(report_.immersed, std::lround(sums[1]));
  report_.inside = std::max(report_.inside, std::lround(sums[2]));
  report_.isolated = std::max(report_.isolated, std::lround(sums[3]));
  report_.uncovered += std::lround(sums[4]);
  int vertex = static_cast<int>(worst[0]);
  if (vertex >= 0 || found < surfaces_.vertices) {
    if (vertex < 0) vertex = first_unowned_vertex();
    throw ComputationError(
        fmt::format("position: {} lies outside the grid. Likely cause: it was placed there, has reached the end of the grid, "
                    "or was pushed through a wall; change its center_um, use a longer grid, or end the run earlier (time.end_us)",
                    boundary_->describe_vertex(vertex)));
  }
  if (to_wall < smallest_gap) {
    const bool here = counts.wall_spacings == to_wall;
    vertex = static_cast<int>(comm.max(here ? static_cast<double>(counts.wall_vertex) : -1.0));
    const int side = static_cast<int>(comm.max(static_cast<double>(boundary_->nearest_guarded_side(vertex))));
    const std::string what = fluid_.boundaries().bounded_by(side);
    const bool wall = what == "a wall";
    const std::string named = boundary_->describe_vertex(vertex);
    const bool rigid = named.rfind("bodies.", 0) == 0;
    throw ComputationError(
        fmt::format("gap to {}: {} is {:.2f} grid spacings from {} ({}), and {:.2f} are needed to resolve the {} between "
                    "them.{} Move or tilt the {} (center_um, axis), refine the grid (grid.nodes) or use a {}",
                    wall ? "the wall" : "a side", named, to_wall, what, name_of(static_cast<BoundarySettings::Side>(side)), smallest_gap,
                    wall ? "film" : "flow",
                    wall && !rigid ? " Contact with walls is only of membranes that are forces (coupling.scheme = \"force\")." : "",
                    rigid ? "body" : "cell", wall ? "wider channel" : "larger grid"));
  }
  check_clearance(static_cast<int>(worst[2]), between, smallest_gap);
}

/// @param crossed  the most crossed links of any rank
/// @param between  the least gap between bodies of any rank, in spacings
void ImmersedFlow::check_clearance(int crossed, double between, double smallest_gap) {
  const auto& counts = boundary_->counts();
  if (crossed > 0) {
    const bool here = counts.crossed_links == crossed;
    const auto [where, first, second, inside] = describe_bodies(here ? counts.crossed_node : -1);
    const bool alone = second.empty() || between >= smallest_gap;
    if (alone && report_.classifications == 1)
      throw ComputationError(fmt::format(
          "surfaces cross: {} passes through itself near {}, as it is given, or folds there more tightly than the grid can tell: repair "
          "its surface file, use more vertices, or refine the grid (grid.nodes)",
          inside, where));
    if (alone)
      throw ComputationError(
          fmt::format("surfaces cross: {} passes through itself near {}. Likely cause: a fold too sharp for its mesh (cells.vertices), "
                      "or a step too long (time.step_us)",
                      inside, where));
    throw ComputationError(fmt::format(
        "surfaces cross: {} and {} overlap near {}. Contact forces are only between membranes that are forces (coupling.scheme = "
        "\"force\", [contact]): move them apart (center_um, axis) or end the run before they meet (time.end_us)",
        first, second, where));
  }
  if (between < smallest_gap) {
    const bool here = counts.body_spacings == between;
    const auto [where, first, second, inside] = describe_bodies(here ? counts.gap_node : -1);
    throw ComputationError(fmt::format(
        "gap between bodies: {} and {} are {:.2f} grid spacings apart, or overlap, near {}, and {:.2f} are needed to resolve the film "
        "between them. Contact forces are only between membranes that are forces (coupling.scheme = \"force\", [contact]): move them "
        "apart (center_um, axis), refine the grid (grid.nodes) or end the run before they meet (time.end_us)",
        first, second.empty() ? "its image beyond a periodic boundary" : second, between, where, smallest_gap));
  }
}

/// Where a node is, and the names of the bodies beside it, the second empty if there is none, and of the one that a neighbour
/// of it lies in. On all ranks; from the highest rank whose node is not -1. Copies to the host: for error messages.
std::array<std::string, 4> ImmersedFlow::describe_bodies(int node) {
  const Comm& comm = fluid_.grid().comm();
  const double speaker = comm.max(node >= 0 ? static_cast<double>(comm.rank()) : -1.0);
  double said[6] = {-1e300, -1e300, -1e300, -1e300, -1e300, -1e300};
  if (comm.rank() == static_cast<int>(speaker)) {
    const NearBodies near = boundary_->bodies_near(node);
    for (int d = 0; d < 3; ++d) said[d] = near.at[d];
    said[3] = near.other < 0 ? near.body : std::min(near.body, near.other);
    said[4] = near.other < 0 ? -1 : std::max(near.body, near.other);
    said[5] = near.around < 0 ? near.body : near.around;
  }
  comm.max(said, 6);
  const int first = static_cast<int>(said[3]), second = static_cast<int>(said[4]);
  return {fmt::format("({:.4g}, {:.4g}, {:.4g}) um", said[0], said[1], said[2]), body_name(surfaces_, first),
          second < 0 ? "" : body_name(surfaces_, second), body_name(surfaces_, static_cast<int>(said[5]))};
}

void ImmersedFlow::check_resolution() {
  const auto& counts = boundary_->counts();
  for (int b = 0; b < surfaces_.bodies; ++b) {
    const long nodes = fluid_.grid().comm().sum(static_cast<long>(counts.body_immersed[b] + counts.body_inside[b]));
    if (nodes == 0)
      throw ComputationError(fmt::format(
          "{}: no grid node lies in or next to it, so the flow does not see it: refine the grid (grid.nodes)", body_name(surfaces_, b)));
  }
}

void ImmersedFlow::update_geometry(double smallest_gap) {
  const auto scope = timers_.scope("search");
  update_surface_geometry(surfaces_);
  boundary_->classify();
  Kokkos::deep_copy(Exec(), x_classified_, surfaces_.x);
  const bool first = report_.classifications == 0;
  check_positions(smallest_gap);
  if (first) check_resolution();
  fluid_.grid().halo().exchange(boundary_->nodes().kind);
  fluid_.grid().halo().exchange(boundary_->nodes().body);
  if (any_uncovered_) fluid_.mend_pressure([&](const Array<double>& p) { boundary_->fill_uncovered(p); });
  boundary_->find_faces();
  boundary_->build_stencils();
  const auto& counts = boundary_->counts();
  for (int kind = static_cast<int>(RowKind::least_squares); kind < row_kinds; ++kind) own_velocity_fallbacks_ += counts.velocity_rows[kind];
  bodies_.rows = counts.immersed;
  bodies_.velocity = boundary_->velocity_stencils();
  bodies_.pressure = boundary_->pressure_stencils();
  bodies_.u_surface = boundary_->surface_velocity();
  bodies_.faces = boundary_->faces();
  const auto matrix = timers_.scope("pressure matrix");
  fluid_.set_kinds(boundary_->nodes().kind);
  if (first) fluid_.check_connected();
}

std::optional<NearOutflow> ImmersedFlow::nearest_outflow() const {
  if (!(outflow_um_ < 1e30)) return std::nullopt;
  const int vertex = static_cast<int>(fluid_.grid().comm().max(static_cast<double>(outflow_vertex_)));
  return NearOutflow{outflow_um_, boundary_->describe_vertex(vertex)};
}

const ImmersedReport& ImmersedFlow::report() {
  report_.velocity_fallbacks += fluid_.grid().comm().sum(own_velocity_fallbacks_);
  own_velocity_fallbacks_ = 0;
  return report_;
}

std::vector<long> ImmersedFlow::traction_fits() const {
  const auto own = boundary_->traction_fallbacks();
  std::vector<long> all;
  all.reserve(own.size());
  for (const int count : own) all.push_back(fluid_.grid().comm().sum(static_cast<long>(count)));
  return all;
}

std::vector<double> ImmersedFlow::classified_positions() const {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), x_classified_);
  std::vector<double> positions;
  for (int v = 0; v < surfaces_.vertices; ++v)
    for (int m = 0; m < 3; ++m) positions.push_back(host(v, m));
  return positions;
}

void ImmersedFlow::resume(const std::vector<double>& positions) {
  const auto host = Kokkos::create_mirror_view(surfaces_.x);
  for (int v = 0; v < surfaces_.vertices; ++v)
    for (int m = 0; m < 3; ++m) host(v, m) = positions[3 * v + m];
  Kokkos::deep_copy(surfaces_.x, host);
  boundary_->forget_places();
  update_geometry(0.0);
  own_velocity_fallbacks_ = 0;
}

void ImmersedFlow::solve(double time) {
  {
    const auto scope = timers_.scope("search");
    boundary_->update_surface_velocity();
    body_growth(surfaces_, bodies_.growth, mean_velocity_);
    fill_inside_velocity(fluid_.grid().index(), surfaces_, boundary_->band(), boundary_->nodes(), mean_velocity_, fluid_.velocity());
  }
  fluid_.solve(time, &bodies_);
}

const SurfaceStress& ImmersedFlow::tractions() {
  const auto scope = timers_.scope("tractions");
  TractionInput input;
  input.u = fluid_.velocity();
  input.p = fluid_.pressure();
  input.viscosity = fluid_.viscosity();
  input.pressure_gradient = fluid_.imposed_gradient();
  boundary_->find_stress(input);
  const Comm& comm = fluid_.grid().comm();
  if (comm.size() > 1) {
    const auto& own = found_host_.read();
    comm.sum(own.data(), static_cast<int>(own.span()));
    found_host_.write();
  }
  unseen_vertex_ = complete_stress(surfaces_, boundary_->found_stress(), stress_, traction_);
  return stress_;
}

void ImmersedFlow::forget_tractions() {
  Kokkos::deep_copy(stress_.values, 0.0);
  Kokkos::deep_copy(traction_, 0.0);
}

std::vector<std::array<Triple, 2>> ImmersedFlow::loads(const std::vector<Triple>& centre) {
  Components<double> at("corpuscle::immersed::centre", surfaces_.bodies, 3);
  Components<double> loads("corpuscle::immersed::loads", surfaces_.bodies, 6);
  auto at_host = Kokkos::create_mirror_view(at);
  const auto shift = wrapped_by();
  for (int b = 0; b < surfaces_.bodies; ++b)
    for (int m = 0; m < 3; ++m) at_host(b, m) = centre[b][m] - shift[b][m];
  Kokkos::deep_copy(at, at_host);
  body_loads(surfaces_, stress_, at, loads);
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), loads);
  std::vector<std::array<Triple, 2>> result(surfaces_.bodies);
  for (int b = 0; b < surfaces_.bodies; ++b)
    for (int m = 0; m < 3; ++m) result[b][0][m] = host(b, m), result[b][1][m] = host(b, 3 + m);
  return result;
}

std::vector<Triple> ImmersedFlow::wrapped_by() const {
  std::vector<Triple> shift(surfaces_.bodies, Triple{});
  if (!boundary_->periodic()) return shift;
  const auto laps = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), boundary_->laps());
  for (int b = 0; b < surfaces_.bodies; ++b)
    for (int d = 0; d < 3; ++d)
      for (int m = 0; m < 3; ++m) shift[b][m] += laps(b, d) * fluid_.grid().period(d)[m];
  return shift;
}

std::array<double, 2> ImmersedFlow::slip() {
  const Slip own = boundary_->slip(fluid_.velocity());
  const Comm& comm = fluid_.grid().comm();
  const double vertices = comm.sum(static_cast<double>(boundary_->counts().owned_vertices));
  return {comm.max(own.largest), std::sqrt(comm.sum(own.square) / std::max(vertices, 1.0))};
}

}  // namespace corpuscle
