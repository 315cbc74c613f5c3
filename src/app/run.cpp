#include "app/run.hpp"

#include "app/error_estimate.hpp"
#include "app/estimate.hpp"
#include "app/flow_output.hpp"
#include "app/modules.hpp"
#include "app/packing_text.hpp"
#include "app/scene_files.hpp"
#include "app/scene_runs.hpp"
#include "app/surfaces.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "input/case_changes.hpp"
#include "input/case_file.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/mesh_io.hpp"
#include "output/checkpoint.hpp"
#include "output/on_root.hpp"
#include "output/run_folder.hpp"
#include "output/text_file.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>

namespace corpuscle {

namespace {

void print_start(const Comm& comm, const Case& scene) {
  info("{}", scene.title.empty() ? scene.path : scene.title);
  info("corpuscle {} ({}), {} on {} rank{} x {} thread{}", version_number(), git_hash(), backend_name(), comm.size(),
       comm.size() == 1 ? "" : "s", thread_count(), thread_count() == 1 ? "" : "s");
  print_modules(list_modules(scene, comm.size()));
  for (const auto& line : outputs_left_out(scene.output)) warn("{}", line);
  for (const auto& line : scene.remarks) warn("{}", line);
  print_cell_types(scene);
  print_surfaces(scene);
}

void print_end(const Ending& ending, const std::string& folder) {
  const Report& report = ending.report;
  if (!report.stopped.empty()) {
    const bool flow = report.simulated_us > 0;
    const char* lower = ending.code == exit_at_outflow ? "; with a lower time.stop_before_outflow_um" : ";";
    warn("stopped after step {}: {}{}", report.steps, report.stopped,
         flow ? fmt::format("{} it can go on with --restart {}/checkpoint.h5", lower, folder) : "");
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
  print_quantities(report);
  info("results in {}", folder);
}

Ending run_scene(const Comm& comm, Case scene, const RunOptions& options, const Place& place) {
  return scene.stretching ? run_stretching(comm, scene, place) : run_flow(comm, std::move(scene), options, place);
}

/// Every rank gets the same text, whatever happens to the file between their readings.
CaseFile case_file(const Comm& comm, const RunOptions& options) {
  if (options.case_text) return {options.case_path, *options.case_text};
  CaseFile file{options.case_path, {}};
  on_root(comm, [&] { file = load_case_file(options.case_path); });
  comm.broadcast(file.text);
  return file;
}

/// What the error bars of a run are taken from.
struct Bars {
  const CaseFile& file;
  const std::vector<std::string>& overrides;
  const std::vector<CoarserRun>& runs;
};

/// @throws InputError  a surface or grid is not what the main run read
void require_same_files(const std::string& before, const std::string& now) {
  for (const auto& change : file_changes(before, now))
    throw InputError(fmt::format("{} = {} has changed since the run began", change.key, change.now));
}

/// One run more, with its own report beside the main run's, and the error bars that it gives.
/// @return exit_stopped if a signal has ended it
/// @param reason  why there are no bars from it; else empty
ExitCode compare(const Comm& comm, const Bars& bars, const CoarserRun& run, const Place& main, Report& report, std::string& reason) {
  info("error bars: the same with {}", fmt::join(run.overrides, ", "));
  auto overrides = bars.overrides;
  overrides.insert(overrides.end(), run.overrides.begin(), run.overrides.end());
  for (const char* off : {"output.fields=false", "output.cells=false"}) overrides.emplace_back(off);
  const std::string own_folder = main.folder + "/coarser_" + run.kind;
  ExitCode code = exit_done;
  reason.clear();
  WarningsTold of_main = exchange_warnings({});
  try {
    Case coarser = read_case(bars.file, overrides);
    const auto files = fingerprint_files(comm, coarser);
    require_same_files(main.files, files);
    const auto begin = [&] { on_root(comm, [&] { prepare_folder(own_folder), remove_results(own_folder); }); };
    open_log(comm.root(), true);
    const Ending ending = run_scene(comm, std::move(coarser), {}, {own_folder, begin, [] {}, main.run + "-" + run.kind, files});
    open_log(comm.root());
    if (ending.code != exit_done) reason = ending.report.stopped;
    if (ending.code == exit_stopped) code = exit_stopped;
    if (reason.empty()) add_error_bars(report, run, ending.report);
  } catch (const InputError& error) {
    reason = error.what();
  } catch (const ComputationError& error) {
    if (comm.size() > 1) throw;  // perhaps on some ranks only; the main run's report is written
    reason = error.what();
  }
  exchange_warnings(std::move(of_main));
  open_log(comm.root());
  return code;
}

/// Error bars from coarser runs. A coarser run may be refused or break down where the main one did not: where a longer step is not
/// possible half of it tells as much, and else the report and the screen say what the bars lack.
/// @return exit_stopped if a signal has ended it
ExitCode estimate_errors(const Comm& comm, const Bars& bars, const Place& main, Report& report) {
  ExitCode code = exit_done;
  for (const auto& run : bars.runs) {
    std::string reason = run.refused;
    if (reason.empty()) code = compare(comm, bars, run, main, report, reason);
    if (!reason.empty() && code != exit_stopped && !run.halved.empty()) {
      info("error bars: no longer step: {}", reason);
      code = compare(comm, bars, halved_run(run), main, report, reason);
    }
    if (reason.empty()) continue;
    warn("no error bars from {}: {}", run.kind, reason);
    note_missing_bars(report, run, reason);
    if (code != exit_stopped) continue;
    warn("stopped by {} before all error bars were there; the run itself is complete", reason);
    break;
  }
  write_report(main.folder, comm, report);
  return code;
}

/// A word before the making of large meshes, which takes a while.
void announce_set_up(const SceneSize& size) {
  constexpr double noticeable = 1;
  const double seconds = estimate_set_up_s(size, thread_count());
  if (seconds > noticeable)
    info("set-up:   {:.0f} surface vertices, about {} s", size.own,
         seconds < 10 ? fmt::format("{:.2g}", seconds) : fmt::format("{:.0f}", seconds));
}

/// What is refused before anything is built.
void check_options(const Comm& comm, const Case& scene, const RunOptions& options) {
  if (!options.estimate.empty() && !options.restart.empty()) throw InputError("--estimate-error compares whole runs: leave out --restart");
  if (scene.stretching && !options.restart.empty()) throw InputError("--restart: a stretching test has no checkpoints; run it again");
  if (scene.stretching && comm.size() > 1)
    throw InputError(fmt::format("a stretching test runs on one rank, not {}: start it without mpirun", comm.size()));
}

/// A folder stands for the checkpoint in it. @throws InputError  there is none
std::string checkpoint_path(const std::string& named) {
  std::error_code ignored, why;
  if (named.empty()) return named;
  if (!std::filesystem::exists(named, why))
    throw InputError(fmt::format("--restart {}: {}", named, why ? why.message() : "there is no such file or folder"));
  if (!std::filesystem::is_directory(named, ignored)) return named;
  const auto path = std::filesystem::path(named).lexically_normal() / "checkpoint.h5";
  if (!std::filesystem::exists(path, ignored)) throw InputError(fmt::format("--restart {}: this folder holds no checkpoint.h5", named));
  return path.string();
}

std::optional<Continued> continued([[maybe_unused]] const std::string& checkpoint) {
#ifdef CORPUSCLE_HDF5
  if (!checkpoint.empty()) {
    const auto header = read_checkpoint_header(checkpoint);
    return Continued{checkpoint, header.run, header.step};
  }
#endif
  return std::nullopt;
}

constexpr const char* resolved_name = "resolved.toml";

/// A run from the case that lies among its results would remove what it is made from.
void keep_case_file(const RunOptions& options) {
  std::error_code ignored;
  const auto among = std::filesystem::path(options.folder) / resolved_name;
  if (!options.folder.empty() && options.restart.empty() && std::filesystem::equivalent(options.case_path, among, ignored))
    throw InputError(fmt::format("--out {}: {} lies there among the results of an earlier run: copy it, or choose another folder",
                                 options.folder, resolved_name));
}

/// The text of a case file that stands for the case and its overrides.
std::string resolved_file(const RunOptions& options, const Case& scene) {
  std::string from = options.case_path;
  for (const auto& override_text : options.overrides) from += " --set " + override_text;
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };  // which TOML has none of in comments
  std::replace_if(from.begin(), from.end(), control, ' ');
  return fmt::format("# {}\n# with every key that has a value in it, as corpuscle {} took them.\n{}", from, git_hash(),
                     resolved_text(scene));
}

}  // namespace

ExitCode run_case(const Comm& comm, const RunOptions& asked) {
  RunOptions options = asked;
  const CaseFile file = case_file(comm, options);
  Case scene = read_case(file, options.overrides);
  const MemoryEstimate memory = require_memory(comm, scene);
  check_options(comm, scene, options);
  keep_case_file(options);
  const auto coarser = options.estimate.empty() ? std::vector<CoarserRun>{} : coarser_runs(scene, options.estimate);
  const auto earlier = options.overwrite         ? EarlierResults::overwrite
                       : options.restart.empty() ? EarlierResults::refuse
                                                 : EarlierResults::go_on;
  options.restart = checkpoint_path(options.restart);
  RunFolder folder(comm, options.folder, std::filesystem::path(options.case_path).stem().string(), earlier, continued(options.restart));
  print_start(comm, scene);
  info("memory:   {}", memory_text(memory, comm.size()));
  announce_set_up(measure_scene(scene, comm.size()));
  const auto settle = [&, text = resolved_file(options, scene)] {
    on_root(comm, [&] {
      const std::filesystem::path results(folder.path());
      for (const char* of_before : {"report.json", "report.html"}) std::filesystem::remove(results / of_before);
      replace_text_file((results / resolved_name).string(), text);
    });
  };
  const Place place{folder.path(), [&] { folder.begin(); }, settle, folder.run(), fingerprint_files(comm, scene)};
  Ending ending = run_scene(comm, std::move(scene), options, place);
  if (!coarser.empty() && ending.code == exit_done)
    ending.code = estimate_errors(comm, {file, options.overrides, coarser}, place, ending.report);
  print_end(ending, folder.path());
  return ending.code;
}

void check_case(const Comm& comm, const RunOptions& options) {
  const Case scene = read_case(case_file(comm, options), options.overrides);
  const MemoryEstimate memory = require_memory(comm, scene);
  print_start(comm, scene);
  info("memory:   {}", memory_text(memory, comm.size()));
  if (scene.stretching) {
    announce_set_up(measure_scene(scene, 1));
    Membranes membranes(scene.cells);
    info("unknowns: {} vertices, {} triangles", membranes.vertices(), membranes.surfaces().triangles);
    info("estimate: {:.0f} MB, {:.2g} s", memory.rank(), 1.6e-7 * membranes.vertices() * 400.0 * scene.stretching->steps);
    info("{} is valid", scene.path);
    return;
  }
  announce_set_up(measure_scene(scene, comm.size()));
  Timers timers;
  const auto start = std::chrono::steady_clock::now();
  FlowSimulation simulation(comm, scene, timers);
  const double set_up_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  print_packing(simulation);
  const auto& index = simulation.grid().index();
  const double nodes = static_cast<double>(index.global[0]) * index.global[1] * index.global[2];
  info("unknowns: {:.0f} grid cells x (3 velocities + pressure), {} surface vertices", nodes,
       simulation.coupling() ? simulation.coupling()->vertices() : 0);
  print_schedule(simulation.schedule());
  RunSize size;
  size.cells = nodes;
  size.skewed = !simulation.grid().orthogonal();
  size.vertices = simulation.coupling() ? static_cast<double>(simulation.coupling()->vertices()) : 0;
  size.steps = static_cast<double>(simulation.steps_left());
  size.cores = static_cast<double>(comm.size()) * thread_count();
  const std::string stability = simulation.coupling() ? simulation.coupling()->stability_text(simulation.next_step_us()) : "";
  if (!stability.empty()) {
    info("{}", stability);
    size.membrane_vertices = size.vertices;
    size.substeps = 1;
  } else if (simulation.membranes()) {
    const auto s = *simulation.coupling()->stability(simulation.next_step_us());
    info("coupling: margin of stability {:.2f} (M / (A dt) + beta = {:.3g} + {:.3g}, half the fluid's reaction {:.3g} pg/um2/us)",
         s.margin(), s.mass_term, s.beta, s.threshold());
    auto& membranes = *simulation.membranes();
    const double stable = membranes.stable_step_us();
    size.membrane_vertices = membranes.vertices();
    size.substeps = membranes.substeps(scene.time.step_us, s.beta);
    info("membrane: undamped stable step {:.3g} us, {} sub-steps a step", stable, size.substeps);
  }
  info("estimate: {:.0f} MB, {} steps, about {:.2g} s, and {:.2g} s to set up", memory.rank() * comm.size(), simulation.steps_left(),
       estimate_steps_s(size), set_up_s);
  info("{} is valid", scene.path);
}

void print_resolved(const Comm& comm, const RunOptions& options) {
  log_text(resolved_file(options, read_case(case_file(comm, options), options.overrides)));
}

void write_mesh(int vertices, const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool stl = extension == ".stl";
  if (!stl && extension != ".off")
    throw InputError(fmt::format("{}: cannot write a mesh as \"{}\"; use a name that ends in .off or .stl", path, extension));
  const TriangleMesh mesh = biconcave_mesh(vertices);
  if (stl)
    write_stl(path, mesh, StlFormat::binary);
  else
    write_off(path, mesh);
  info("{}: {} vertices, {} triangles, area {:.2f} um2, volume {:.2f} um3", path, mesh.vertices.size(), mesh.triangles.size(), area(mesh),
       volume(mesh));
}

}  // namespace corpuscle
