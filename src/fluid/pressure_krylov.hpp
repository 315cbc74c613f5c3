// hypre's flexible GMRES for the pressure equation of skewed grids.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/hypre_system.hpp"

#include <functional>

struct hypre_Solver_struct;  // what hypre's HYPRE_Solver points to

namespace corpuscle {

class PressureKrylov {
 public:
  /// z close to the inverse of A applied to r, on compact vectors.
  using Preconditioner = std::function<void(const Array<double>& r, const Array<double>& z)>;

  /// @param system  outlives this
  PressureKrylov(HypreSystem& system, Preconditioner preconditioner, int max_iterations);
  ~PressureKrylov();
  PressureKrylov(const PressureKrylov&) = delete;
  PressureKrylov& operator=(const PressureKrylov&) = delete;

  /// Solve for `x` from zero until the residual's 2-norm is below `absolute_tolerance`, or ten digits below that of
  /// `rhs`: then solve again for what is left. The `residual` returned is that of the start.
  /// @throws ComputationError  on all ranks, when hypre fails on any
  KrylovResult solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance);

 private:
  HypreSystem* system_;
  Preconditioner preconditioner_;
  hypre_Solver_struct* gmres_ = nullptr;
  bool ready_ = false;
};

}  // namespace corpuscle
