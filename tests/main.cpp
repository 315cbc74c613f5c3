// Entry point of every test program: Kokkos and MPI live for its whole run, and ranks other than 0 stay quiet.
#include <Kokkos_Core.hpp>

#ifdef CORPUSCLE_MPI
#include <mpi.h>
#endif

/// Catch2's, with the number of what failed. @param quiet  on ranks other than 0
int run_tests(int argc, char** argv, bool quiet);

int main(int argc, char** argv) {
  int rank = 0;
#ifdef CORPUSCLE_MPI
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
#endif
  Kokkos::initialize(argc, argv);
  int failed = run_tests(argc, argv, rank != 0);
  Kokkos::finalize();
#ifdef CORPUSCLE_MPI
  MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
#endif
  return failed > 255 ? 255 : failed;
}
