#include "app/run.hpp"

#include "app/error_estimate.hpp"
#include "app/estimate.hpp"
#include "app/figure_levels.hpp"
#include "app/flow_output.hpp"
#include "app/modules.hpp"
#include "app/surfaces.hpp"
#include "app/waiting.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/restart.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/mesh_io.hpp"
#include "membrane/stretching.hpp"
#include "output/checkpoint.hpp"
#include "output/on_root.hpp"
#include "output/owned_values.hpp"

#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <filesystem>

namespace corpuscle {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void print_start(const Comm& comm, const Case& scene) {
  info("{}", scene.title.empty() ? scene.path : scene.title);
  info("corpuscle {}, {} on {} rank{} x {} thread{}", git_hash(), backend_name(), comm.size(),
       comm.size() == 1 ? "" : "s", thread_count(), thread_count() == 1 ? "" : "s");
  print_modules(list_modules(scene, comm.size()));
  for (const auto& line : outputs_left_out(scene.output)) warn("{}", line);
  print_surfaces(scene);
}

Report start_report(const Comm& comm, const Case& scene) {
  Report report;
  report.case_path = scene.path;
  report.title = scene.title;
  report.resolved = scene.resolved;
  report.extra["waiting"] = waiting_policy();
  const auto modules = list_modules(scene, comm.size());
  report.active = modules.active;
  report.left_out = modules.left_out;
  for (const auto& [name, cost] : modules.cost)
    report.left_out_cost[name] = {{"kernels_per_step", cost.kernels}, {"memory_mb", cost.megabytes}};
  return report;
}

void print_end(const Report& report, const std::string& folder) {
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

/// Where steps change their length.
void print_schedule(const StepSchedule& schedule) {
  const auto lengths = schedule.lengths_us();
  if (lengths.size() == 1) return;
  std::string text = fmt::format("{:g} us", lengths[0]);
  for (std::size_t n = 1; n < lengths.size(); ++n) {
    const double from = StepSchedule::steps_per_length * lengths[n];
    if (from < schedule.time_us(schedule.end())) text += fmt::format(", {:g} us from {:g} us on", lengths[n], from);
  }
  const auto again = schedule.restarts_us();
  if (!again.empty()) text += fmt::format("; as from the start at {:g} us, where the inflow changes", fmt::join(again, ", "));
  info("steps: {}; {} in all", text, schedule.steps_from(0));
}

Report run_flow(const Comm& comm, const Case& scene, const RunOptions& options, const std::string& folder) {
  const auto start = Clock::now();
  Timers timers;
  FlowSimulation simulation(comm, scene, timers);
  print_schedule(simulation.schedule());
  if (simulation.membranes()) {
    const auto s = *simulation.coupling()->stability(simulation.next_step_us());
    info("coupling: M / (A dt) + beta = {:.3g} + {:.3g} against {:.3g} pg/um2/us, half the fluid's reaction: a margin of {:.2f}",
         s.mass_term, s.beta, s.threshold(), s.margin());
    const int substeps = simulation.membranes()->substeps(simulation.next_step_us(), s.beta);
    if (substeps > 1)
      info("membrane: {} sub-steps a step, since it is stable up to {:.3g} us without damping", substeps,
           simulation.membranes()->stable_step_us());
  }
  std::optional<double> restart_us;
#ifdef CORPUSCLE_HDF5
  if (!options.restart.empty()) {
    read_checkpoint(options.restart, simulation);
    restart_us = simulation.time();
    info("continuing from {:.6g} us", simulation.time());
    if (simulation.done())
      throw InputError(fmt::format("{} is already at {:.6g} us, the end of this case; raise time.end_us",
                                   options.restart, simulation.time()));
  }
#else
  if (!options.restart.empty())
    throw InputError("--restart: this build has no HDF5, so it has no checkpoints; configure with -DCORPUSCLE_HDF5=ON");
#endif
  FlowOutput output(folder, scene, simulation, timers, restart_us);
  output.started_from(options.restart);
  if (!restart_us) output.after_step(true);
  Report report = start_report(comm, scene);
  Progress progress(scene.time.end_us, simulation.steps_left());
  const long first = simulation.steps();
  try {
    while (!simulation.done()) {
      simulation.step();
      output.after_step();
      progress.update(simulation.steps() - first, simulation.time());
    }
  } catch (const ComputationError& error) {
    progress.finish();
    const std::string coarse = simulation.coupling() ? simulation.coupling()->coarse() : "";
    throw ComputationError(fmt::format(
        "at {:.6g} us (step {}): {}. {}Last good checkpoint: {}", simulation.time() + simulation.next_step_us(),
        simulation.steps() + 1, error.what(), coarse.empty() ? "" : "But first: " + coarse + ". ",
        output.last_checkpoint().empty() ? "none yet (output.checkpoint_every_us)" : output.last_checkpoint()));
  }
  progress.finish();
  output.fill(report);
  report.wall_s = seconds_since(start);
  report.wall_s_by_part = timers.seconds();
  write_report(folder, comm, report);
  return report;
}

Report run_stretching(const Comm& comm, const Case& scene, const std::string& folder) {
  const auto start = Clock::now();
  Timers timers;
  Report report = start_report(comm, scene);
  HistoryColumns columns;
  columns.cells = columns.stretching = true;
  HistoryWriter history(folder, comm, columns);
  Membranes membranes(scene.cells);
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<CellWriter> cells;
  if (scene.output.cells) {
    const auto& set = membranes.surfaces();
    const auto mesh = body_mesh(set, 0);
    std::vector<std::int32_t> triangles;
    for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    cells = std::make_unique<CellWriter>(folder, comm, triangles, std::vector<std::int32_t>(set.triangles, 0),
                                         set.vertices);
  }
#endif
  timers.start("relaxation");
  long number = 0;
  const auto result = stretch_cell(membranes, *scene.stretching, [&](const StretchingStep& step) {
    const auto scope = timers.scope("output");
    HistorySample sample;
    sample.cell = 0;
    sample.centroid_um = step.cell.centroid_um;
    sample.extent_um = step.cell.extent_um();
    sample.area_um2 = step.cell.area_um2;
    sample.volume_um3 = step.cell.volume_um3;
    sample.elastic_energy_fJ = step.cell.energy_fJ();
    sample.axial_um = step.axial_um;
    sample.transverse_um = step.transverse_um;
    sample.force_pN = step.force_pN;
    history.write(sample);
#ifdef CORPUSCLE_HDF5
    if (cells)
      cells->write(step.force_pN, number, vertex_values(membranes.vertices(), membranes.surfaces().x).data());
#endif
    ++number;
    info("{:7.1f} pN   axial {:7.3f} um   transverse {:7.3f} um   {:6d} iterations   residual {:.1e}", step.force_pN,
         step.axial_um, step.transverse_um, step.iterations, step.residual);
  });
  timers.stop();
  report.steps = number;
  const auto& last = result.steps.back();
  report.errors["volume_drift"] = std::abs(last.cell.volume_um3 / last.cell.rest_volume_um3 - 1);
  report.errors["area_drift"] = std::abs(last.cell.area_um2 / last.cell.rest_area_um2 - 1);
  report.errors["rest_residual"] = last.residual;
  report.extra["rest_shape"] = {{"diameter_um", result.rest.diameter_um},
                                {"thickness_center_um", result.rest.thickness_center_um},
                                {"thickness_max_um", result.rest.thickness_max_um}};
  auto judged = report.errors;
  judged.erase("volume_drift");  // the volume is held by a modulus here, not by the flow around
  report.warnings = judge(judged, {});
  report.extra["patch_vertices"] = result.patch_vertices;
  if (!scene.stretching->experiment.empty()) {
    const auto comparison = compare(result, read_experiment(scene.stretching->experiment));
    report.errors["experiment_axial_rms_um"] = comparison.rms_axial_um;
    report.errors["experiment_transverse_rms_um"] = comparison.rms_transverse_um;
    report.errors["experiment_points_inside_bars"] = comparison.inside_both;
    report.errors["experiment_points"] = comparison.points;
  }
  report.quantities = {{"axial_um", last.axial_um},
                       {"transverse_um", last.transverse_um},
                       {"rest_diameter_um", result.rest.diameter_um},
                       {"rest_thickness_center_um", result.rest.thickness_center_um},
                       {"rest_thickness_max_um", result.rest.thickness_max_um}};
  report.wall_s = seconds_since(start);
  report.wall_s_by_part = timers.seconds();
  write_report(folder, comm, report);
  return report;
}

Report run_scene(const Comm& comm, const Case& scene, const RunOptions& options, const std::string& folder) {
  return scene.stretching ? run_stretching(comm, scene, folder) : run_flow(comm, scene, options, folder);
}

/// Error bars from coarser runs, each with its own report beside the main run's. A coarser run may be refused or break
/// down where the main one did not: then the report says so instead.
void estimate_errors(const Comm& comm, const Case& scene, const RunOptions& options, const std::vector<CoarserRun>& runs,
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
      on_root(comm, [&] { prepare_folder(own_folder); });
      open_log(comm.root(), true);
      add_error_bars(report, run, run_scene(comm, coarser, {}, own_folder));
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
}

std::string result_folder(const RunOptions& options) {
  if (!options.folder.empty()) return options.folder;
  return "runs/" + std::filesystem::path(options.case_path).stem().string();
}

}  // namespace

void run_case(const Comm& comm, const RunOptions& options) {
  const Case scene = read_case(options.case_path, options.overrides);
  const MemoryEstimate memory = require_memory(comm, scene);
  const std::string folder = result_folder(options);
  if (!options.estimate.empty() && !options.restart.empty())
    throw InputError("--estimate-error compares whole runs: leave out --restart");
  if (scene.stretching && !options.restart.empty())
    throw InputError("--restart: a stretching test has no checkpoints; run it again");
  if (scene.stretching && comm.size() > 1)
    throw InputError(fmt::format("a stretching test runs on one rank, not {}: start it without mpirun", comm.size()));
  const auto coarser = options.estimate.empty() ? std::vector<CoarserRun>{} : coarser_runs(scene, options.estimate);
  on_root(comm, [&] {
    prepare_folder(folder);
    std::filesystem::remove(folder + "/report.json");  // of an earlier run: this one may not get to write its own
  });
  print_start(comm, scene);
  info("memory:   {}", memory_text(memory, comm.size()));
  Report report = run_scene(comm, scene, options, folder);
  if (!coarser.empty()) estimate_errors(comm, scene, options, coarser, folder, report);
  print_end(report, folder);
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
  if (simulation.membranes()) {
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
