#include "coupling/flow_simulation.hpp"

#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/flow_checks.hpp"
#include "parallel/agree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

std::array<bool, 3> periodic_directions(const std::vector<BoundarySettings>& boundaries) {
  std::array<bool, 3> periodic{};
  for (const auto& b : boundaries)
    if (b.type == BoundarySettings::Type::periodic) periodic[static_cast<int>(b.side) / 2] = true;
  return periodic;
}

/// An iterated coupling cannot see changes below what the fluid's own solver leaves. A residual of 1e-8 of the velocity,
/// as 2-norms, left changes of 3e-4 in the interface's velocity on the tube: residuals are local, and the error is the
/// residual over the operator's lowest eigenvalue (0.03 there).
FluidSettings fluid_settings(const Case& scene) {
  FluidSettings settings = *scene.fluid;
  if (scene.coupling && scene.has_cells() && scene.coupling->scheme == CouplingSettings::Scheme::iterated)
    settings.momentum_tolerance = std::min(settings.momentum_tolerance, 1e-6 * scene.coupling->tolerance);
  // A pressure that follows within the step pushes a light membrane back harder than a staggered coupling anticipates: with
  // repeated projections cells of 1 to 100 pg in the tube swung and broke within 25 steps, at any step from 0.05 to 50 us.
  if (scene.has_cells()) settings.repeat_projection = false;
  return settings;
}

/// A gradient that nothing holds against is no mistake where the start is looked at, and no flow that settles.
void warn_of_free_fluid(const Case& scene) {
  using Type = BoundarySettings::Type;
  const Triple& g = scene.fluid->pressure_gradient_Pa_per_um;
  const double gradient = std::hypot(g[0], g[1], g[2]);
  if (gradient == 0 || !scene.bodies.empty() || std::any_of(scene.boundaries.begin(), scene.boundaries.end(), [](const auto& side) {
        return side.type != Type::periodic && side.type != Type::symmetry;
      }))
    return;
  warn(
      "fluid.pressure_gradient_Pa_per_um: with periodic or symmetry sides all round nothing holds the fluid: it goes ever faster, by "
      "{:.3g} "
      "mm/s in every ms, and means of speeds are of how long the run is; give the grid a wall, or drive it by moving walls",
      1e3 * gradient / scene.fluid->density_pg_per_um3);
}

/// Warns of cells that are to start drawn out to another volume.
/// @throws InputError  for cells drawn out so far that the first step would find their area senseless
void check_stretches(const Comm& comm, const Case& scene, Membranes& membranes) {
  constexpr double unlike = 0.02;
  for (std::size_t c = 0; c < scene.cells.size(); ++c) {
    const Triple& s = scene.cells[c].start_stretch;
    const double size = std::cbrt(s[0] * s[1] * s[2]);
    if (std::abs(size - 1) > unlike)
      warn(
          "cells.{}.start_stretch = [{:g}, {:g}, {:g}] is taken as [{:.3g}, {:.3g}, {:.3g}]: a cell that starts drawn out keeps its "
          "volume, so "
          "only the ratios count (another size: scale)",
          c, s[0], s[1], s[2], s[0] / size, s[1] / size, s[2] / size);
  }
  const auto starts_drawn = [](const CellSettings& cell) { return cell.start_stretch != Triple{1, 1, 1}; };
  if (std::none_of(scene.cells.begin(), scene.cells.end(), starts_drawn)) return;
  std::string wrong;
  const auto cells = membranes.diagnostics();
  for (std::size_t c = 0; c < cells.size() && wrong.empty(); ++c) {
    const int cell = static_cast<int>(c), number = membranes.number(cell);
    if (number >= static_cast<int>(scene.cells.size()) || !starts_drawn(scene.cells[number])) continue;
    if (!membranes.holds_area(cell)) continue;
    const double area = std::abs(cells[c].area_um2 / cells[c].rest_area_um2 - 1);
    if (area <= Membranes::senseless_area) continue;
    const Triple& stretch = scene.cells[number].start_stretch;
    wrong = fmt::format(
        "{}.start_stretch = [{:g}, {:g}, {:g}]: its membrane's area is {:.0f} % off that at rest then, a real one breaks at about "
        "{:.0f} %, and a run stops at {:.0f} %: draw the cell out less",
        membranes.name(cell), stretch[0], stretch[1], stretch[2], 100 * area, 100 * Membranes::lysis_area, 100 * Membranes::senseless_area);
  }
  wrong = agree(comm, wrong);
  if (!wrong.empty()) throw InputError(wrong);
}

}  // namespace

FlowSimulation::FlowSimulation(const Comm& comm, const Case& scene, Timers& timers, const PackedCells* packed)
    : timers_(timers), schedule_(scene.time, sudden_changes(scene.boundaries, scene.time.step_us)) {
  const auto scope = timers_.scope("set-up");
  grid_ = std::make_unique<Grid>(comm, make_node_source(*scene.grid), periodic_directions(scene.boundaries));
  check_prescribed_flow(*grid_, scene.boundaries);
  check_courses(scene.boundaries, schedule_);
  check_pressure_gradient(*grid_, scene.fluid->pressure_gradient_Pa_per_um);
  warn_of_free_fluid(scene);
  fluid_ = std::make_unique<FluidSolver>(*grid_, fluid_settings(scene), scene.boundaries, &*scene.grid, &timers_);
  if (scene.has_cells() || !scene.bodies.empty()) coupling_ = make_coupling(scene, schedule_, *fluid_, timers_, packed);
  // After the coupling, which refuses what its membranes do not stand: that is the shorter step, and another remedy.
  if (scene.has_cells()) {
    const bool viscous = coupling_->shared_cells() && membranes()->viscosity();
    if (const auto text = check_wall_strain(*grid_, scene.boundaries, schedule_.lengths_us().back(), viscous); !text.empty())
      warn("{}", text);
  }
  if (!membranes()) return;
  check_stretches(comm, scene, *membranes());
  membranes()->limit_area(Membranes::senseless_area);
  membranes()->limit_volume(Membranes::senseless_volume);
}

void FlowSimulation::step() {
  const double dt = next_step_us();
  fluid_->begin_step(dt);
  if (coupling_) {
    statistics_ = coupling_->advance(time_, dt);
  } else {
    fluid_->solve(time_ + dt, nullptr);
  }
  ++steps_;
  tick_ += schedule_.ticks(tick_);
  time_ = schedule_.time_us(tick_);
  last_step_ = dt;
}

std::string FlowSimulation::outflow_message() const {
  return fmt::format("a cell reached the outflow: {} at {:.6g} us, and the limit is {}", coupling_->nearest_outflow(), time_,
                     coupling_->outflow_limit(next_step_us()));
}

void FlowSimulation::resume(const Progress& progress) {
  tick_ = schedule_.tick_at(progress.time);
  if (tick_ < 0)
    throw InputError(
        fmt::format("no step of this case begins at {} us, where the checkpoint is: use another time.step_us or "
                    "time.first_step_us",
                    progress.time));
  constexpr double most = 2;  // beyond 1 + sqrt(2), errors of second-order backward differences grow (Hairer et al., III.5)
  if (progress.steps > 0 && next_step_us() > most * progress.last_step * (1 + 1e-9))
    throw InputError(
        fmt::format("the step can at most double at a restart: the checkpoint was written with steps of {} us, and "
                    "this case goes on with {} us; reduce time.step_us",
                    progress.last_step, next_step_us()));
  time_ = schedule_.time_us(tick_);
  last_step_ = progress.last_step;
  steps_ = progress.steps;
}

}  // namespace corpuscle
