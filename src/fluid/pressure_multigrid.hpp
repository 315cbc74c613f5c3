// The pressure equation of an orthogonal grid, matrix-free: conjugate gradients preconditioned by a multigrid cycle.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/pressure_cycle.hpp"

namespace corpuscle {

/// On the tube of 31 x 31 x 51 nodes with a cell it needs 10 iterations a step, where BoomerAMG on the whole matrix
/// needs 15 of more than twice the price.
class PressureMultigrid {
 public:
  /// @param coefficient  [cell] of the normal pressure difference, by direction (ViscousCoefficients::normal)
  PressureMultigrid(MultigridHierarchy& hierarchy, PressureCycle& cycle, const Array<double> (&coefficient)[3],
                    int max_iterations);

  /// Take over which nodes have a pressure, after the cycle's own update.
  void update(const PressureMask& mask);

  /// Solve for `x` [cell], from zero, until the residual's 2-norm is below `absolute_tolerance`, or ten digits below
  /// that of `rhs` (compact): then solve again for what is left. The `residual` returned is that of the start.
  KrylovResult solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance);

 private:
  Comm comm_;
  Halo* halo_;
  PressureCycle* cycle_;
  Array<double> coefficient_[3];
  int max_iterations_;
  LevelOperator<double> operator_;
  Array<double> p_, q_, r_;
};

}  // namespace corpuscle
