// The pressure equation of an orthogonal grid, matrix-free: conjugate gradients preconditioned by a geometric multigrid
// cycle in single precision, whose coarsest level is left to BoomerAMG.
#pragma once

#include "fluid/multigrid_cycle.hpp"
#include "fluid/pressure_solver.hpp"

namespace corpuscle {

/// Setting it up for other immersed nodes costs less than one iteration, so it is done whenever they change.
/// On the tube of 31 x 31 x 51 nodes with a cell it needs 10 iterations a step, where BoomerAMG on the whole matrix
/// needs 15 of more than twice the price.
class PressureMultigrid {
 public:
  /// @param coefficient  [cell] of the normal pressure difference, by direction (ViscousCoefficients::normal)
  PressureMultigrid(MultigridHierarchy& hierarchy, const Array<double> (&coefficient)[3], int max_iterations);

  /// Take over which nodes have a pressure, after the hierarchy's own update. `pinned` as for pressure_rows.
  void update(const PressureMask& mask, int pinned);

  /// Solve for `x` [cell], from zero, until the residual's 2-norm is below `absolute_tolerance`, or ten digits below
  /// that of `rhs` (compact): then solve again for what is left. The `residual` returned is that of the start.
  KrylovResult solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance);

 private:
  using Cycle = MultigridCycle<Array<CycleReal>>;
  void solve_coarsest(Cycle::Level& level);

  Comm comm_;
  Halo* halo_;
  Array<double> coefficient_[3];
  int max_iterations_;
  Cycle cycle_;
  std::unique_ptr<PressureSolver> coarsest_;
  Array<double> coarse_rhs_, coarse_x_;
  LevelOperator<double> operator_;
  Array<double> p_, q_, r_;
};

}  // namespace corpuscle
