// corpuscle: the command line.
#include "app/page.hpp"
#include "app/run.hpp"
#include "app/waiting.hpp"
#include "core/device_layout.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "core/nearest.hpp"
#include "input/case.hpp"
#include "input/case_file.hpp"
#include "input/key_list.hpp"
#include "output/report.hpp"

#include <CLI/CLI.hpp>
#include <Kokkos_Core.hpp>

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>

#ifdef _OPENMP
#include <omp.h>
#endif
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using namespace corpuscle;

constexpr const char* ends =
    "Exit codes: 0 done; 2 the input is wrong; 3 the computation broke down; 4 stopped by a signal, with report and checkpoint\n"
    "(SIGTERM, SIGINT, SIGHUP or SIGUSR1: the step is finished first; a second signal ends at once); 5 a cell reached the\n"
    "outflow (time.stop_before_outflow_um), with all results.";

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

int run_command(const Comm& comm, const std::function<int()>& command) {
  try {
    return command();
  } catch (const InputError& error) {
    complain(comm, error.what());
    leave(comm, exit_input_wrong);
  } catch (const ComputationError& error) {
    complain(comm, fmt::format("the computation broke down {}", error.what()));
    leave(comm, exit_broke_down);
  } catch (const std::exception& error) {
    complain(comm, fmt::format("the computation broke down: {} (out of memory, or a fault of the program)", error.what()));
    leave(comm, exit_broke_down);
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

/// Arrays that are freed go back to the system. Else the C library takes ever larger ones from the heap, once some have been freed, and
/// what is free between those in use stays resident: 46 kB for each cell, of set-up alone.
void return_freed_arrays() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 128 * 1024);
#endif
}

struct Command {
  enum class Kind { run, check, mesh, keys, report } kind = Kind::run;
  RunOptions options;
  int vertices = 0;
  std::string mesh_path;
  std::string section;
  std::string results, page;
  bool markdown = false, resolved = false;
};

/// @throws CLI::ParseError  the first word is none of the program's commands
void check_command(const CLI::App& app, const std::string& word) {
  if (word.empty() || word[0] == '-') return;
  std::vector<std::string> known;
  for (const auto* command : app.get_subcommands(nullptr)) known.push_back(command->get_name());
  if (std::find(known.begin(), known.end(), word) != known.end()) return;
  const auto like = nearest(word, known);
  throw CLI::ValidationError(word, like.empty() ? fmt::format("there is no such command; known: {}", fmt::join(known, ", "))
                                                : fmt::format("there is no such command; did you mean '{}'?", like));
}

/// @throws CLI::ParseError  an option has an empty value, as from a shell variable that is not set: left out, it would mean
///                          something else
void check_values(const CLI::App& command) {
  for (const auto* option : command.get_options())
    for (const auto& value : option->results())
      if (value.empty() && option->get_name() != "--set")
        throw CLI::ValidationError(option->get_name(), "its value is empty: name one, or leave the option out");
}

/// @throws CLI::ParseError  for what is not a command line of this program, and for --help and --version
Command parse(CLI::App& app, int argc, char** argv) {
  Command command;
  RunOptions& options = command.options;
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text(), "print version, git hash, back end and libraries, and exit");
  auto* run = app.add_subcommand("run", "run a case to its end");
  run->add_option("case", options.case_path, "case file (TOML)")->required();
  run->add_option("--out", options.folder,
                  "folder for the results (default: runs/<case>-001 or the first number that is free, with runs/latest leading to it)");
  run->add_flag("--overwrite", options.overwrite, "remove the results that the folder of --out holds");
  run->add_option("--set", options.overrides, "override: section.key=value")->take_all()->expected(1)->allow_extra_args(false);
  run->add_option("--restart", options.restart, "checkpoint.h5 to continue from, or the folder that holds it");
  run->add_flag("--profile", options.profile,
                "wait for the device after each part of a step, so that the report's times of parts are theirs");
  run->add_flag("--estimate-error{all}", options.estimate,
                "error bars from further, coarser runs: spacing, step, vertices (comma-separated), or all");
  run->footer(ends);
  app.footer(ends);
  auto* check = app.add_subcommand("check", "validate a case; list modules, unknowns, memory and time; run nothing");
  check->add_option("case", options.case_path, "case file (TOML)")->required();
  check->add_option("--set", options.overrides, "override: section.key=value")->take_all()->expected(1)->allow_extra_args(false);
  check->add_flag("--resolved", command.resolved, "print the case with every default filled in, as a case file, and nothing else");
  auto* mesh = app.add_subcommand("mesh", "write the surface mesh of a resting red cell");
  mesh->add_option("--vertices", command.vertices, "how many vertices, 200 to 30000")->required();
  mesh->add_option("-o,--output", command.mesh_path, "file to write (.off or .stl)")->required();

  auto* keys = app.add_subcommand("keys", "list every section and key of a case file: what it says, what is allowed, its default");
  auto* of = keys->add_option("section", command.section, "only this one: time, grid, fluid, boundary, cells, ...");
  keys->add_flag("--markdown", command.markdown, "all of them as the tables of docs/keys.md")->excludes(of);

  auto* report = app.add_subcommand("report", "write DIR/report.html: results, errors, times and pictures of a run on one page");
  report->add_option("folder", command.results, "folder of results")->required();
  report->add_option("--out", command.page, "the page to write, in place of DIR/report.html");

  std::vector<std::string> words;  // last first, as the parser wants them; Kokkos takes its own options
  for (int n = argc - 1; n > 0; --n)
    if (std::string(argv[n]).rfind("--kokkos-", 0) != 0) words.push_back(argv[n]);
  if (!words.empty()) check_command(app, words.back());
  app.parse(words);
  for (const auto* used : app.get_subcommands()) check_values(*used);
  command.kind = *run      ? Command::Kind::run
                 : *check  ? Command::Kind::check
                 : *mesh   ? Command::Kind::mesh
                 : *report ? Command::Kind::report
                           : Command::Kind::keys;
  return command;
}

#ifdef CORPUSCLE_MPI
/// Whether a process that starts alone gets by without message passing, whose start-up takes longer than many a
/// stretching test. Keeps the case's text. A launcher has set one of these variables for each of its processes.
bool can_stay_alone(Command& command) {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_PROCID", "PALS_RANKID",
                           "ALPS_APP_PE", "FLUX_TASK_RANK", "JSM_NAMESPACE_RANK"})
    if (std::getenv(name)) return false;
  if (command.kind == Command::Kind::mesh || command.kind == Command::Kind::keys) return true;
  try {
    const auto file = load_case_file(command.options.case_path);
    command.options.case_text = file.text;
    return read_case(file, command.options.overrides).stretching.has_value();
  } catch (const InputError&) {
    return true;  // all there is to do is to say so
  }
}
#endif

/// Needs neither MPI nor a device, and does not return where it works. Under a launcher the first process does it.
int page_of_results(const Command& command) {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "MPI_LOCALRANKID", "SLURM_PROCID"})
    if (const char* rank = std::getenv(name); rank && std::string(rank) != "0") return exit_done;
  open_log(true);
  try {
    make_page(command.results, command.page);
  } catch (const InputError& error) {
    log_error(error.what());
  }
  return exit_input_wrong;
}

int execute(const Comm& comm, const Command& command) {
  return run_command(comm, [&]() -> int {
    check_device_layout();
    switch (command.kind) {
      case Command::Kind::run:
        return static_cast<int>(run_case(comm, command.options));
      case Command::Kind::check:
        if (command.resolved)
          print_resolved(comm, command.options);
        else
          check_case(comm, command.options);
        break;
      case Command::Kind::mesh:
        write_mesh(command.vertices, command.mesh_path);
        break;
      case Command::Kind::report:
        break;  // has been made, without MPI and Kokkos
      case Command::Kind::keys:
        log_text(command.markdown ? keys_markdown() : keys_text(command.section));
        break;
    }
    return static_cast<int>(exit_done);
  });
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);        // a file that may not grow is a failed write, with a message
  std::signal(SIGPIPE, SIG_IGN);        // a run goes on when nobody reads what it says
  setenv("OMP_PROC_BIND", "false", 0);  // or Kokkos advises on it at every start
  return_freed_arrays();
  wait_briefly(argv);
  CLI::App app{"Red blood cells in flowing plasma", "corpuscle"};
  Command command;
  std::unique_ptr<CLI::ParseError> refused;
  try {
    command = parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    refused = std::make_unique<CLI::ParseError>(error);
  }
  if (!refused && command.kind == Command::Kind::report) return page_of_results(command);
#ifdef CORPUSCLE_MPI
  const bool alone = can_stay_alone(command);
  setenv("OMPI_MCA_ess_singleton_isolated", "1",
         0);  // without mpirun Open MPI needs no daemon: it takes longer to start than small scenes run
  if (!alone) MPI_Init(&argc, &argv);
#endif
  int code = 0;
  {
    const Comm comm;
    open_log(comm.root());
    if (refused) {
      if (comm.root()) app.exit(*refused);
      code = refused->get_exit_code() == 0 ? 0 : exit_input_wrong;
    } else {
      share_cores(comm);
      Kokkos::initialize(argc, argv);
      code = execute(comm, command);
      Kokkos::finalize();
    }
  }
#ifdef CORPUSCLE_MPI
  if (!alone) MPI_Finalize();
#endif
  return code;
}
