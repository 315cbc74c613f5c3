// One multigrid cycle for the pressure equation, in single precision.
#pragma once

#include "fluid/coarsest_solver.hpp"
#include "fluid/multigrid_cycle.hpp"

namespace corpuscle {

/// The equation of the normal pressure differences: the whole of it on an orthogonal grid, and close to it on a skewed one.
/// Setting the cycle up for other immersed nodes costs less than one iteration, so it is done whenever they change.
class PressureCycle {
 public:
  using Cycle = MultigridCycle<Array<CycleReal>>;

  /// @param coarsest  what solves the coarsest level; null: what make_coarsest_solver() takes
  explicit PressureCycle(MultigridHierarchy& hierarchy, std::unique_ptr<CoarsestSolver> coarsest = nullptr);

  /// Take over the hierarchy's conductances. `pinned` as for pressure_rows.
  /// @throws ComputationError  on all ranks, when the coarsest level cannot be set up on any
  void update(int pinned);
  /// finest().x = one cycle for finest().b.
  void run();
  /// x = one cycle for b, compact vectors.
  void apply(const Array<double>& b, const Array<double>& x);
  /// On all ranks together. @throws ComputationError  on all of them, if a cycle since the last update() has failed on any
  void raise() { coarsest_->raise(); }

  Cycle::Level& finest() { return cycle_.levels()[0]; }
  const SmallLevels<Array<CycleReal>>& small_levels() const { return cycle_.small_levels(); }

 private:
  Cycle cycle_;
  std::unique_ptr<CoarsestSolver> coarsest_;
};

}  // namespace corpuscle
