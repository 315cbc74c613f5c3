// A scene with fluid, advanced in time: the flow, the bodies in it, and the coupling between them.
#pragma once

#include "coupling/anderson.hpp"
#include "coupling/immersed_flow.hpp"
#include "coupling/rigid_bodies.hpp"
#include "coupling/step_schedule.hpp"
#include "membrane/membranes.hpp"

#include <memory>

namespace corpuscle {

/// Stability of the coupling, estimated before the first step.
struct StabilityEstimate {
  double mass_term = 0;   // M / (A dt), pg/um2/us
  double beta = 0;        // Robin coefficient in use, pg/um2/us
  double viscous = 0, inertial = 0;  // half the largest reactions of the fluid
  double threshold() const { return viscous > inertial ? viscous : inertial; }
  double margin() const { return (mass_term + beta) / threshold(); }
};

struct StepStatistics {
  int coupling_iterations = 0, substeps = 0;
  double coupling_residual = 0;  // change of the interface velocity that one more iteration would make, relative
};

/// Only what the case asks for exists: without cells no membranes, without surfaces no search.
class FlowSimulation {
 public:
  /// @throws InputError  for settings that cannot work, a coupling that cannot be stable among them
  FlowSimulation(const Comm& comm, const Case& scene, Timers& timers);

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
  FluidSolver& fluid() { return *fluid_; }
  /// Null where the case has none.
  Membranes* membranes() { return membranes_.get(); }
  RigidBodies* rigid_bodies() { return rigid_bodies_.get(); }
  ImmersedFlow* immersed() { return immersed_.get(); }
  const SurfaceSet* surfaces() const { return surfaces_ ? surfaces_.get() : nullptr; }
  const StepStatistics& statistics() const { return statistics_; }
  /// For the next step.
  const StabilityEstimate& stability() const { return stability_; }
  int cells() const { return membranes_ ? membranes_->cells() : 0; }

  /// State beyond that of fluid and membranes, for checkpoints.
  struct Progress {
    double time = 0, relaxation = 0, last_step = 0;
    long steps = 0;
  };
  Progress progress() const { return {time_, relaxation_, last_step_, steps_}; }
  /// @throws InputError  no step of this case begins at that time, or a step more than twice as long as the last
  void resume(const Progress& progress);

  /// A vertex must keep this many grid spacings from walls: at the start, and later.
  static constexpr double starting_gap = 1.0, smallest_gap = 0.75;

 private:
  void make_surfaces();
  void check_start();
  void measure_stability();
  StabilityEstimate stability_of(double dt) const;
  void require_stability(const StabilityEstimate& estimate) const;
  void watch_growth(double change, double speed_square);
  void step_rigid(double dt);
  void step_staggered(double dt);
  void step_iterated(double dt);
  void place_bodies(double dt);
  void move_rigid_bodies(double time_us);

  Case scene_;
  Timers& timers_;
  std::unique_ptr<Grid> grid_;
  std::unique_ptr<FluidSolver> fluid_;
  std::unique_ptr<Membranes> membranes_;
  std::unique_ptr<SurfaceSet> surfaces_;
  std::unique_ptr<RigidBodies> rigid_bodies_;
  std::unique_ptr<ImmersedFlow> immersed_;
  Components<double> x_start_, x_predicted_, v_interface_, v_answer_, residual_, previous_residual_;
  std::unique_ptr<AndersonAcceleration> anderson_;
  StabilityEstimate stability_;
  double least_mass_per_area_ = 1e300, added_mass_per_area_ = 0, smallest_spacing_ = 0;  // pg/um2, pg/um2, um
  StepStatistics statistics_;
  double quiet_speed_ = 0;  // um/us, below which cells count as at rest
  int swings_ = 0;
  double swing_start_ = 0;  // sum of the vertices' squared speeds when they began
  StepSchedule schedule_;
  double time_ = 0, last_step_ = 0, relaxation_ = 0.5;
  long tick_ = 0, steps_ = 0;
};

}  // namespace corpuscle
