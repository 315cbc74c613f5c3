#include "coupling/force_coupling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/periodic_frame.hpp"
#include "coupling/surface_checks.hpp"
#include "immersed/surface_geometry.hpp"
#include "membrane/interface.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

/// Along index direction d: the grid's volume over the area that it is swept with.
double mean_spacing(const Grid& grid, int d) {
  const IndexSpace index = grid.index();
  const Components<double> area = grid.views().face_area[d];
  const double swept = sum_owned("corpuscle::coupling::swept_area", index,
                                 KOKKOS_LAMBDA(int i, int j, int k) { return norm(load(area, index.cell(i, j, k))); });
  return grid.total_volume() / grid.comm().sum(swept);
}

}  // namespace

ForceCoupling::ForceCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers)
    : scene_(scene),
      fluid_(fluid),
      timers_(timers),
      lengths_us_(schedule.lengths_us()),
      membranes_(std::make_unique<Membranes>(scene.cells)),
      frame_(periodic_frame(fluid.grid())),
      quiet_speed_(negligible_speed(scene, fluid.viscosity())) {
  const int vertices = membranes_->vertices();
  transfer_ = std::make_unique<Transfer>(fluid.grid(), scene.boundaries, scene.coupling->kernel, vertices);
  fluid.set_face_force(transfer_->faces());
  if (std::any_of(scene.cells.begin(), scene.cells.end(), [](const CellSettings& c) { return c.viscosity_ratio != 1; })) {
    std::vector<double> ratios;
    for (const auto& cell : scene.cells) ratios.push_back(cell.viscosity_ratio);
    cytosol_ = std::make_unique<Cytosol>(fluid.grid(), ratios);
    fluid.set_viscosity(cytosol_->relative_viscosity(), cytosol_->least(), cytosol_->fluidity());
  }
  fluid.raise_reference_speed(quiet_speed_);
  traction_ = Components<double>("corpuscle::coupling::traction", vertices, 3);
  Kokkos::deep_copy(membranes_->views().force, 0.0);
  if (fluid.grid().comm().size() > 1) velocity_host_ = HostCopy(membranes_->surfaces().v);
  if (frame_.periodic[0] || frame_.periodic[1] || frame_.periodic[2])
    laps_ = Table<int>("corpuscle::coupling::laps", membranes_->cells(), 3);
}

std::string ForceCoupling::vertex_text(int vertex) const {
  const auto& set = surfaces();
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.first_vertex);
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.x);
  int cell = 0;
  while (cell + 1 < set.cells && first(cell + 1) <= vertex) ++cell;
  return fmt::format("{}, vertex {} at ({:.4g}, {:.4g}, {:.4g}) um", body_name(set, cell), vertex - first(cell), x(vertex, 0),
                     x(vertex, 1), x(vertex, 2));
}

void ForceCoupling::wrap() {
  if (!laps_.data()) return;
  wrap_bodies(surfaces(), 0, membranes_->cells(), frame_, false, 0, {}, laps_);
}

/// Where the vertices are in the grid.
/// @throws ComputationError  if one is outside
void ForceCoupling::place(double time) {
  const Comm& comm = fluid_.grid().comm();
  const int beyond = transfer_->place(surfaces().x);
  const double first = comm.min(beyond >= 0 ? beyond : 1e15);
  if (first < 1e15)
    throw ComputationError(
        fmt::format("{} is outside the grid at {:.6g} us. Likely cause: a cell pressed against a wall, where nothing but the "
                    "flow keeps it away, "
                    "or a step too long; reduce time.step_us or move the cell (center_um)",
                    vertex_text(static_cast<int>(first)), time));
  outflow_ = {};
  for (const auto& boundary : scene_.boundaries) {
    const int side = static_cast<int>(boundary.side), d = side / 2, end = side % 2;
    const auto& lattice = transfer_->block().lattice;
    if (boundary.type != BoundarySettings::Type::outflow || !(end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d]))
      continue;
    const NearSide near = nearest_to_side(transfer_->block(), transfer_->views(), d, end);
    if (near.distance < outflow_.distance) outflow_ = near;
  }
  const double least = comm.min(outflow_.distance);
  const double vertex = comm.max(outflow_.distance == least ? outflow_.vertex : -1.0);
  outflow_ = {least, static_cast<int>(vertex)};
}

/// The viscosity, with the membranes where place() found them.
/// @throws ComputationError  if there is no saying what is inside them
void ForceCoupling::fill_cells(double time) {
  if (!cytosol_) return;
  cytosol_->update(*transfer_, surfaces());
  if (cytosol_->broken())
    throw ComputationError(
        fmt::format("what is inside the cells cannot be told at {:.6g} us: a triangle of a membrane reaches over more than two "
                    "spacings of the grid. Use more vertices (cells.vertices) or a coarser grid (grid.nodes)",
                    time));
}

void ForceCoupling::check_start() {
  wrap();
  coarse_ = check_surfaces(fluid_.grid(), scene_, surfaces());
  try {
    place(0);
    fill_cells(0);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
  const double home = fluid_.grid().comm().sum(static_cast<double>(transfer_->at_home()));
  if (home != membranes_->vertices())
    throw InputError(fmt::format("cells: {} of {} vertices are nowhere in the grid: move the cells (center_um) into it",
                                 membranes_->vertices() - home, membranes_->vertices()));
  outflow_limit_ = scene_.time.stop_before_outflow_um;
  if (outflow_.distance < outflow_limit_) {
    outflow_limit_ = 0.5 * outflow_.distance;
    warn(
        "{}, where the end of the grid disturbs the flow: the run ends when {:.2g} um are left; move the cell (center_um) or "
        "lengthen the grid",
        nearest_outflow(), outflow_limit_);
  }
  measure_stability();
  find_softest();
  const double longest = *std::max_element(lengths_us_.begin(), lengths_us_.end());
  if (!(longest <= stable_us_))
    throw InputError(
        fmt::format("time.step_us: steps of {:.3g} us are too long for these membranes, which move with the fluid: above about "
                    "{:.3g} us{} they "
                    "would swing and grow. Reduce time.step_us{}",
                    longest, stable_us_, scene_.coupling->slip ? " with the slip correction" : "",
                    scene_.coupling->slip ? ", or set coupling.slip = false" : ""));
}

/// Forces and velocities are those at the step's end, where the last velocities bring the membranes, which then move by the
/// mean of the velocities at both ends: second order. Longer steps than half the largest stable one would swing then: those are
/// Euler's.
bool ForceCoupling::second_order(double dt) const {
  constexpr double margin = 0.45;
  return dt <= margin * stable_us_;
}

/// The viscosity that resists a membrane, over that outside: the mean of both sides' for waves along it, and never more than the
/// outer one, which is all that resists the slip.
double ForceCoupling::resisting_share() const {
  double share = 1;
  for (const auto& cell : scene_.cells) share = std::min(share, 0.5 * (1 + cell.viscosity_ratio));
  return share;
}

/// Forward Euler in a fluid whose viscosity alone resists: stable while dt times the fastest rate of relaxation is below two.
/// The rate is that of mobility times stiffness: the vertices' hydrodynamic interaction in an unbounded fluid, smeared over the
/// kernel, and the slip, which has no interaction and is largest for the finest modes.
void ForceCoupling::measure_stability() {
  constexpr double limit = 2;
  const double spacing = fluid_.grid().mean_spacing();
  const bool three = scene_.coupling->kernel == CouplingSettings::Kernel::three_point;
  update_surface_geometry(surfaces());
  MobilityModel model;
  model.viscosity = fluid_.viscosity() * resisting_share();
  model.radius = (three ? 0.91 : 1.25) * spacing;  // of a marker alone: Delong et al., J. Chem. Phys. 140, 2014
  model.slip = scene_.coupling->slip ? slip_of_membranes().law.coefficient * spacing : 0;
  stable_us_ = limit / membranes_->fastest_relaxation_per_us(model);
}

std::string ForceCoupling::stability_text(double dt) const {
  return fmt::format(
      "coupling: steps of {:.3g} us, of {} order; membranes that move with the fluid are stable up to about {:.3g} us", dt,
      second_order(dt) ? "second" : "first", stable_us_);
}

std::map<std::string, double> ForceCoupling::report(double dt) const {
  return {{"largest_stable_step_us", stable_us_}, {"margin", stable_us_ / dt}};
}

/// How far the fluid gets in two steps at the fastest that it has been: a cell that is nearer may leave the grid before it is
/// looked at again. A reference speed that is only the one told from rest says nothing of it.
double ForceCoupling::two_steps_um(double dt) const {
  const auto& fluid = fluid_.statistics();
  return 2 * dt * (fluid.reference_speed > quiet_speed_ ? fluid.reference_speed : fluid.speed);
}

bool ForceCoupling::at_outflow(double dt) const { return outflow_.distance < std::max(outflow_limit_, two_steps_um(dt)); }

std::string ForceCoupling::outflow_limit(double dt) const {
  const double two_steps = two_steps_um(dt);
  if (two_steps > outflow_limit_) return fmt::format("{:.3g} um, as far as the flow gets in two steps (time.step_us)", two_steps);
  return fmt::format("{:.3g} um (time.stop_before_outflow_um)", outflow_limit_);
}

std::string ForceCoupling::nearest_outflow() const {
  return outflow_.vertex < 0 ? ""
                             : fmt::format("{} is {:.3g} um from an outflow", vertex_text(outflow_.vertex), outflow_.distance);
}

/// Sums the ranks' parts.
void ForceCoupling::collect() {
  const Comm& comm = fluid_.grid().comm();
  if (comm.size() == 1) return;
  const auto& host = velocity_host_.read();
  comm.sum(host.data(), 3 * membranes_->vertices());
  velocity_host_.write();
}

/// How the fluid's force on membranes changes with their velocity, per area, where it does so least: the largest deformation of
/// one cell alone (a quadrupole of its size), or of all cells together, as the longest shear wave that the grid has room for.
double ForceCoupling::anticipated_reaction(double dt) const {
  const Softest& s = softest_;
  if (s.area == 0) return 0;
  const double mu = resisting_share() * fluid_.viscosity(), rho = fluid_.settings().density_pg_per_um3;
  const double depth = fluid_.grid().total_volume() / s.area;
  return std::min(3 * mu / s.radius, depth * (mu * s.wave_number_square + rho / dt));
}

void ForceCoupling::find_softest() {
  if (!membranes_->viscosity()) return;
  const double pi = std::acos(-1.0);
  const Grid& grid = fluid_.grid();
  double largest = 0;
  for (const auto& cell : membranes_->diagnostics()) {
    softest_.area += cell.area_um2;
    largest = std::max(largest, cell.area_um2);
  }
  softest_.radius = std::sqrt(largest / (4 * pi));
  double longest = 0, square = 0;
  for (int d = 0; d < 3; ++d) {
    const double length = grid.index().global[d] * mean_spacing(grid, d);
    longest = std::max(longest, length);
    const auto held = [&](const BoundarySettings& b) {
      return static_cast<int>(b.side) / 2 == d && (b.type == BoundarySettings::Type::wall || b.type == BoundarySettings::Type::moving_wall);
    };
    if (std::count_if(scene_.boundaries.begin(), scene_.boundaries.end(), held) == 2) square += std::pow(pi / length, 2);
  }
  softest_.wave_number_square = square > 0 ? square : std::pow(2 * pi / longest, 2);
}

StepStatistics ForceCoupling::advance(double time, double dt) {
  const SurfaceSet& set = surfaces();
  {
    const auto scope = timers_.scope("membrane");
    wrap();
    membranes_->set_out(second_order(dt) ? dt : 0);
    membranes_->remember_forces(forces());
    membranes_->compute_forces();
    update_surface_geometry(set);
  }
  {
    const auto scope = timers_.scope("transfer");
    place(time);
    fill_cells(time);
    {
      const auto membrane = timers_.scope("membrane");
      membranes_->resist(anticipated_reaction(dt), forces());
    }
    transfer_->spread(forces());
  }
  fluid_.solve(time + dt, nullptr);
  {
    const auto scope = timers_.scope("transfer");
    const SlipViews slip = slip_of_membranes();
    transfer_->interpolate(fluid_.flux(), fluid_.velocity(), scene_.coupling->slip ? &slip : nullptr, set.v);
    collect();
  }
  const auto scope = timers_.scope("membrane");
  membranes_->drift(dt, second_order(dt) ? 0.5 : 0);
  StepStatistics statistics;
  statistics.coupling_iterations = 1;
  statistics.substeps = 1;
  return statistics;
}

SlipViews ForceCoupling::slip_of_membranes() const {
  return transfer_->slip(surfaces(), forces(), fluid_.viscosity(), slip_share_);
}

double ForceCoupling::unresolved_dissipation() {
  if (!scene_.coupling->slip) return 0;
  return fluid_.grid().comm().sum(slip_power(transfer_->block(), slip_of_membranes(), transfer_->views()));
}

const Components<double>& ForceCoupling::tractions_for_output() {
  force_per_area(membranes_->vertices(), forces(), surfaces().area, -1, traction_);
  return traction_;
}

double ForceCoupling::power_on_cells() { return -power_of(membranes_->vertices(), membranes_->views().force, surfaces().v); }

std::vector<Triple> ForceCoupling::wrapped_by() const {
  std::vector<Triple> shift(membranes_->cells(), Triple{});
  if (!laps_.data()) return shift;
  const auto laps = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), laps_);
  for (std::size_t c = 0; c < shift.size(); ++c)
    for (int d = 0; d < 3; ++d)
      for (int m = 0; m < 3; ++m) shift[c][m] += laps(c, d) * frame_.period[d][m];
  return shift;
}

std::vector<double> ForceCoupling::state() const {
  std::vector<double> state;
  if (laps_.data()) {
    const auto laps = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), laps_);
    state.assign(laps.data(), laps.data() + laps.span());
  }
  const auto force = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), forces());
  for (int v = 0; v < membranes_->vertices(); ++v)
    for (int m = 0; m < 3; ++m) state.push_back(force(v, m));
  return state;
}

void ForceCoupling::set_state(const std::vector<double>& state) {
  auto at = state.begin();
  if (laps_.data()) {
    const auto laps = Kokkos::create_mirror_view(laps_);
    for (std::size_t i = 0; i < laps.span(); ++i) laps.data()[i] = static_cast<int>(*at++);
    Kokkos::deep_copy(laps_, laps);
  }
  const auto force = Kokkos::create_mirror_view(forces());
  for (int v = 0; v < membranes_->vertices(); ++v)
    for (int m = 0; m < 3; ++m) force(v, m) = *at++;
  Kokkos::deep_copy(forces(), force);
}

}  // namespace corpuscle
