#include "fluid/pressure_krylov.hpp"

#include "fluid/hypre_stream.hpp"

#include <HYPRE_krylov.h>
#include <HYPRE_parcsr_ls.h>
#include <_hypre_parcsr_mv.h>
#include <KokkosBlas1_nrm2_squared.hpp>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// hypre wants a set-up function; ours is called when we decide, not on every solve.
HYPRE_Int keep_preconditioner(HYPRE_Solver, HYPRE_ParCSRMatrix, HYPRE_ParVector, HYPRE_ParVector) { return 0; }

/// hypre's vectors as views, for a preconditioner of ours; `solver` is the function.
HYPRE_Int call_preconditioner(HYPRE_Solver solver, HYPRE_ParCSRMatrix, HYPRE_ParVector b, HYPRE_ParVector x) {
  wait_for_hypre();
  const auto view = [](HYPRE_ParVector vector) {
    auto* local = hypre_ParVectorLocalVector(reinterpret_cast<hypre_ParVector*>(vector));
    return Array<double>(hypre_VectorData(local), hypre_VectorSize(local));
  };
  (*reinterpret_cast<PressureKrylov::Preconditioner*>(solver))(view(b), view(x));
  Exec().fence();
  return 0;
}

}  // namespace

PressureKrylov::PressureKrylov(HypreSystem& system, Preconditioner preconditioner, int max_iterations)
    : system_(&system), preconditioner_(std::move(preconditioner)) {
#ifdef CORPUSCLE_MPI
  const MPI_Comm handle = system.comm().handle();
#else
  const MPI_Comm handle = 0;
#endif
  HYPRE_ParCSRFlexGMRESCreate(handle, &gmres_);
  HYPRE_ParCSRFlexGMRESSetKDim(gmres_, std::min(max_iterations, 60));
  HYPRE_ParCSRFlexGMRESSetMaxIter(gmres_, max_iterations);
  HYPRE_ParCSRFlexGMRESSetTol(gmres_, 0);
  HYPRE_ParCSRFlexGMRESSetPrintLevel(gmres_, 0);
  HYPRE_ParCSRFlexGMRESSetPrecond(gmres_, call_preconditioner, keep_preconditioner, reinterpret_cast<HYPRE_Solver>(&preconditioner_));
  system.errors().check(HypreErrors::krylov);
  system.errors().raise(system.comm());
}

PressureKrylov::~PressureKrylov() {
  if (gmres_) HYPRE_ParCSRFlexGMRESDestroy(gmres_);
}

KrylovResult PressureKrylov::solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance) {
  constexpr double least_reduction = 1e-10;  // in one solve; round-off allows about 1e-12
  KrylovResult result;
  Kokkos::deep_copy(x, 0.0);
  const double start = std::sqrt(system_->comm().sum(KokkosBlas::nrm2_squared(rhs)));
  result.residual = start;
  if (!std::isfinite(start)) return result;
  const double tolerance = std::max(absolute_tolerance, least_reduction * start);
  if (start <= tolerance) {  // hypre does not report convergence where there is nothing to do
    result.converged = true;
    return result;
  }
  // Once only: hypre allocates the Krylov vectors anew, and loses the old ones, at every call.
  if (!ready_) HYPRE_ParCSRFlexGMRESSetup(gmres_, system_->matrix(), system_->rhs(), system_->x());
  ready_ = true;
  system_->load(rhs, x);
  HYPRE_ParCSRFlexGMRESSetAbsoluteTol(gmres_, tolerance);
  HYPRE_ParCSRFlexGMRESSolve(gmres_, system_->matrix(), system_->rhs(), system_->x());

  HYPRE_Int iterations = 0, converged = 0;
  HYPRE_FlexGMRESGetNumIterations(gmres_, &iterations);
  HYPRE_FlexGMRESGetConverged(gmres_, &converged);
  result.iterations = iterations;
  result.converged = converged != 0;
  system_->errors().check(HypreErrors::krylov);
  system_->read(x);
  system_->errors().raise(system_->comm());
  return result;
}

}  // namespace corpuscle
