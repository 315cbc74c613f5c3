// What the small programs of this folder share: start and stop of MPI and Kokkos, the command line's length, errors.
#pragma once

#include "app/waiting.hpp"

#include <Kokkos_Core.hpp>

#include <cstdio>
#include <cstdlib>
#include <exception>

#ifdef CORPUSCLE_MPI
#include <mpi.h>
#endif

namespace corpuscle {

/// Run `body(argc, argv)` between start and stop. Returns 2 for fewer than `words` arguments, 3 for an exception.
template <class Body>
int run_program(int argc, char** argv, int words, const char* usage, const Body& body) {
  if (argc < words + 1) {
    std::fprintf(stderr, "usage: %s %s\n", argv[0], usage);
    return 2;
  }
  setenv("OMP_PROC_BIND", "false", 0);  // or Kokkos advises on it at every start
  wait_briefly(argv);
#ifdef CORPUSCLE_MPI
  MPI_Init(&argc, &argv);
#endif
  Kokkos::initialize(argc, argv);
  int code = 0;
  try {
    body(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    code = 3;
  }
  Kokkos::finalize();
#ifdef CORPUSCLE_MPI
  MPI_Finalize();
#endif
  return code;
}

}  // namespace corpuscle
