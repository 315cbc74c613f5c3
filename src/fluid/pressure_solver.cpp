#include "fluid/pressure_solver.hpp"

#include "core/error.hpp"

#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_krylov.h>
#include <HYPRE_parcsr_ls.h>
#include <_hypre_parcsr_mv.h>
#include <KokkosBlas1_nrm2_squared.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#if (defined(KOKKOS_ENABLE_CUDA) && !defined(HYPRE_USING_CUDA)) || \
    (defined(KOKKOS_ENABLE_HIP) && !defined(HYPRE_USING_HIP))
#error "Kokkos runs on the GPU but hypre was built for the host: build hypre for the same GPU back end"
#endif
#if !defined(CORPUSCLE_MPI) && !defined(HYPRE_SEQUENTIAL)
#error "this build has no MPI but hypre has: ./setup.sh --no-mpi builds one without"
#endif

namespace corpuscle {

namespace {

/// hypre wants a set-up function; ours is called when we decide, not on every solve.
HYPRE_Int keep_preconditioner(HYPRE_Solver, HYPRE_ParCSRMatrix, HYPRE_ParVector, HYPRE_ParVector) { return 0; }

/// hypre's vectors as views, for a preconditioner of ours; `solver` is the function.
HYPRE_Int call_preconditioner(HYPRE_Solver solver, HYPRE_ParCSRMatrix, HYPRE_ParVector b, HYPRE_ParVector x) {
  const auto view = [](HYPRE_ParVector vector) {
    auto* local = hypre_ParVectorLocalVector(reinterpret_cast<hypre_ParVector*>(vector));
    return Array<double>(hypre_VectorData(local), hypre_VectorSize(local));
  };
  (*reinterpret_cast<std::function<void(const Array<double>&, const Array<double>&)>*>(solver))(view(b), view(x));
  Exec().fence();
  return 0;
}

void start_hypre_once() {
  static bool started = false;
  if (started) return;
#if HYPRE_RELEASE_NUMBER >= 22900
  HYPRE_Initialize();
#else
  HYPRE_Init();
#endif
#if defined(HYPRE_USING_GPU)
  HYPRE_SetMemoryLocation(HYPRE_MEMORY_DEVICE);
  HYPRE_SetExecutionPolicy(HYPRE_EXEC_DEVICE);
#endif
  started = true;
}

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

struct PressureSolver::Hypre {
  HYPRE_IJMatrix matrix = nullptr;
  HYPRE_IJVector rhs = nullptr, x = nullptr;
  HYPRE_ParCSRMatrix a = nullptr;
  HYPRE_ParVector b = nullptr, y = nullptr;
  HYPRE_Solver gmres = nullptr, amg = nullptr;
  ~Hypre() {
    if (amg) HYPRE_BoomerAMGDestroy(amg);
    if (gmres) HYPRE_ParCSRFlexGMRESDestroy(gmres);
    if (x) HYPRE_IJVectorDestroy(x);
    if (rhs) HYPRE_IJVectorDestroy(rhs);
    if (matrix) HYPRE_IJMatrixDestroy(matrix);
  }
};

PressureSolver::PressureSolver(const Comm& comm, const IndexSpace& index, Halo& halo, bool skewed, int max_iterations)
    : hypre_(std::make_unique<Hypre>()), comm_(comm), pattern_(RowPattern::make(skewed)) {
  start_hypre_once();
  rows_ = index.owned();
  value_ = Table<double>("corpuscle::fluid::pressure_value", rows_, pattern_.count);
  slot_ = Table<int>(uninitialised("corpuscle::fluid::pressure_slot"), rows_, pattern_.count);
  row_ = Array<int>(uninitialised("corpuscle::fluid::pressure_row"), rows_);
  row_length_ = Array<int>(uninitialised("corpuscle::fluid::pressure_row_length"), rows_);

  // Rows are numbered rank by rank; a rank's first row is the sum of the owned cells of the ranks before it.
  int first = 0;
#ifdef CORPUSCLE_MPI
  MPI_Exscan(&rows_, &first, 1, MPI_INT, MPI_SUM, comm_.handle());
  if (comm_.root()) first = 0;
  const MPI_Comm handle = comm_.handle();
#else
  const MPI_Comm handle = 0;
#endif
  Array<int> number("corpuscle::fluid::row_number", index.size());
  Kokkos::deep_copy(number, -1);
  number_rows(index, first, number);
  halo.exchange(number);
  Table<int> column(uninitialised("corpuscle::fluid::pressure_column"), rows_, pattern_.count);
  pressure_columns(index, number, pattern_, column);

  const int entries = assign_slots(column, first, pattern_.count, slot_, row_, row_length_);
  packed_ = Array<double>("corpuscle::fluid::pressure_packed", entries);
  column_ = Array<int>(uninitialised("corpuscle::fluid::pressure_packed_column"), entries);
  pack_entries(column, slot_, column_);
  Exec().fence();

  const HYPRE_BigInt lower = first, upper = first + rows_ - 1;
  HYPRE_IJMatrixCreate(handle, lower, upper, lower, upper, &hypre_->matrix);
  HYPRE_IJMatrixSetObjectType(hypre_->matrix, HYPRE_PARCSR);
  for (auto* v : {&hypre_->rhs, &hypre_->x}) {
    HYPRE_IJVectorCreate(handle, lower, upper, v);
    HYPRE_IJVectorSetObjectType(*v, HYPRE_PARCSR);
    HYPRE_IJVectorInitialize(*v);
    HYPRE_IJVectorAssemble(*v);
  }
  HYPRE_IJVectorGetObject(hypre_->rhs, reinterpret_cast<void**>(&hypre_->b));
  HYPRE_IJVectorGetObject(hypre_->x, reinterpret_cast<void**>(&hypre_->y));
  HYPRE_ParCSRFlexGMRESCreate(handle, &hypre_->gmres);
  HYPRE_ParCSRFlexGMRESSetKDim(hypre_->gmres, std::min(max_iterations, 60));
  HYPRE_ParCSRFlexGMRESSetMaxIter(hypre_->gmres, max_iterations);
  HYPRE_ParCSRFlexGMRESSetTol(hypre_->gmres, 0);
  HYPRE_ParCSRFlexGMRESSetPrintLevel(hypre_->gmres, 0);
}

PressureSolver::~PressureSolver() = default;

void PressureSolver::set_values() {
  pack_entries(value_, slot_, packed_);
  Exec().fence();
  HYPRE_IJMatrixInitialize(hypre_->matrix);
  HYPRE_IJMatrixSetValues(hypre_->matrix, rows_, row_length_.data(), row_.data(), column_.data(), packed_.data());
  HYPRE_IJMatrixAssemble(hypre_->matrix);
  HYPRE_IJMatrixGetObject(hypre_->matrix, reinterpret_cast<void**>(&hypre_->a));
}

void PressureSolver::set_up() {
  if (hypre_->amg) HYPRE_BoomerAMGDestroy(hypre_->amg);
  hypre_->amg = make_boomer_amg();
  HYPRE_BoomerAMGSetup(hypre_->amg, hypre_->a, hypre_->b, hypre_->y);
  HYPRE_ParCSRFlexGMRESSetPrecond(hypre_->gmres, HYPRE_BoomerAMGSolve, keep_preconditioner, hypre_->amg);
}

void PressureSolver::precondition_with(std::function<void(const Array<double>&, const Array<double>&)> apply) {
  preconditioner_ = std::move(apply);
  HYPRE_ParCSRFlexGMRESSetPrecond(hypre_->gmres, call_preconditioner, keep_preconditioner,
                                  reinterpret_cast<HYPRE_Solver>(&preconditioner_));
}

void PressureSolver::load(const Array<double>& rhs, const Array<double>& x) {
  Exec().fence();
  HYPRE_IJVectorInitialize(hypre_->rhs);
  HYPRE_IJVectorSetValues(hypre_->rhs, rows_, row_.data(), rhs.data());
  HYPRE_IJVectorAssemble(hypre_->rhs);
  HYPRE_IJVectorInitialize(hypre_->x);
  HYPRE_IJVectorSetValues(hypre_->x, rows_, row_.data(), x.data());
  HYPRE_IJVectorAssemble(hypre_->x);
}

void PressureSolver::cycle(const Array<double>& rhs, const Array<double>& x) {
  Kokkos::deep_copy(x, 0.0);
  load(rhs, x);
  HYPRE_BoomerAMGSolve(hypre_->amg, hypre_->a, hypre_->b, hypre_->y);
  HYPRE_ClearAllErrors();
  HYPRE_IJVectorGetValues(hypre_->x, rows_, row_.data(), x.data());
}

KrylovResult PressureSolver::solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance) {
  constexpr double least_reduction = 1e-10;  // in one solve; round-off allows about 1e-12
  KrylovResult result;
  Kokkos::deep_copy(x, 0.0);
  const double start = std::sqrt(comm_.sum(KokkosBlas::nrm2_squared(rhs)));
  const double tolerance = std::max(absolute_tolerance, least_reduction * start);
  result.residual = start;
  if (start <= tolerance) {  // hypre does not report convergence where there is nothing to do
    result.converged = true;
    return result;
  }
  // Once only: hypre allocates the Krylov vectors anew, and loses the old ones, at every call.
  if (!krylov_ready_) HYPRE_ParCSRFlexGMRESSetup(hypre_->gmres, hypre_->a, hypre_->b, hypre_->y);
  krylov_ready_ = true;
  load(rhs, x);
  HYPRE_ParCSRFlexGMRESSetAbsoluteTol(hypre_->gmres, tolerance);
  HYPRE_ParCSRFlexGMRESSolve(hypre_->gmres, hypre_->a, hypre_->b, hypre_->y);
  HYPRE_ClearAllErrors();

  HYPRE_Int iterations = 0, converged = 0;
  HYPRE_FlexGMRESGetNumIterations(hypre_->gmres, &iterations);
  HYPRE_FlexGMRESGetConverged(hypre_->gmres, &converged);
  result.iterations = iterations;
  result.converged = converged != 0;
  HYPRE_IJVectorGetValues(hypre_->x, rows_, row_.data(), x.data());
  return result;
}

}  // namespace corpuscle
