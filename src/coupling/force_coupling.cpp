#include "coupling/force_coupling.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "coupling/surface_checks.hpp"
#include "immersed/surface_geometry.hpp"
#include "parallel/agree.hpp"
#include "transfer/delta.hpp"
#include "transfer/face_loss.hpp"
#include "transfer/slip.hpp"
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

/// Within which cells act on each other, um. What slip is left to a vertex that a rank's faces feel, up to a kernel's reach and the half
/// of a cell beyond the halo, depends on what is within the slip's reach of it.
double contact_reach(const Case& scene, const Grid& grid) {
  if (!scene.contact) return 0;
  constexpr double beyond_halo = FourPointDelta::reach + 0.5 - IndexSpace::halo;  // spacings, less than none
  return std::max({scene.contact->range_um, scene.contact->aggregation_energy > 0 ? scene.contact->aggregation_range_um : 0.0,
                   scene.coupling->slip ? slip_reach * grid.largest_spacing() + beyond_halo * grid.smallest_spacing() : 0.0});
}

}  // namespace

ForceCoupling::ForceCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers, const PackedCells* packed)
    : scene_(without_cells(scene)),
      fluid_(fluid),
      timers_(timers),
      schedule_(schedule),
      lengths_us_(schedule.lengths_us()),
      workspace_(std::make_shared<Workspace>()),
      quiet_speed_(negligible_speed(scene, fluid.viscosity())) {
  take_places(scene, packed, contact_reach(scene, fluid.grid()));
  transfer_ = std::make_unique<Transfer>(fluid.grid(), scene.boundaries, scene.coupling->kernel, surfaces().vertices, workspace_);
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
    transfer_->find_corners();
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
  return fmt::format("{}, vertex {} at ({:.4g}, {:.4g}, {:.4g}) um", body_name(set, cell), vertex - first(cell), x(vertex, 0), x(vertex, 1),
                     x(vertex, 2));
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
  limit_outflow();
  warn_of_image();
  if (packing_ && !small_) check_packing();
  find_softest();
  measure_stability();
  if (loads_) loads_->look_at_start(lengths_us_.front());
  warn_of_ratios();
  if (!small_) {
    warn_of_walls();
    warn_of_pressed_start();
    refuse_long_steps();
  } else {
    membranes_->rest_at_size(1);
  }
  drawn_out_.clear();
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
      together([&] { membranes_->resist(anticipated_reaction(dt), carried_on(dt) * fluid_.step_ratio(), forces()); });
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
  membranes_->forget_geometry();
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

CellEnergy ForceCoupling::energy_of_cells(double dt_us) {
  CellEnergy energy;
  const bool has_slip = scene_.coupling->slip;
  const SlipViews slip = has_slip ? slip_of_membranes() : SlipViews{};
  energy.on_cells = -power_of(membranes_->vertices(), membranes_->views().force, surfaces().v);
  const auto moves = [](const BoundarySettings& b) { return b.type == BoundarySettings::Type::moving_wall; };
  if (std::any_of(scene_.boundaries.begin(), scene_.boundaries.end(), moves))
    energy.on_sides = transfer_->power_on_sides(forces(), fluid_.velocity(), has_slip ? &slip : nullptr);
  energy.unresolved =
      face_loss(fluid_.grid().views(), fluid_.kind(), transfer_->faces(), fluid_.flux(), fluid_.velocity(), fluid_.pressure());
  if (has_slip) energy.unresolved += slip_power(transfer_->block(), slip, transfer_->views());
  const double beside_bodies = loss_beside_bodies();  // of all ranks
  if (fluid_.grid().comm().rank() == 0) energy.unresolved += beside_bodies;
  if (loads_) energy.contact = loads_->contact_energy(dt_us);
  return energy;
}

double ForceCoupling::power_on_sides(const Components<double>& of_sides) {
  const SlipViews slip = slip_of_membranes();
  return fluid_.grid().comm().sum(transfer_->power_on_sides(forces(), of_sides, scene_.coupling->slip ? &slip : nullptr));
}

const Components<double>& ForceCoupling::tractions_for_output() {
  if (bodies_) bodies_->tractions_for_output();
  const std::size_t vertices = membranes_->vertices();
  traction_ = Components<double>(workspace_->reserve(3 * vertices), vertices, 3);
  force_per_area(membranes_->vertices(), forces(), surfaces().area, -1, traction_);
  return traction_;
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
