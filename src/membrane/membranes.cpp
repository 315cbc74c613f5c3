#include "membrane/membranes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.hpp"
#include "membrane/copies.hpp"
#include "membrane/drift.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane/membrane_viscosity.hpp"
#include "membrane/stiffness.hpp"

namespace corpuscle {

namespace {

constexpr int estimate_period = 100;  // calls of advance between estimates of the stiffness; the shape changes little
constexpr int power_iterations = 30;  // gives the largest eigenvalue to about 5 %, well inside the margin of 0.3
constexpr double step_margin = 0.3;   // of the largest stable step: links stiffen up to fivefold before they break
constexpr double volume_rate = 1e-3;  // share of V0 per us by which a cell that starts away from V0 is brought there
constexpr int most_retries = 4;
constexpr int most_substeps = 10000;  // a minute or so for one cell

/// The first of the cells and their vertices.
MembraneViews up_to(MembraneViews views, int cells, int vertices) {
  views.cells = cells;
  views.vertices = vertices;
  return views;
}

/// Norm of the modes of some of the cells, the largest.
double largest_of(const StiffnessViews& work, const std::vector<int>& cells) {
  const auto sums = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), work.sums);
  double largest = 0;
  for (int c : cells) largest = std::max(largest, std::sqrt(sums(c * sections, 0)));
  return largest;
}

}  // namespace

CellTypes find_cell_types(const std::vector<CellSettings>& cells) {
  CellTypes types;
  std::vector<const CellSettings*> representative;
  for (const CellSettings& cell : cells) {
    const auto known =
        std::find_if(representative.begin(), representative.end(), [&](const CellSettings* other) { return same_type(cell, *other); });
    types.of_cell.push_back(int(known - representative.begin()));
    if (known != representative.end()) continue;
    representative.push_back(&cell);
    types.references.push_back(make_reference(cell));
  }
  return types;
}

Membranes::Membranes(const std::vector<CellSettings>& cells, const std::vector<TriangleMesh>& rigid_bodies) {
  const CellTypes types = find_cell_types(cells);
  types_ = types.references;
  std::vector<TriangleMesh> bodies;
  std::vector<HeldCell> held;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    bodies.push_back(placed_mesh(types_[types.of_cell[c]], cells[c]));
    held.push_back({types.of_cell[c], int(c)});
  }
  describe_cells(held, int(held.size()));
  bodies.insert(bodies.end(), rigid_bodies.begin(), rigid_bodies.end());
  views_ = make_membrane_views(make_surface_set(bodies, int(cells.size())), types_, types.of_cell);
  type_of_own_ = types.of_cell;
  elasticity_ = make_law_(types_, type_of_own_);
  motion_ = make_motion_views(views_);
  const auto label = [](const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); };
  status_host_ = HostCopy(views_.status);
  start_x_ = Components<double>(label("start_x_vertex"), views_.vertices, 3);
  start_v_ = Components<double>(label("start_v_vertex"), views_.vertices, 3);
  make_viscosity();
  if (viscosity_) viscosity_->make_room(views_);
}

void Membranes::take_law(ElasticityMaker make) {
  make_law_ = std::move(make);
  elasticity_ = make_law_(types_, type_of_own_);
  forget_stiffness();
}

void Membranes::make_viscosity() {
  bool viscous = false, tangential = false;
  for (const CellReference& type : types_) {
    viscous |= type.law.central_damping > 0;
    tangential |= type.law.tangential_damping > 0;
  }
  if (viscous) viscosity_ = std::make_unique<MembraneViscosity>(tangential);
}

std::vector<Components<double>> Membranes::carried() const {
  std::vector<Components<double>> fields{views_.surface.x, views_.surface.v};
  if (viscosity_)
    for (const Components<double>& field : viscosity_->carried()) fields.push_back(field);
  return fields;
}

Membranes::~Membranes() = default;

void Membranes::estimate_stiffness() {
  if (views_.cells == 0) return;
  take_workspace();
  const StiffnessViews work = make_stiffness_views(views_);
  const Array<double> eigenvalue(uninitialised("corpuscle::membrane::eigenvalue_cell"), views_.cells);
  largest_stiffness(views_, *elasticity_, work, power_iterations, eigenvalue, parts_);
  forget_geometry();
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), eigenvalue);
  stiffness_.assign(host.data(), host.data() + views_.cells);
  for (int c = 0; c < views_.cells; ++c) {
    if (!(stiffness_[c] > 0) || !std::isfinite(stiffness_[c])) explain(c, 0);
  }
}

double Membranes::stable_step_us() {
  estimate_stiffness();
  double step = 1e300;
  for (int c = 0; c < views_.cells; ++c) {
    step = std::min(step, step_margin * 2 * std::sqrt(vertex_mass_[c] / stiffness_[c]));
  }
  return step;
}

double Membranes::largest_stiffness_nN_per_um() {
  estimate_stiffness();
  return stiffness_.empty() ? 0 : *std::max_element(stiffness_.begin(), stiffness_.end());
}

int Membranes::substeps(double dt_us, double beta) const {
  double step = dt_us;
  for (std::size_t c = 0; c < stiffness_.size(); ++c) {
    // Largest stable step of (m + c dt) v' = m v - dt k x, x' = x + dt v': k dt^2 = 2 (2 m + c dt).
    const double stiff = stiffness_[c] / (step_margin * step_margin), drag = beta * vertex_area_[c];
    step = std::min(step, (drag + std::sqrt(drag * drag + 4 * vertex_mass_[c] * stiff)) / stiff);
  }
  const double count = std::ceil(dt_us / step * (1 - 1e-12));
  if (!(count <= most_substeps)) {
    throw ComputationError(
        fmt::format("membrane: a step of {:.3g} us would take {:.3g} sub-steps of {:.3g} us; reduce "
                    "time.step_us or raise cells.mass_pg ({} are the most)",
                    dt_us, count, step, most_substeps));
  }
  return std::max(1, int(count));
}

void Membranes::compute_forces() {
  if (views_.cells == 0) return;
  take_workspace();
  Kokkos::deep_copy(views_.status, 0);
  elasticity_->membrane_forces(views_, views_.surface.x, views_.force, parts_);
  if (const int cell = trouble(); cell >= 0) explain(cell, 0);
}

void Membranes::resist(double beta, double ahead, const Components<double>& force) {
  if (std::exchange(resists_anew_, false)) ahead = 0;
  if (!viscosity_ || views_.cells == 0) return;
  Kokkos::deep_copy(views_.status, 0);
  take_geometry();
  viscosity_->resist(views_, *workspace_, beta, ahead, force);
  if (const int cell = trouble(); cell >= 0) explain(cell, 0);
}

void Membranes::measure_stiffening(const Array<double>& stiffening) {
  if (views_.cells == 0) return;
  take_geometry();
  elasticity_->measure_stiffening(views_, stiffening);
}

template <class Load>
void Membranes::take_substeps(int count, double dt, const Load& load) {
  for (int s = 0; s < count; ++s) {
    measure_membranes(views_, views_.surface.x);
    elasticity_->evaluate_triangles(views_, views_.surface.x);
    if (viscosity_) {
      viscosity_->predict_velocity(views_, motion_, load, dt);
    } else {
      predict_velocity(views_, motion_, load, dt);
    }
    project_and_move(views_, motion_, dt, volume_rate);
  }
}

void Membranes::take_substeps(int count, double dt, const SurfaceStress& stress, double beta, const Components<double>& v_star) {
  if (stress.values.extent(0) == 0) {
    take_substeps(count, dt, NoLoad{});
  } else if (beta == 0) {
    take_substeps(count, dt, FluidLoad{stress});
  } else {
    take_substeps(count, dt, RobinLoad{{stress}, v_star, beta});
  }
}

int Membranes::advance(double dt_us, const SurfaceStress& stress, double beta, const Components<double>& v_star) {
  if (views_.cells == 0) return 0;
  if (beta > 0 && (stress.values.extent(0) == 0 || v_star.extent(0) == 0)) {
    throw ComputationError("membrane: an anticipated reaction (beta > 0) needs both stress and v_star");
  }
  if (calls_ % estimate_period == 0 || stiffness_.empty()) estimate_stiffness();
  ++calls_;
  // The solver of the volume constraint starts from nothing, so that a step depends on the state alone.
  if (viscosity_) Kokkos::deep_copy(motion_.direction, 0.0);
  const int planned = substeps(dt_us, beta);
  copy_motion(views_.vertices, views_.surface.x, views_.surface.v, start_x_, start_v_);
  for (int attempt = 0; attempt <= most_retries; ++attempt) {
    const int count = planned << attempt;
    Kokkos::deep_copy(views_.status, 0);
    take_substeps(count, dt_us / count, stress, beta, v_star);
    if (trouble() < 0) return count;
    copy_motion(views_.vertices, start_x_, start_v_, views_.surface.x, views_.surface.v);
  }
  // Once more, sub-step by sub-step, up to where it goes wrong: what is there to see tells the cause.
  const int count = planned << most_retries;
  Kokkos::deep_copy(views_.status, 0);
  int cell = -1;
  for (int s = 0; s < count && cell < 0; ++s) {
    take_substeps(1, dt_us / count, stress, beta, v_star);
    cell = trouble();
  }
  if (cell < 0) return count;
  explain(cell, dt_us);
}

void Membranes::set_out(double ahead_us) {
  drifts_ = true;
  share_ahead_ = ahead_us > 0 ? 0.5 : 0;
  corpuscle::set_out(views_.vertices, views_.surface.x, views_.surface.v, ahead_us, share_ahead_, start_x_);
}

void Membranes::drift(double dt) {
  if (views_.cells == 0) return;
  take_geometry();
  Kokkos::deep_copy(views_.status, 0);
  measure_drift(views_, motion_);
  project_and_drift(views_, motion_, start_x_, (1 - share_ahead_) * dt);
  measure_membranes(views_, views_.surface.x);
  measure_drift(views_, motion_);
  restore_volume(views_, motion_, volume_rate * dt);
  forget_geometry();
  if (const int cell = trouble(); cell >= 0) explain(cell, 0);
}

double Membranes::volume_taken() {
  if (views_.cells == 0) return 0;
  take_workspace();  // which others have had in between
  measure_membranes(views_, views_.surface.x);
  return largest_volume_change(views_, motion_);
}

void Membranes::give_volume_back() {
  if (views_.cells == 0) return;
  take_workspace();
  measure_drift(views_, motion_);
  corpuscle::give_volume_back(views_, motion_);
  forget_geometry();
}

void Membranes::limit_volume(double share) {
  constexpr double farther = 1.1;  // than at the start
  views_.most_volume = share;
  for (const CellReference& type : types_)
    views_.most_volume = std::max(views_.most_volume, farther * std::abs(volume(type.mesh) / type.law.rest_volume - 1));
}

std::vector<int> Membranes::cells_of(const std::vector<int>& numbers) const {
  std::vector<int> cells;
  for (int c = 0; c < views_.cells; ++c)
    if (std::find(numbers.begin(), numbers.end(), number(c)) != numbers.end()) cells.push_back(c);
  return cells;
}

double Membranes::fastest_relaxation_per_us(const MobilityModel& model, const std::vector<int>& numbers, double beta) {
  const std::vector<int> cells = cells_of(numbers);
  return cells.empty() ? 0 : fastest_relaxation(model, cells, beta);
}

/// Power iteration on what answer(cells, work) makes of the mode and respond(cell, first, last, work) of that; the cells are those up
/// to the last one asked for.
template <class Answer, class Response>
double Membranes::largest_response(const std::vector<int>& cells, const Answer& answer, const Response& respond) {
  take_geometry();
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.first_vertex);
  const MembraneViews up_to_last = up_to(views_, cells.back() + 1, first(cells.back() + 1));
  const StiffnessViews work = make_stiffness_views(up_to_last);
  start_mode(up_to_last, work);
  for (int i = 0; i < power_iterations; ++i) {
    answer(up_to_last, work);
    for (int c : cells) respond(c, first(c), first(c + 1), work);
  }
  forget_geometry();
  return largest_of(work, cells);
}

double Membranes::largest_resistance(const MobilityModel& model, const std::vector<int>& numbers) {
  const std::vector<int> cells = cells_of(numbers);
  if (cells.empty() || !viscosity_) return 0;
  return largest_response(
      cells, [this](const MembraneViews& m, const StiffnessViews& work) { viscosity_->damp(m, *workspace_, work); },
      [&](int c, int first, int last, const StiffnessViews& work) { apply_mobility(views_, model, c, first, last, work); });
}

/// Power iteration on (R + D) under stiffness, R what MembraneViscosity takes for the fluid's resistance, times twice D over R + D: what D
/// does not resist, as waves across the membrane, is of no account.
double Membranes::fastest_held_relaxation_per_us(const std::vector<int>& numbers, double beta) {
  const std::vector<int> cells = cells_of(numbers);
  if (cells.empty() || !viscosity_ || !workspace_ || beta <= 0) return 0;
  return largest_response(
      cells,
      [&](const MembraneViews& up_to_last, const StiffnessViews& work) {
        elastic_answer(up_to_last, work);
        viscosity_->relieve(up_to_last, *workspace_, beta, work);
        for (int times = 0; times < 2; ++times) {
          Kokkos::deep_copy(work.mode, work.probe);  // D v
          viscosity_->relieve(up_to_last, *workspace_, beta, work);
        }
        take_workspace();
      },
      [](int c, int first, int last, const StiffnessViews& work) { take_mode(work.force_ahead, c, first, last, work); });
}

/// work.mode = the forces that the unit mode is met with; the other arrays are overwritten.
void Membranes::elastic_answer(const MembraneViews& m, const StiffnessViews& work) {
  constexpr double distance = 1e-4;  // um, as for the stiffness
  displace(m, work, distance);
  elasticity_->membrane_forces(m, work.probe, work.force_ahead, parts_);
  displace(m, work, -distance);
  elasticity_->membrane_forces(m, work.probe, work.force_behind, parts_);
  difference_forces(m, work, distance);
}

void Membranes::take_share_of_resistance(double share) {
  if (viscosity_) viscosity_->take_share(share);
}

/// Power iteration on mobility times stiffness, for some of the cells. Of a mode with mobility m, stiffness k and membrane viscosity l
/// the force follows f' = (l (1 - b m) f - b k x) / (b + l), b = beta A: Euler's steps are stable up to 2 / (m k) (1 + l (2 / b - m)),
/// which is at least 2 (b + l) / (b m k) as long as b m < 1. Such a mode relaxes as if at rates b / (b + l) times as fast.
double Membranes::fastest_relaxation(const MobilityModel& model, const std::vector<int>& cells, double beta) {
  const bool viscous = viscosity_ && workspace_ && beta > 0;
  return largest_response(
      cells,
      [&](const MembraneViews& up_to_last, const StiffnessViews& work) {
        elastic_answer(up_to_last, work);
        if (!viscous) return;
        viscosity_->relieve(up_to_last, *workspace_, beta, work);
        take_workspace();
      },
      [&](int c, int first, int last, const StiffnessViews& work) { apply_mobility(views_, model, c, first, last, work); });
}

int Membranes::trouble() { return status_host_.read()(0) - 1; }

void Membranes::explain_area(int cell, double drift) const {
  throw ComputationError(fmt::format(
      "membrane: the area of {} has changed by {:.0f} %, and a real membrane breaks at about {:.0f} %. Likely cause: the load is too "
      "large, from a push, a fast or sudden flow or a channel too narrow for the cell, or the grid too coarse to tell (grid.nodes), or "
      "the step too long (time.step_us); reduce the flow (the boundaries' velocities, fluid.pressure_gradient_Pa_per_um) or the push "
      "(push_nN), lengthen its ramp_us, widen the channel, or raise its area_modulus_uN_per_m",
      name(cell), 100 * drift, 100 * lysis_area));
}

void Membranes::explain_volume(int cell, double drift) const {
  throw ComputationError(fmt::format(
      "membrane: the volume of {} is off by {:.1f} %, and nothing goes through a membrane. Likely cause: it is pressed against others, a "
      "wall or a rigid body harder than contact can hold, which takes room that it has nowhere else, or the step is too long: reduce "
      "time.step_us, the flow (the boundaries' velocities, fluid.pressure_gradient_Pa_per_um) or the push (push_nN), or refine "
      "grid.nodes",
      name(cell), 100 * drift));
}

void Membranes::explain(int cell, double dt) {
  const CellDiagnostics now = diagnostics()[cell];
  const bool finite = std::isfinite(now.area_um2) && std::isfinite(now.volume_um3) && std::isfinite(now.stretch);
  const double drift = std::abs(now.area_um2 / now.rest_area_um2 - 1);
  if (dt > 0) copy_motion(views_.vertices, start_x_, start_v_, views_.surface.x, views_.surface.v);
  if (finite && now.stretch < strain_limit(law_[cell]) && drift > views_.most_area) explain_area(cell, drift);
  const double lost = now.volume_um3 / now.rest_volume_um3 - 1;
  if (finite && now.stretch < strain_limit(law_[cell]) && std::abs(lost) > views_.most_volume) explain_volume(cell, lost);
  const CellDiagnostics before = diagnostics()[cell];
  const std::string reached = stretch_text(law_[cell], now.stretch);
  const std::string was = dt > 0 ? fmt::format(" ({} before)", stretch_text(law_[cell], before.stretch)) : "";
  const std::string where =
      fmt::format("{} at ({:.2f}, {:.2f}, {:.2f}) um", name(cell), before.centroid_um[0], before.centroid_um[1], before.centroid_um[2]);
  const char* robin = drifts_ ? "" : " or coupling.robin_coefficient_pg_per_um2_per_us";
  const std::string step =
      dt > 0 ? fmt::format(" within a step of {:.3g} us, even in {} times as many sub-steps", dt, 1 << most_retries) : std::string();
  if (finite) {
    throw ComputationError(
        fmt::format("membrane overstretched: {}: {}{}{}. The load is too large or the coupling unstable: reduce time.step_us or the "
                    "load, or raise its shear_modulus_uN_per_m{}",
                    where, reached, step, was, robin));
  }
  throw ComputationError(
      fmt::format("membrane position is not finite: {}{}{}. The traction on it is not finite or the step too long: reduce "
                  "time.step_us{}{}",
                  where, step, was, drifts_ ? "" : ", or raise its mass_pg", robin));
}

void Membranes::save_state() {
  if (!saved_) {
    saved_ = std::make_unique<Snapshot>();
    saved_->x = Components<double>(uninitialised("corpuscle::membrane::saved_x_vertex"), views_.vertices, 3);
    saved_->v = Components<double>(uninitialised("corpuscle::membrane::saved_v_vertex"), views_.vertices, 3);
  }
  copy_motion(views_.vertices, views_.surface.x, views_.surface.v, saved_->x, saved_->v);
  saved_->stiffness = stiffness_;
  saved_->calls = calls_;
}

void Membranes::restore_state() {
  if (!saved_) throw ComputationError("membrane: restore_state without save_state");
  copy_motion(views_.vertices, saved_->x, saved_->v, views_.surface.x, views_.surface.v);
  stiffness_ = saved_->stiffness;
  calls_ = saved_->calls;
}

std::vector<CellDiagnostics> Membranes::diagnostics() {
  if (views_.cells == 0) return {};
  using Column = CellColumn;
  const Table<double> table(uninitialised("corpuscle::membrane::diagnostics_cell"), views_.cells, Column::count);
  take_workspace();
  elasticity_->measure_cells(views_, table);
  forget_geometry();
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), table);
  std::vector<CellDiagnostics> all(views_.cells);
  for (int c = 0; c < views_.cells; ++c) {
    CellDiagnostics& d = all[c];
    for (int k = 0; k < 3; ++k) {
      d.centroid_um[k] = host(c, Column::centroid + k);
      d.velocity_um_per_us[k] = host(c, Column::velocity + k);
      d.lower_um[k] = host(c, Column::lower + k);
      d.upper_um[k] = host(c, Column::upper + k);
    }
    d.area_um2 = host(c, Column::area);
    d.volume_um3 = host(c, Column::volume);
    d.rest_area_um2 = rest_area_[c];
    d.rest_volume_um3 = rest_volume_[c];
    d.springs_fJ = host(c, Column::springs);
    d.bending_fJ = host(c, Column::bending);
    d.global_area_fJ = host(c, Column::global_area);
    d.local_area_fJ = host(c, Column::local_area);
    d.volume_fJ = host(c, Column::global_volume);
    d.stretch = host(c, Column::stretch);
  }
  return all;
}

double Membranes::kinetic_energy_fJ() const { return kinetic_energy(views_); }

double Membranes::dissipation_nW() const { return viscosity_ ? viscosity_->dissipation(views_) : 0; }

std::vector<double> Membranes::state() const {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.x);
  const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.v);
  std::vector<double> state{double(calls_)};
  for (int c = 0; c < views_.cells; ++c) state.push_back(stiffness_.empty() ? 0 : stiffness_[c]);
  for (int i = 0; i < views_.vertices; ++i) {
    for (int d = 0; d < 3; ++d) state.push_back(x(i, d));
    for (int d = 0; d < 3; ++d) state.push_back(v(i, d));
  }
  return state;
}

void Membranes::set_state(const std::vector<double>& state) {
  const std::size_t expected = 1 + views_.cells + 6 * std::size_t(views_.vertices);
  if (state.size() != expected) {
    throw InputError(
        fmt::format("membrane state of {} numbers: these {} cells of {} vertices take {}; restart with the "
                    "case that wrote the checkpoint",
                    state.size(), views_.cells, views_.vertices, expected));
  }
  auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.x);
  auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.v);
  auto at = state.begin();
  calls_ = long(*at++);
  stiffness_.assign(at, at + views_.cells);
  if (calls_ == 0) stiffness_.clear();
  at += views_.cells;
  for (int i = 0; i < views_.vertices; ++i) {
    for (int d = 0; d < 3; ++d) x(i, d) = *at++;
    for (int d = 0; d < 3; ++d) v(i, d) = *at++;
  }
  Kokkos::deep_copy(views_.surface.x, x);
  Kokkos::deep_copy(views_.surface.v, v);
}

}  // namespace corpuscle
