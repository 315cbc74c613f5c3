#include "fluid/hypre_system.hpp"

#include "fluid/hypre_stream.hpp"

#include <HYPRE.h>

#if (defined(KOKKOS_ENABLE_CUDA) && !defined(HYPRE_USING_CUDA)) || (defined(KOKKOS_ENABLE_HIP) && !defined(HYPRE_USING_HIP))
#error "Kokkos runs on the GPU but hypre was built for the host: build hypre for the same GPU back end"
#endif
#if !defined(CORPUSCLE_MPI) && !defined(HYPRE_SEQUENTIAL)
#error "this build has no MPI but hypre has: ./setup.sh --no-mpi builds one without"
#endif

namespace corpuscle {

namespace {

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

}  // namespace

HypreSystem::HypreSystem(const Comm& comm, const IndexSpace& index, Halo& halo, bool skewed)
    : comm_(comm), pattern_(RowPattern::make(skewed)) {
  start_hypre_once();
  rows_ = index.owned();
  // Rows are numbered rank by rank; a rank's first row is the sum of the owned cells of the ranks before it.
  int first = 0;
#ifdef CORPUSCLE_MPI
  MPI_Exscan(&rows_, &first, 1, MPI_INT, MPI_SUM, comm_.handle());
  if (comm_.root()) first = 0;
#endif
  number_entries(index, halo, first);
  create(first);
  errors_.raise(comm_);
}

HypreSystem::~HypreSystem() {
  if (ij_x_) HYPRE_IJVectorDestroy(ij_x_);
  if (ij_rhs_) HYPRE_IJVectorDestroy(ij_rhs_);
  if (ij_matrix_) HYPRE_IJMatrixDestroy(ij_matrix_);
}

/// The packed arrays: which entries there are, and where.
void HypreSystem::number_entries(const IndexSpace& index, Halo& halo, int first) {
  value_ = Table<double>("corpuscle::fluid::pressure_value", rows_, pattern_.count);
  slot_ = Table<int>(uninitialised("corpuscle::fluid::pressure_slot"), rows_, pattern_.count);
  row_ = Array<int>(uninitialised("corpuscle::fluid::pressure_row"), rows_);
  row_length_ = Array<int>(uninitialised("corpuscle::fluid::pressure_row_length"), rows_);
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
}

void HypreSystem::create(int first) {
#ifdef CORPUSCLE_MPI
  const MPI_Comm handle = comm_.handle();
#else
  const MPI_Comm handle = 0;
#endif
  const HYPRE_BigInt lower = first, upper = first + rows_ - 1;
  HYPRE_IJMatrixCreate(handle, lower, upper, lower, upper, &ij_matrix_);
  HYPRE_IJMatrixSetObjectType(ij_matrix_, HYPRE_PARCSR);
  for (auto* v : {&ij_rhs_, &ij_x_}) {
    HYPRE_IJVectorCreate(handle, lower, upper, v);
    HYPRE_IJVectorSetObjectType(*v, HYPRE_PARCSR);
    HYPRE_IJVectorInitialize(*v);
    HYPRE_IJVectorAssemble(*v);
  }
  HYPRE_IJVectorGetObject(ij_rhs_, reinterpret_cast<void**>(&b_));
  HYPRE_IJVectorGetObject(ij_x_, reinterpret_cast<void**>(&y_));
  errors_.check(HypreErrors::matrix);
}

void HypreSystem::set_values() {
  pack_entries(value_, slot_, packed_);
  Exec().fence();
  HYPRE_IJMatrixInitialize(ij_matrix_);
  HYPRE_IJMatrixSetValues(ij_matrix_, rows_, row_length_.data(), row_.data(), column_.data(), packed_.data());
  HYPRE_IJMatrixAssemble(ij_matrix_);
  HYPRE_IJMatrixGetObject(ij_matrix_, reinterpret_cast<void**>(&a_));
  wait_for_hypre();
  errors_.check(HypreErrors::matrix);
}

void HypreSystem::load(const Array<double>& rhs, const Array<double>& x) {
  Exec().fence();
  HYPRE_IJVectorInitialize(ij_rhs_);
  HYPRE_IJVectorSetValues(ij_rhs_, rows_, row_.data(), rhs.data());
  HYPRE_IJVectorAssemble(ij_rhs_);
  HYPRE_IJVectorInitialize(ij_x_);
  HYPRE_IJVectorSetValues(ij_x_, rows_, row_.data(), x.data());
  HYPRE_IJVectorAssemble(ij_x_);
  wait_for_hypre();
  errors_.check(HypreErrors::vectors);
}

void HypreSystem::read(const Array<double>& x) {
  HYPRE_IJVectorGetValues(ij_x_, rows_, row_.data(), x.data());
  wait_for_hypre();
  errors_.check(HypreErrors::vectors);
}

}  // namespace corpuscle
