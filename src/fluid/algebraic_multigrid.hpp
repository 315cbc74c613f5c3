// hypre's BoomerAMG for a pressure equation.
#pragma once

#include "fluid/hypre_system.hpp"

struct hypre_Solver_struct;  // what hypre's HYPRE_Solver points to

namespace corpuscle {

class AlgebraicMultigrid {
 public:
  /// @param system  outlives this
  explicit AlgebraicMultigrid(HypreSystem& system) : system_(&system) {}
  ~AlgebraicMultigrid();
  AlgebraicMultigrid(const AlgebraicMultigrid&) = delete;
  AlgebraicMultigrid& operator=(const AlgebraicMultigrid&) = delete;

  /// For the matrix as it is now. @pre the system's set_values()
  /// @throws ComputationError  on all ranks, when hypre fails on any
  void set_up();
  /// x = one cycle from zero, a symmetric operator, on compact vectors. @pre set_up()
  /// What fails is left in the system's errors().
  void cycle(const Array<double>& rhs, const Array<double>& x);

 private:
  HypreSystem* system_;
  hypre_Solver_struct* amg_ = nullptr;
};

}  // namespace corpuscle
