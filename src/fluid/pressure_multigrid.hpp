// The pressure equation of an orthogonal grid, matrix-free: conjugate gradients preconditioned by a multigrid cycle.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/conjugate_gradients.hpp"
#include "fluid/pressure_cycle.hpp"

namespace corpuscle {

/// On the tube of 31 x 31 x 51 nodes with a cell it needs 10 iterations a step, where BoomerAMG on the whole matrix
/// needs 15 of more than twice the price.
class PressureMultigrid {
 public:
  /// @param coefficient  [cell] of the normal pressure difference, by direction (ViscousCoefficients::normal)
  PressureMultigrid(MultigridHierarchy& hierarchy, PressureCycle& cycle, const Array<double> (&coefficient)[3], int max_iterations);

  /// Take over which nodes have a pressure, after the cycle's own update.
  void update(const PressureMask& mask);

  /// Solve for `x` [cell], from zero, until the residual's 2-norm is below `absolute_tolerance`, or ten digits below
  /// that of `rhs` (compact): then solve again for what is left. The `residual` returned is that of the start.
  KrylovResult solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance);

  /// Whether the host waits for every iteration's outcome, as it must where ranks add up. If not, a device goes on until as many are done
  /// as the last solve took, less one: the answer is the same, since iterations beyond the end change nothing.
  bool look_always = Kokkos::SpaceAccessibility<Kokkos::HostSpace, Memory>::accessible;

 private:
  Comm comm_;
  Halo* halo_;
  PressureCycle* cycle_;
  Array<double> coefficient_[3];
  int max_iterations_;
  int last_iterations_ = 0;
  LevelOperator<double> operator_;
  Array<double> p_, s_, w_, r_;
  Kokkos::View<Sums<CgProducts::count>, Memory> products_;
  HostCopy<Kokkos::View<Sums<CgProducts::count>, Memory>> products_host_;
  Kokkos::View<CgState, Memory> state_;
  HostCopy<Kokkos::View<CgState, Memory>> state_host_;
};

}  // namespace corpuscle
