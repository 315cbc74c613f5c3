// Entry point of every test program: Kokkos and MPI live for its whole run, and ranks other than 0 stay quiet.
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>

#include <Kokkos_Core.hpp>

#ifdef CORPUSCLE_MPI
#include <mpi.h>
#endif

int main(int argc, char** argv) {
  int rank = 0;
#ifdef CORPUSCLE_MPI
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
#endif
  Kokkos::initialize(argc, argv);
  int failed = 0;
  {
    Catch::Session session;
    if (rank != 0) session.configData().outputFilename = "%debug";
    failed = session.applyCommandLine(argc, argv);
    if (failed == 0) failed = session.run();
  }
  Kokkos::finalize();
#ifdef CORPUSCLE_MPI
  MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
#endif
  return failed > 255 ? 255 : failed;
}
