// One multigrid cycle for the pressure equation, in single precision, whose coarsest level is left to BoomerAMG.
#pragma once

#include "fluid/algebraic_multigrid.hpp"
#include "fluid/multigrid_cycle.hpp"

namespace corpuscle {

/// The equation of the normal pressure differences: the whole of it on an orthogonal grid, and close to it on a skewed one.
/// Setting the cycle up for other immersed nodes costs less than one iteration, so it is done whenever they change.
class PressureCycle {
 public:
  using Cycle = MultigridCycle<Array<CycleReal>>;

  explicit PressureCycle(MultigridHierarchy& hierarchy);

  /// Take over the hierarchy's conductances. `pinned` as for pressure_rows.
  void update(int pinned);
  /// finest().x = one cycle for finest().b.
  void run();
  /// x = one cycle for b, compact vectors.
  void apply(const Array<double>& b, const Array<double>& x);

  Cycle::Level& finest() { return cycle_.levels()[0]; }

 private:
  void solve_coarsest(Cycle::Level& level);

  Cycle cycle_;
  HypreSystem coarsest_;
  AlgebraicMultigrid amg_;
  Array<double> coarse_rhs_, coarse_x_;
};

}  // namespace corpuscle
