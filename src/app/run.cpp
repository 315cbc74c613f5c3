#include "app/run.hpp"

#include "app/error_estimate.hpp"
#include "app/estimate.hpp"
#include "app/flow_output.hpp"
#include "app/modules.hpp"
#include "app/scene_runs.hpp"
#include "app/surfaces.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/mesh_io.hpp"
#include "output/on_root.hpp"
#include "output/run_folder.hpp"

#include <fmt/ranges.h>

#include <filesystem>

namespace corpuscle {

namespace {

void print_start(const Comm& comm, const Case& scene) {
  info("{}", scene.title.empty() ? scene.path : scene.title);
  info("corpuscle {}, {} on {} rank{} x {} thread{}", git_hash(), backend_name(), comm.size(),
       comm.size() == 1 ? "" : "s", thread_count(), thread_count() == 1 ? "" : "s");
  print_modules(list_modules(scene, comm.size()));
  for (const auto& line : outputs_left_out(scene.output)) warn("{}", line);
  print_surfaces(scene);
}

void print_end(const Report& report, const std::string& folder) {
  if (!report.stopped.empty()) {
    const bool flow = report.simulated_us > 0;
    warn("stopped after step {}: {}{}", report.steps, report.stopped,
         flow ? fmt::format("; it can go on with --restart {}/checkpoint.h5", folder) : "");
  }
  info("{} steps, {:.6g} us in {:.3g} s, {:.0f} MB", report.steps, report.simulated_us, report.wall_s, peak_rss_mb());
  std::string parts;
  for (const auto& [part, seconds] : report.wall_s_by_part) parts += fmt::format("  {} {:.3g} s", part, seconds);
  info("time:  {}", parts);
  std::string errors;
  for (const auto& [name, value] : report.errors.items())
    if (value.is_number()) errors += fmt::format("  {} {:.3g}", name, value.get<double>());
  info("errors:{}", errors);
  for (const auto& warning : report.warnings) warn("{}", warning["message"].get<std::string>());
  if (!report.quantities.empty()) info("at the end:");
  print_quantities(report);
  info("results in {}", folder);
}

Ending run_scene(const Comm& comm, const Case& scene, const RunOptions& options, const Place& place) {
  return scene.stretching ? run_stretching(comm, scene, place) : run_flow(comm, scene, options, place);
}

/// Error bars from coarser runs, each with its own report beside the main run's. A coarser run may be refused or break
/// down where the main one did not: then the report says so instead.
/// @return exit_stopped if a signal has ended it
ExitCode estimate_errors(const Comm& comm, const Case& scene, const RunOptions& options, const std::vector<CoarserRun>& runs,
                     const std::string& folder, Report& report) {
  for (const auto& run : runs) {
    info("error bars: the same with {}", fmt::join(run.overrides, ", "));
    auto overrides = options.overrides;
    overrides.insert(overrides.end(), run.overrides.begin(), run.overrides.end());
    for (const char* off : {"output.fields=false", "output.cells=false"}) overrides.emplace_back(off);
    const std::string own_folder = folder + "/coarser_" + run.kind;
    std::string reason;
    try {
      const Case coarser = read_case(scene.path, overrides);
      const auto begin = [&] { on_root(comm, [&] { prepare_folder(own_folder), remove_results(own_folder); }); };
      open_log(comm.root(), true);
      const Ending ending = run_scene(comm, coarser, {}, {own_folder, begin});
      open_log(comm.root());
      if (ending.code == exit_stopped) return exit_stopped;
      if (ending.code == exit_at_outflow) reason = ending.report.stopped;
      if (reason.empty()) add_error_bars(report, run, ending.report);
    } catch (const InputError& error) {
      reason = error.what();
    } catch (const ComputationError& error) {
      if (comm.size() > 1) throw;  // perhaps on some ranks only; the main run's report is written
      reason = error.what();
    }
    open_log(comm.root());
    if (reason.empty()) continue;
    warn("no error bars from {}: {}", run.kind, reason);
    report.extra["error_estimate"].push_back({{"coarser", run.kind}, {"ratio", run.ratio}, {"failed", reason}});
  }
  write_report(folder, comm, report);
  return exit_done;
}

/// What is refused before anything is built.
void check_options(const Comm& comm, const Case& scene, const RunOptions& options) {
  if (!options.estimate.empty() && !options.restart.empty())
    throw InputError("--estimate-error compares whole runs: leave out --restart");
  if (options.overwrite && !options.restart.empty())
    throw InputError("--overwrite begins anew and --restart goes on: leave out one of them");
  if (scene.stretching && !options.restart.empty())
    throw InputError("--restart: a stretching test has no checkpoints; run it again");
  if (scene.stretching && comm.size() > 1)
    throw InputError(fmt::format("a stretching test runs on one rank, not {}: start it without mpirun", comm.size()));
}

}  // namespace

ExitCode run_case(const Comm& comm, const RunOptions& options) {
  const Case scene = read_case(options.case_path, options.overrides);
  const MemoryEstimate memory = require_memory(comm, scene);
  check_options(comm, scene, options);
  const auto coarser = options.estimate.empty() ? std::vector<CoarserRun>{} : coarser_runs(scene, options.estimate);
  const auto earlier = options.overwrite          ? EarlierResults::overwrite
                       : options.restart.empty() ? EarlierResults::refuse
                                                 : EarlierResults::go_on;
  RunFolder folder(comm, options.folder, std::filesystem::path(options.case_path).stem().string(), earlier);
  print_start(comm, scene);
  info("memory:   {}", memory_text(memory, comm.size()));
  Ending ending = run_scene(comm, scene, options, {folder.path(), [&] { folder.begin(); }});
  if (!coarser.empty() && ending.code == exit_done)
    ending.code = estimate_errors(comm, scene, options, coarser, folder.path(), ending.report);
  print_end(ending.report, folder.path());
  return ending.code;
}

void check_case(const Comm& comm, const RunOptions& options) {
  const Case scene = read_case(options.case_path, options.overrides);
  const MemoryEstimate memory = require_memory(comm, scene);
  print_start(comm, scene);
  info("memory:   {}", memory_text(memory, comm.size()));
  if (scene.stretching) {
    Membranes membranes(scene.cells);
    info("unknowns: {} vertices, {} triangles", membranes.vertices(), membranes.surfaces().triangles);
    info("estimate: {:.0f} MB, {:.2g} s", memory.rank(), 1.6e-7 * membranes.vertices() * 400.0 * scene.stretching->steps);
    info("{} is valid", scene.path);
    return;
  }
  Timers timers;
  FlowSimulation simulation(comm, scene, timers);
  const auto& index = simulation.grid().index();
  const double nodes = static_cast<double>(index.global[0]) * index.global[1] * index.global[2];
  info("unknowns: {:.0f} grid cells x (3 velocities + pressure), {} surface vertices", nodes,
       simulation.surfaces() ? simulation.surfaces()->vertices : 0);
  print_schedule(simulation.schedule());
  const std::string stability = simulation.coupling() ? simulation.coupling()->stability_text(simulation.next_step_us()) : "";
  if (!stability.empty()) {
    info("{}", stability);
  } else if (simulation.membranes()) {
    const auto s = *simulation.coupling()->stability(simulation.next_step_us());
    info("coupling: margin of stability {:.2f} (M / (A dt) + beta = {:.3g} + {:.3g}, half the fluid's reaction {:.3g} pg/um2/us)",
         s.margin(), s.mass_term, s.beta, s.threshold());
    auto& membranes = *simulation.membranes();
    const double stable = membranes.stable_step_us();
    info("membrane: undamped stable step {:.3g} us, {} sub-steps a step", stable,
         membranes.substeps(simulation.next_step_us(), s.beta));
  }
  // Seconds per cell and step on one core, measured with the tube; about ten times that on skewed grids.
  const double rate = simulation.grid().orthogonal() ? 1.1e-6 : 1e-5;
  const double cores = static_cast<double>(comm.size()) * thread_count();
  info("estimate: {:.0f} MB, {} steps, about {:.2g} s", memory.rank() * comm.size(), simulation.steps_left(),
       rate * nodes * simulation.steps_left() / cores);
  info("{} is valid", scene.path);
}

void write_mesh(int vertices, const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  const bool stl = extension == ".stl";
  if (!stl && extension != ".off")
    throw InputError(fmt::format("{}: cannot write a mesh as \"{}\"; use a name that ends in .off or .stl", path,
                                 extension));
  const TriangleMesh mesh = biconcave_mesh(vertices);
  if (stl)
    write_stl(path, mesh, StlFormat::binary);
  else
    write_off(path, mesh);
  info("{}: {} vertices, {} triangles, area {:.2f} um2, volume {:.2f} um3", path, mesh.vertices.size(),
       mesh.triangles.size(), area(mesh), volume(mesh));
}

}  // namespace corpuscle
