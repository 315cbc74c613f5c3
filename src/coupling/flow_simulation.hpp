// A scene with fluid, advanced in time: the flow, and the coupling to the bodies in it.
#pragma once

#include "coupling/coupling.hpp"

#include <memory>

namespace corpuscle {

/// Only what the case asks for exists: without cells no membranes, without surfaces no coupling and no search.
class FlowSimulation {
 public:
  /// @throws InputError  for settings that cannot work, a coupling that cannot be stable among them
  /// @param packed  cells of populations where an earlier run had packed them; null: they are packed now
  FlowSimulation(const Comm& comm, const Case& scene, Timers& timers, const PackedCells* packed = nullptr);

  /// One step of the schedule.
  /// @throws ComputationError  when anything breaks down; the message says what, where and why
  void step();

  double time() const { return time_; }
  /// Length of the next step, and of the last one (0 before the first).
  double next_step_us() const { return schedule_.step_us(tick_); }
  double last_step_us() const { return last_step_; }
  const StepSchedule& schedule() const { return schedule_; }
  long steps() const { return steps_; }
  long steps_left() const { return schedule_.steps_from(tick_); }
  bool done() const { return tick_ >= schedule_.end(); }

  Grid& grid() { return *grid_; }
  Timers& timers() { return timers_; }
  FluidSolver& fluid() { return *fluid_; }
  /// Null where the case has none.
  Coupling* coupling() { return coupling_.get(); }
  Membranes* membranes() { return coupling_ ? coupling_->membranes() : nullptr; }
  RigidBodies* rigid_bodies() { return coupling_ ? coupling_->rigid_bodies() : nullptr; }
  ImmersedFlow* immersed() { return coupling_ ? coupling_->immersed() : nullptr; }
  const SurfaceSet* surfaces() const { return coupling_ ? &coupling_->surfaces() : nullptr; }
  const StepStatistics& statistics() const { return statistics_; }
  /// Whether a cell has come so near to an outflow that the run should end, and a text that says which, where and when.
  bool at_outflow() const { return coupling_ && coupling_->at_outflow(next_step_us()); }
  std::string outflow_message() const;
  /// Of the whole scene.
  int cells() { return coupling_ ? coupling_->cells() : 0; }
  /// Null where all ranks have all cells.
  SharedCells* shared_cells() { return coupling_ ? coupling_->shared_cells() : nullptr; }

  /// State beyond that of fluid, bodies and coupling, for checkpoints.
  struct Progress {
    double time = 0, last_step = 0;
    long steps = 0;
  };
  Progress progress() const { return {time_, last_step_, steps_}; }
  /// @throws InputError  no step of this case begins at that time, or a step more than twice as long as the last
  void resume(const Progress& progress);

 private:
  Timers& timers_;
  std::unique_ptr<Grid> grid_;
  std::unique_ptr<FluidSolver> fluid_;
  std::unique_ptr<Coupling> coupling_;
  StepStatistics statistics_;
  StepSchedule schedule_;
  double time_ = 0, last_step_ = 0;
  long tick_ = 0, steps_ = 0;
};

}  // namespace corpuscle
