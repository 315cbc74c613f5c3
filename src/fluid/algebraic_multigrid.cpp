#include "fluid/algebraic_multigrid.hpp"

#include <HYPRE_parcsr_ls.h>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace corpuscle {

namespace {

/// While it lives, hypre's loops run on the calling thread where there are so few rows that the other threads would cost
/// more than they save: some 170 launches a step on the coarsest level of a multigrid.
class HypreThreads {
 public:
  explicit HypreThreads([[maybe_unused]] int rows) {
#ifdef _OPENMP
    before_ = omp_get_max_threads();
    if (rows < fewest_rows) omp_set_num_threads(1);
#endif
  }
  ~HypreThreads() {
#ifdef _OPENMP
    omp_set_num_threads(before_);
#endif
  }
  HypreThreads(const HypreThreads&) = delete;
  HypreThreads& operator=(const HypreThreads&) = delete;

 private:
  static constexpr int fewest_rows = 2048;
  int before_ = 1;
};

HYPRE_Solver make_boomer_amg() {
  HYPRE_Solver amg = nullptr;
  HYPRE_BoomerAMGCreate(&amg);
  HYPRE_BoomerAMGSetTol(amg, 0);
  HYPRE_BoomerAMGSetMaxIter(amg, 1);
  HYPRE_BoomerAMGSetPrintLevel(amg, 0);
  HYPRE_BoomerAMGSetInterpType(amg, 6);  // extended+i
  HYPRE_BoomerAMGSetPMaxElmts(amg, 4);
#if defined(HYPRE_USING_GPU)
  HYPRE_BoomerAMGSetCoarsenType(amg, 8);  // PMIS
  HYPRE_BoomerAMGSetRelaxType(amg, 18);   // l1-Jacobi
  HYPRE_BoomerAMGSetStrongThreshold(amg, 0.25);
#else
  HYPRE_BoomerAMGSetCoarsenType(amg, 10);  // HMIS
  HYPRE_BoomerAMGSetRelaxType(amg, 8);     // l1-scaled hybrid symmetric Gauss-Seidel
  HYPRE_BoomerAMGSetStrongThreshold(amg, 0.25);
  HYPRE_BoomerAMGSetAggNumLevels(amg, 1);
#endif
  return amg;
}

}  // namespace

AlgebraicMultigrid::~AlgebraicMultigrid() {
  if (amg_) HYPRE_BoomerAMGDestroy(amg_);
}

void AlgebraicMultigrid::set_up() {
  const HypreThreads threads(system_->rows());
  if (amg_) HYPRE_BoomerAMGDestroy(amg_);
  amg_ = make_boomer_amg();
  HYPRE_BoomerAMGSetup(amg_, system_->matrix(), system_->rhs(), system_->x());
  system_->errors().check(HypreErrors::amg_set_up);
  system_->errors().raise(system_->comm());
}

void AlgebraicMultigrid::cycle(const Array<double>& rhs, const Array<double>& x) {
  const HypreThreads threads(system_->rows());
  Kokkos::deep_copy(x, 0.0);
  system_->load(rhs, x);
  HYPRE_BoomerAMGSolve(amg_, system_->matrix(), system_->rhs(), system_->x());
  system_->errors().check(HypreErrors::amg_cycle);
  system_->read(x);
}

}  // namespace corpuscle
