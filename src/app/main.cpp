// corpuscle: the command line.
#include "app/run.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "output/report.hpp"

#include <CLI/CLI.hpp>
#include <Kokkos_Core.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace {

using namespace corpuscle;

constexpr int input_is_wrong = InputError::exit_code, broke_down = ComputationError::exit_code;

/// End without unwinding libraries that may be in the middle of a failed operation; every rank goes.
[[noreturn]] void leave(const Comm& comm, int code) {
  std::fflush(stdout);
  std::fflush(stderr);
#ifdef CORPUSCLE_MPI
  if (comm.size() > 1) MPI_Abort(comm.handle(), code);
#else
  (void)comm;
#endif
  std::_Exit(code);
}

/// Print what happened. Where only some ranks failed, they speak after giving rank 0 a moment to do so.
void complain(const Comm& comm, const std::string& message) {
  if (!comm.root()) std::this_thread::sleep_for(std::chrono::seconds(2));
  log_error(message, true);
}

int run_command(const Comm& comm, const std::function<void()>& command) {
  try {
    command();
    return 0;
  } catch (const InputError& error) {
    complain(comm, error.what());
    leave(comm, input_is_wrong);
  } catch (const ComputationError& error) {
    complain(comm, fmt::format("the computation broke down {}", error.what()));
    leave(comm, broke_down);
  } catch (const std::exception& error) {
    complain(comm, fmt::format("the computation broke down: {} (out of memory, or a fault of the program)", error.what()));
    leave(comm, broke_down);
  }
}

/// Ranks that share a machine share its cores, unless the user has said otherwise.
void share_cores(const Comm& comm) {
#if defined(_OPENMP) && defined(CORPUSCLE_MPI)
  if (comm.size() == 1 || std::getenv("OMP_NUM_THREADS")) return;
  MPI_Comm node;
  MPI_Comm_split_type(comm.handle(), MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
  int neighbours = 1;
  MPI_Comm_size(node, &neighbours);
  MPI_Comm_free(&node);
  omp_set_num_threads(std::max(1, omp_get_num_procs() / neighbours));
#else
  (void)comm;
#endif
}

int parse_and_run(int argc, char** argv, const Comm& comm) {
  CLI::App app{"Red blood cells in flowing plasma"};
  app.require_subcommand(1);
  app.set_version_flag("--version", "corpuscle " + git_hash());
  RunOptions options;
  int vertices = 0;
  std::string mesh_path;

  auto* run = app.add_subcommand("run", "run a case to its end");
  run->add_option("case", options.case_path, "case file (TOML)")->required();
  run->add_option("--out", options.folder, "folder for the results (default: runs/<case>)");
  run->add_option("--set", options.overrides, "override: section.key=value")->take_all()->expected(1)->allow_extra_args(false);
  run->add_option("--restart", options.restart, "checkpoint.h5 to continue from");
  auto* check = app.add_subcommand("check", "validate a case; list modules, unknowns, memory and time; run nothing");
  check->add_option("case", options.case_path, "case file (TOML)")->required();
  check->add_option("--set", options.overrides, "override: section.key=value")->take_all()->expected(1)->allow_extra_args(false);
  auto* mesh = app.add_subcommand("mesh", "write the surface mesh of a resting red cell");
  mesh->add_option("--vertices", vertices, "how many vertices, 200 to 30000")->required();
  mesh->add_option("-o,--output", mesh_path, "file to write (.off or .stl)")->required();

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (comm.root()) app.exit(error);
    return error.get_exit_code() == 0 ? 0 : input_is_wrong;
  }
  return run_command(comm, [&] {
    if (*run)
      run_case(comm, options);
    else if (*check)
      check_case(comm, options);
    else
      write_mesh(vertices, mesh_path);
  });
}

}  // namespace

int main(int argc, char** argv) {
  setenv("OMP_PROC_BIND", "false", 0);  // or Kokkos advises on it at every start
#ifdef CORPUSCLE_MPI
  MPI_Init(&argc, &argv);
#endif
  int code = 0;
  {
    const Comm comm;
    open_log(comm.root());
    share_cores(comm);
    Kokkos::initialize(argc, argv);
    code = parse_and_run(argc, argv, comm);
    Kokkos::finalize();
  }
#ifdef CORPUSCLE_MPI
  MPI_Finalize();
#endif
  return code;
}
