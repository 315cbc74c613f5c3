#include "coupling/force_coupling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/surface_checks.hpp"
#include "immersed/surface_geometry.hpp"
#include "parallel/agree.hpp"
#include "transfer/face_loss.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

/// What a coupling needs of a scene whose cells are shared out: on a rank nothing grows with the number of all cells.
Case without_cells(const Case& scene) {
  Case rest;
  rest.path = scene.path;
  rest.time = scene.time;
  rest.grid = scene.grid;
  rest.fluid = scene.fluid;
  rest.boundaries = scene.boundaries;
  rest.coupling = scene.coupling;
  rest.bodies = scene.bodies;
  return rest;
}

/// Along index direction d: the grid's volume over the area that it is swept with.
double mean_spacing(const Grid& grid, int d) {
  const IndexSpace index = grid.index();
  const Components<double> area = grid.views().face_area[d];
  const double swept = sum_owned("corpuscle::coupling::swept_area", index,
                                 KOKKOS_LAMBDA(int i, int j, int k) { return norm(load(area, index.cell(i, j, k))); });
  return grid.total_volume() / grid.comm().sum(swept);
}

/// The least and the greatest of the mean spacings along the grid's directions.
std::pair<double, double> spacings(const Grid& grid) {
  const double along[3] = {mean_spacing(grid, 0), mean_spacing(grid, 1), mean_spacing(grid, 2)};
  const auto [least, most] = std::minmax_element(along, along + 3);
  return {*least, *most};
}

/// Within which cells act on each other, um.
double contact_reach(const Case& scene) {
  if (!scene.contact) return 0;
  return std::max(scene.contact->range_um, scene.contact->aggregation_energy > 0 ? scene.contact->aggregation_range_um : 0.0);
}

}  // namespace

ForceCoupling::ForceCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers,
                             const PackedCells* packed)
    : scene_(without_cells(scene)),
      fluid_(fluid),
      timers_(timers),
      schedule_(schedule),
      lengths_us_(schedule.lengths_us()),
      workspace_(std::make_shared<Workspace>()),
      quiet_speed_(negligible_speed(scene, fluid.viscosity())) {
  take_places(scene, packed, contact_reach(scene));
  transfer_ = std::make_unique<Transfer>(fluid.grid(), scene.boundaries, scene.coupling->kernel, surfaces().vertices,
                                         workspace_);
  if (sharp_pressure()) transfer_->sharpen_pressure();
  if (!scene.bodies.empty()) {
    bodies_ = std::make_unique<SharpCoupling>(scene_, fluid, timers, nullptr);
    bodies_->immersed()->boundary().wrap(0, bodies_->surfaces().bodies, true);
  }
  if (CellLoads::wanted(scene))
    loads_ = std::make_unique<CellLoads>(scene, *cells_, *transfer_, fluid.grid(), fluid.viscosity(), workspace_,
                                         bodies_ ? bodies_->immersed() : nullptr);
  fluid.set_face_force(transfer_->faces());
  std::vector<double> ratios;
  for (const CellReference& type : membranes_->types()) ratios.push_back(type.viscosity_ratio);
  if (std::any_of(ratios.begin(), ratios.end(), [](double ratio) { return ratio != 1; })) {
    cytosol_ = std::make_unique<Cytosol>(fluid.grid(), ratios);
    fluid.set_viscosity(cytosol_->relative_viscosity(), cytosol_->least(), cytosol_->fluidity());
    if (scene.coupling->slip) transfer_->slip_between(ratios);
  }
  fluid.raise_reference_speed(quiet_speed_);
  take_up();
}

/// The vertices are others than before.
void ForceCoupling::take_up() {
  transfer_->take_up(surfaces());
  Kokkos::deep_copy(membranes_->views().force, 0.0);
  if (!scene_.coupling->slip) return;
  const std::size_t vertices = surfaces().vertices;
  if (followed_.extent(0) >= vertices) return Kokkos::deep_copy(followed_, 0.0);
  followed_ = Components<double>("corpuscle::coupling::followed", vertices, 1);
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

/// Where the vertices are in the grid.
/// @throws ComputationError  if one is outside
void ForceCoupling::place(double time) {
  transfer_->place(surfaces().x);
  check_all_at_home(time);
  watch_outflow();
}

/// Every vertex must lie in the grid once: one without a place would stand still, and nothing of it reach the fluid.
/// @throws ComputationError
void ForceCoupling::check_all_at_home(double time) {
  const Comm& comm = fluid_.grid().comm();
  if (comm.sum(static_cast<double>(transfer_->at_home())) == static_cast<double>(vertices())) return;
  const Components<double> times("corpuscle::coupling::times_at_home", surfaces().vertices, 3);
  transfer_->mark_at_home(times);
  cells_->add_copies(times);
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), times);
  together([&] {
    for (int v = 0; v < surfaces().own_vertices; ++v)
      if (host(v, 0) != 1)
        throw ComputationError(
            host(v, 0) == 0 && time == 0
                ? fmt::format("{} is outside the grid at the start: move the cell (center_um), or use a larger grid", vertex_text(v))
            : host(v, 0) == 0
                ? fmt::format("{} is outside the grid at {:.6g} us. Likely cause: a cell pressed against a wall, where nothing but the "
                              "flow keeps it away, or a step too long; reduce time.step_us or move the cell (center_um)",
                              vertex_text(v), time)
                : fmt::format("{} lies in {:g} places of the grid at {:.6g} us, which comes to lie upon itself there: use a wider bend "
                              "(grid) or a smaller grid.diameter_um",
                              vertex_text(v), host(v, 0), time));
  });
}

void ForceCoupling::watch_outflow() {
  outflow_ = {};
  for (const auto& boundary : scene_.boundaries) {
    const int side = static_cast<int>(boundary.side), d = side / 2, end = side % 2;
    const auto& lattice = transfer_->block().lattice;
    if (boundary.type != BoundarySettings::Type::outflow || !(end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d]))
      continue;
    const NearSide near = nearest_to_side(transfer_->block(), transfer_->views(), d, end);
    if (near.distance < outflow_.distance) outflow_ = near;
  }
  const double least = fluid_.grid().comm().min(outflow_.distance);
  if (outflow_.distance > least) outflow_ = {least, -1};
}

/// The viscosity, with the membranes where place() found them.
/// @throws ComputationError  if there is no saying what is inside them
void ForceCoupling::fill_cells(double time) {
  if (!cytosol_) return;
  cytosol_->update(*transfer_, surfaces(), {membranes_->views().type, cells_->turns()});
  if (cytosol_->broken())
    throw ComputationError(
        fmt::format("what is inside the cells cannot be told at {:.6g} us: a triangle of a membrane reaches over more than two "
                    "spacings of the grid. Use more vertices (cells.vertices) or a coarser grid (grid.nodes)",
                    time));
}

/// @throws ComputationError  if some of the jumps of pressure would be missed
void ForceCoupling::check_jumps(double time) {
  if (!sharp_pressure()) return;
  together([&] {
    if (transfer_->reach_too_far(surfaces()))
      throw ComputationError(fmt::format(
          "where the pressure jumps cannot be told at {:.6g} us: a triangle of a membrane reaches over more than two spacings of "
          "the grid. Use more vertices (cells.vertices), a coarser grid (grid.nodes), or coupling.pressure = \"spread\"",
          time));
  });
}

void ForceCoupling::check_start() {
  const Comm& comm = fluid_.grid().comm();
  if (grows_) inflate();
  if (small_) membranes_->rest_at_size(packed_->size);
  cells_->to_copies(surfaces().x, true);
  update_surface_geometry(surfaces());
  std::vector<int> types;
  for (const CellRecord& cell : cells_->own()) types.push_back(cell.type);
  std::string wrong;
  std::vector<CoarseSurface> coarse;
  try {
    coarse = check_surfaces(fluid_.grid(), scene_, surfaces(), types);
  } catch (const InputError& error) {
    wrong = error.what();
  }
  wrong = agree(comm, wrong);
  if (!wrong.empty()) throw InputError(wrong);
  coarse_ = warn_of_coarse(worst_of_types(comm, static_cast<int>(membranes_->types().size()), coarse));
  check_bodies();
  try {
    place(0);
    fill_cells(0);
    check_jumps(0);
  } catch (const ComputationError& error) {  // before the first step it is the input that is wrong
    throw InputError(error.what());
  }
  outflow_limit_ = scene_.time.stop_before_outflow_um;
  if (outflow_.distance < outflow_limit_) {
    outflow_limit_ = 0.5 * outflow_.distance;
    warn(
        "{}, where the end of the grid disturbs the flow: the run ends when {:.2g} um are left instead of "
        "time.stop_before_outflow_um = {:g}; move the cell (center_um) or lengthen the grid",
        nearest_outflow(), outflow_limit_, scene_.time.stop_before_outflow_um);
  }
  warn_of_image();
  if (packing_ && !small_) check_packing();
  find_softest();
  measure_stability();
  if (loads_) loads_->look_at_start(lengths_us_.front());
  if (small_) return membranes_->rest_at_size(1);
  warn_of_walls();
  warn_of_pressed_start();
  refuse_long_steps();
}

/// @throws InputError
void ForceCoupling::refuse_long_steps() const {
  const double longest = *std::max_element(lengths_us_.begin(), lengths_us_.end());
  if (!(longest <= stable_us_))
    throw InputError(
        fmt::format("time.step_us: steps of {:.3g} us are too long for these membranes, which move with the fluid: above about "
                    "{:.3g} us{} they "
                    "would swing and grow. Reduce time.step_us{}",
                    longest, stable_us_, scene_.coupling->slip ? " with the slip correction" : "",
                    scene_.coupling->slip ? ", or set coupling.slip = false" : ""));
}

/// A cell that is alone meets itself beyond periodic sides.
void ForceCoupling::warn_of_image() const {
  constexpr double near = 0.25;  // of its extent
  if (cells_->total() != 1 || (loads_ && loads_->report())) return;
  std::string text;
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces().x);
  for (int d = 0; d < 3 && !cells_->own().empty(); ++d) {
    if (!fluid_.grid().index().periodic[d]) continue;
    const Triple& period = fluid_.grid().period(d);
    const double length = std::hypot(period[0], period[1], period[2]);
    double low = 1e300, high = -1e300;
    for (int v = 0; v < membranes_->vertices(); ++v) {
      const double along = (x(v, 0) * period[0] + x(v, 1) * period[1] + x(v, 2) * period[2]) / length;
      low = std::min(low, along), high = std::max(high, along);
    }
    if (length - (high - low) < near * (high - low))
      text = fmt::format("{} is {:.3g} um from its own image beyond a periodic side, and there is no [contact]: that they cross would "
                         "not be seen; add [contact], or use a larger grid",
                         body_name(surfaces(), 0), length - (high - low));
  }
  text = agree(fluid_.grid().comm(), text);
  if (!text.empty()) warn("{}", text);
}

/// Of the largest stable step: up to there steps are of second order.
constexpr double second_order_share = 0.54;

/// Forces and velocities are those at the step's end, where the last velocities bring the membranes, which then move by the
/// mean of the velocities at both ends: second order. Longer steps than half the largest stable one would swing then: those are
/// Euler's.
bool ForceCoupling::second_order(double dt) const { return dt <= second_order_share * stable_us_; }

/// The viscosity that resists a membrane, over that outside: the mean of both sides' for waves along it, and never more than the
/// outer one, which is all that resists the slip.
double ForceCoupling::resisting_share() const {
  double share = 1;
  for (const CellReference& type : membranes_->types()) share = std::min(share, 0.5 * (1 + type.viscosity_ratio));
  return share;
}

/// Where beta alone stands for the fluid's answer, short waves wait for it, 1 / (beta m) steps where a wave's mobility is m.
void ForceCoupling::anticipate_short_waves(const MobilityModel& model, const std::vector<int>& numbers) {
  constexpr double share = 0.5;  // unstable above 4/3
  const double resistance = fluid_.grid().comm().max(membranes_->largest_resistance(model, numbers));
  short_waves_ = resistance > 0 ? share / resistance : 0;
  membranes_->take_share_of_resistance(short_waves_);
}

/// Forward Euler in a fluid whose viscosity alone resists: stable while dt times the fastest rate of relaxation is below two.
/// The rate is that of mobility times stiffness: the vertices' hydrodynamic interaction in an unbounded fluid, smeared over the
/// kernel, and the slip, which has no interaction and is largest for the finest modes. A quarter less, since a load stiffens the
/// membrane: two cells pressed together broke within 24 steps as long as the estimate, and within 68 of 0.9 times that. Dipoles of
/// one plane wave give half a spacing; capsules of a tenth to a fifth of the viscosity outside swing as if they gave two.
void ForceCoupling::measure_stability() {
  constexpr double limit = 1.5, of_dipoles = 2;
  const auto [narrowest, widest] = spacings(fluid_.grid());
  update_surface_geometry(surfaces());
  MobilityModel model;
  model.viscosity = fluid_.viscosity() * resisting_share();
  model.radius = transfer_->marker_radius() * narrowest;
  if (scene_.coupling->slip) {
    model.slip = slip_of_membranes().law.coefficient * transfer_->largest_slip() * widest;
    model.dipole = of_dipoles * transfer_->largest_dipole() * resisting_share() * widest;
    model.width = 0.8 * narrowest;
  }
  // Of each type the same cell on any number of ranks: what slip is held to goes by this.
  std::vector<int> numbers = membranes_->first_of_types();
  for (int& number : numbers) number = static_cast<int>(fluid_.grid().comm().min(number));
  // Of the longest step: shorter ones meet more inertia, by less than they are shorter.
  const double beta = anticipated_reaction(*std::max_element(lengths_us_.begin(), lengths_us_.end()));
  anticipate_short_waves(model, numbers);
  const double fastest =
      std::max(membranes_->fastest_relaxation_per_us(model, numbers, beta), loads_ ? loads_->fastest_relaxation_per_us() : 0);
  stable_us_ = limit / fluid_.grid().comm().max(fastest);
}

std::string ForceCoupling::stability_text(double dt) const {
  return fmt::format(
      "coupling: steps of {:.3g} us, of {} order; membranes that move with the fluid are stable up to about {:.3g} us{}", dt,
      second_order(dt) ? "second" : "first", stable_us_, scene_.coupling->slip ? " with the slip correction (coupling.slip)" : "");
}

std::map<std::string, double> ForceCoupling::report(double dt) const {
  std::map<std::string, double> figures{{"largest_stable_step_us", stable_us_}, {"margin", stable_us_ / dt}};
  if (contact_report()) figures["contact_linear_below_um"] = loads_->knee_um(dt);
  return figures;
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
  const std::string text =
      outflow_.vertex < 0 ? "" : fmt::format("{} is {:.3g} um from an outflow", vertex_text(outflow_.vertex), outflow_.distance);
  return agree(fluid_.grid().comm(), text);
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
  softest_ = {};
  const double pi = std::acos(-1.0);
  const Grid& grid = fluid_.grid();
  double largest = 0;
  for (const auto& cell : membranes_->diagnostics()) {
    softest_.area += cell.area_um2;
    largest = std::max(largest, cell.area_um2);
  }
  softest_.area = grid.comm().sum(softest_.area);
  softest_.radius = std::sqrt(grid.comm().max(largest) / (4 * pi));
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
  const double ahead = second_order(dt) ? dt : 0;
  {
    const auto scope = timers_.scope("membrane");
    begin_step(time, dt, ahead);
  }
  if (bodies_) bodies_->move_bodies(time + dt);
  {
    const auto scope = timers_.scope("membrane");
    membranes_->set_out(ahead);
    cells_->to_copies(surfaces().x, true);
    if (loads_ && ahead > 0) loads_->limit_ahead();
    together([&] { membranes_->compute_forces(); });
    update_surface_geometry(surfaces());
  }
  {
    const auto scope = timers_.scope("transfer");
    place(time);
    fill_cells(time);
    check_jumps(time);
    if (loads_) {
      const auto contact = timers_.scope("contact");
      loads_->gather(dt, second_order(dt));
    }
    {
      const auto membrane = timers_.scope("membrane");
      together([&] { membranes_->resist(anticipated_reaction(dt), fluid_.step_ratio(), forces()); });
    }
    cells_->to_copies(forces());
    if (scene_.coupling->slip) limit_slip(dt);
    membranes_->forget_geometry();
    const SlipViews slip = slip_of_membranes();
    const SlipViews* const used = scene_.coupling->slip ? &slip : nullptr;
    if (sharp_pressure())
      transfer_->spread(forces(), surfaces(), used);
    else
      transfer_->spread(forces(), used);
  }
  if (bodies_)
    bodies_->solve_flow(time + dt);
  else
    fluid_.solve(time + dt, nullptr);
  {
    const auto scope = timers_.scope("transfer");
    const SlipViews slip = slip_of_membranes();
    transfer_->interpolate(fluid_.flux(), fluid_.velocity(), scene_.coupling->slip ? &slip : nullptr, surfaces().v);
    cells_->add_copies(surfaces().v);
  }
  {
    const auto scope = timers_.scope("membrane");
    together([&] { membranes_->drift(dt); });
  }
  if (loads_) after_move(time + dt, dt);
  StepStatistics statistics;
  statistics.coupling_iterations = 1;
  statistics.substeps = 1;
  return statistics;
}

/// Slip is stiff: all that grows with the stiffness is left to the grid's velocity once a step could no longer follow.
void ForceCoupling::limit_slip(double dt) {
  const double most = (second_order(dt) ? second_order_share : 1.0) * stable_us_ / dt;
  const Array<double> share(followed_.data(), followed_.extent(0));
  membranes_->measure_stiffening(share);
  corpuscle::limit_slip(membranes_->vertices(), most, share);
  cells_->to_copies(followed_);
}

/// Cells that have come to this rank, copies that are others than before, and bodies that have come back through a side, are looked at
/// where the last step left them.
void ForceCoupling::begin_step(double time, double dt, double ahead) {
  const bool others = cells_->begin_step(ahead);
  if (!others && !(loads_ && loads_->bodies_turned())) return;
  if (others) take_up();
  if (!loads_) return;
  loads_->take_up();
  update_copies();
  look(time, dt);
}

/// @throws ComputationError  where surfaces cross since a membrane is torn, of the membrane
void ForceCoupling::look(double time, double dt) {
  try {
    loads_->look(time, dt);
  } catch (const ComputationError&) {  // on all ranks
    together([&] { membranes_->compute_forces(); });
    throw;
  }
}

void ForceCoupling::update_copies() {
  cells_->to_copies(surfaces().x, true);
  cells_->to_copies(surfaces().v);
}

/// Of the step after one of dt: where steps grow it is longer, and what contact lists must reach further.
double ForceCoupling::next_step_us(double time, double dt) const {
  const long tick = schedule_.tick_at(time);
  return tick >= 0 && tick < schedule_.end() ? schedule_.step_us(tick) : dt;
}

/// What contact holds back has no part in the projection of velocities on no change of volume: cells that are pressed onto a body, or
/// each other, step after step, would shrink. What they lose goes elsewhere.
void ForceCoupling::hold_volume() {
  constexpr double noticed = 5e-5;  // half of what a run warns of
  constexpr int rounds = 10;        // each leaves the share of a cell's surface that is held
  for (int n = 0; n < rounds && fluid_.grid().comm().max(membranes_->volume_taken()) > noticed; ++n) {
    membranes_->give_volume_back();
    update_copies();
    loads_->limit_ahead();
  }
}

void ForceCoupling::after_move(double time, double dt) {
  const auto scope = timers_.scope("contact");
  update_copies();
  if (loads_->limit_approach(time)) hold_volume();
  look(time, next_step_us(time, dt));
  loads_->note_wall_gap();
}

void ForceCoupling::resume(double time) {
  if (bodies_) bodies_->resume(time);
  if (!loads_) return;
  if (loads_->bodies_turned()) loads_->take_up();
  update_copies();
  look(time, next_step_us(time, lengths_us_.front()));
}

SlipViews ForceCoupling::slip_of_membranes() const {
  const Array<int> type = cytosol_ ? membranes_->views().type : Array<int>();
  return transfer_->slip(surfaces(), forces(), fluid_.viscosity(), type, loads_ ? loads_->gaps() : Array<double>(), followed_);
}

double ForceCoupling::unresolved_dissipation() {
  double loss = face_loss(fluid_.grid().views(), fluid_.kind(), transfer_->faces(), fluid_.flux(), fluid_.velocity(), fluid_.pressure());
  if (scene_.coupling->slip) loss += slip_power(transfer_->block(), slip_of_membranes(), transfer_->views());
  return fluid_.grid().comm().sum(loss) + loss_beside_bodies();
}

double ForceCoupling::power_on_sides() {
  const auto moves = [](const BoundarySettings& b) { return b.type == BoundarySettings::Type::moving_wall; };
  if (std::none_of(scene_.boundaries.begin(), scene_.boundaries.end(), moves)) return 0;
  return power_on_sides(fluid_.velocity());
}

double ForceCoupling::power_on_sides(const Components<double>& of_sides) {
  return fluid_.grid().comm().sum(transfer_->power_on_sides(forces(), of_sides));
}

const Components<double>& ForceCoupling::tractions_for_output() {
  if (bodies_) bodies_->tractions_for_output();
  const std::size_t vertices = membranes_->vertices();
  traction_ = Components<double>(workspace_->reserve(3 * vertices), vertices, 3);
  force_per_area(membranes_->vertices(), forces(), surfaces().area, -1, traction_);
  return traction_;
}

double ForceCoupling::power_on_cells() {
  const double here = power_of(membranes_->vertices(), membranes_->views().force, surfaces().v);
  return -fluid_.grid().comm().sum(here);
}

std::vector<Triple> ForceCoupling::wrapped_by() const {
  std::vector<Triple> shift;
  for (const CellRecord& cell : cells_->own()) shift.push_back(cells_->wrapped_by(cell));
  return shift;
}

/// Where the cells are is known at once: a run may end with its checkpoint, at an outflow.
void ForceCoupling::cells_restored(double time) {
  cells_->to_copies(surfaces().x, true);
  take_up();
  if (loads_) loads_->take_up();
  place(time);
}

}  // namespace corpuscle
