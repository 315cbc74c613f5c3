// Membranes that cut the grid, coupled to the flow once a step or by iteration.
#pragma once

#include "core/anderson.hpp"
#include "coupling/sharp_coupling.hpp"

namespace corpuscle {

/// What both have in common: the Robin coefficient and the estimate of stability.
class MembraneCoupling : public SharpCoupling {
 public:
  MembraneCoupling(const Case& scene, FluidSolver& fluid, Timers& timers);

  void check_start() override;
  std::optional<StabilityEstimate> stability(double dt_us) const override;
  std::map<std::string, double> report(double dt_us) const override;
  bool at_outflow(double dt_us) const override;
  std::string nearest_outflow() const override;
  std::string outflow_limit(double dt_us) const override;

 protected:
  double default_beta(double dt_us) const;
  void check_beta(double dt_us) const;
  void place_bodies(double time, double dt);
  /// The fluid's stress on the membranes.
  /// @throws ComputationError  if a part of one is in a film that has no fluid nodes
  const SurfaceStress& load();

  Components<double> x_start_, v_interface_, residual_, previous_residual_;
  double beta_ = 0;         // Robin coefficient of the present step
  double quiet_speed_ = 0;  // um/us, below which cells count as at rest

 private:
  void watch_outflow();
  double two_steps_um(double dt_us) const;

  double outflow_limit_ = 0;                                                             // um
  double least_mass_per_area_ = 1e300, added_mass_per_area_ = 0, smallest_spacing_ = 0;  // pg/um2, pg/um2, um
};

/// coupling.scheme = "robin" and "loose": one fluid solve with the membrane's velocity on its surface, one membrane step
/// with the tractions, which with beta > 0 anticipates the fluid's reaction to the change of velocity.
class StaggeredCoupling : public MembraneCoupling {
 public:
  StaggeredCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers);
  void check_start() override;
  StepStatistics advance(double time_us, double dt_us) override;
  std::vector<double> state() const override { return {static_cast<double>(swings_), swing_start_}; }
  void set_state(const std::vector<double>& state) override { swings_ = static_cast<int>(state.at(0)), swing_start_ = state.at(1); }

 private:
  void require_stability(const StabilityEstimate& estimate) const;
  void watch_growth(double change, double speed_square);

  std::vector<double> lengths_us_;  // of all steps there will be
  int swings_ = 0;
  double swing_start_ = 0;  // sum of the vertices' squared speeds when they began
};

/// coupling.scheme = "iterated": a fixed point on the mean velocity of the interface over the step.
class IteratedCoupling : public MembraneCoupling {
 public:
  IteratedCoupling(const Case& scene, FluidSolver& fluid, Timers& timers);
  StepStatistics advance(double time_us, double dt_us) override;
  std::vector<double> state() const override { return {relaxation_}; }
  void set_state(const std::vector<double>& state) override { relaxation_ = state.at(0); }

 private:
  Components<double> x_predicted_, v_answer_;
  std::unique_ptr<AndersonAcceleration> anderson_;  // null for Aitken's relaxation
  double relaxation_ = 0.5;
};

}  // namespace corpuscle
