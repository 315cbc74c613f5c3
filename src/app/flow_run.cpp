#include "app/flow_output.hpp"
#include "app/modules.hpp"
#include "app/packing_text.hpp"
#include "app/scene_runs.hpp"
#include "app/stop_signal.hpp"
#include "app/waiting.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/restart.hpp"
#include "output/on_root.hpp"
#include "parallel/agree.hpp"
#include "parallel/traffic.hpp"
#include "populations/populations.hpp"

#include <fmt/ranges.h>

#include <filesystem>
#include <memory>

namespace corpuscle {

namespace {

using Clock = std::chrono::steady_clock;

#ifdef CORPUSCLE_HDF5
RunTotals totals_of(const std::string& path, const Restored& restored) {
  try {
    return totals_from(restored.totals);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
}
#endif

#ifdef CORPUSCLE_HDF5
/// Results that begin with the restart, since what was before is not in the folder.
void tell_missing(const Case& scene, const std::string& checkpoint, const std::string& folder, FlowSimulation& simulation) {
  namespace fs = std::filesystem;
  std::vector<std::string> missing;
  const auto expect = [&](bool written, const char* name) {
    if (written && !fs::exists(fs::path(folder) / name)) missing.emplace_back(name);
  };
  expect(simulation.coupling() != nullptr, "history.csv");
  expect(scene.output.fields, "fields.h5");
  expect(scene.output.cells && simulation.surfaces(), "cells.h5");
  expect(scene.blood && simulation.time() > scene.blood->from_us, "blood.csv");
  if (missing.empty()) return;
  std::error_code ignored;
  const auto text =
      fmt::format("{} in {} begin{} at {:.6g} us", fmt::join(missing, ", "), folder, missing.size() == 1 ? "s" : "", simulation.time());
  if (fs::equivalent(folder, fs::absolute(checkpoint, ignored).parent_path(), ignored))
    warn("{}: what was before is not there", text);
  else
    info("{}", text);
}
#endif

void print_coupling(FlowSimulation& simulation) {
  if (!simulation.membranes()) return;
  const double dt = simulation.next_step_us();
  const auto estimate = simulation.coupling()->stability(dt);
  if (!estimate) return;
  const StabilityEstimate& s = *estimate;
  info("coupling: M / (A dt) + beta = {:.3g} + {:.3g} against {:.3g} pg/um2/us, half the fluid's reaction: a margin of {:.2f}", s.mass_term,
       s.beta, s.threshold(), s.margin());
  const int substeps = simulation.membranes()->substeps(dt, s.beta);
  if (substeps > 1)
    info("membrane: {} sub-steps a step, since it is stable up to {:.3g} us without damping", substeps,
         simulation.membranes()->stable_step_us());
}

/// Of membranes that are forces; after a restart, of packed cells as they have grown.
void print_stability(FlowSimulation& simulation) {
  if (!simulation.membranes()) return;
  const std::string text = simulation.coupling()->stability_text(simulation.next_step_us());
  if (!text.empty()) info("{}", text);
}

/// Cells of populations that a checkpoint has; null where they are to be packed.
std::unique_ptr<PackedCells> packed_before(const Comm& comm, const Case& scene, const std::string& checkpoint, const Place& place) {
#ifdef CORPUSCLE_HDF5
  if (!checkpoint.empty() && !scene.populations.empty())
    return std::make_unique<PackedCells>(read_packed_cells(checkpoint, comm, scene, place.files));
#else
  (void)comm, (void)scene, (void)checkpoint, (void)place;
#endif
  return nullptr;
}

/// @param changed  keys whose values are others than until the checkpoint
/// @return what the report has counted until the checkpoint; none without a restart
std::optional<RunTotals> restart(const Case& scene, const std::string& checkpoint, const Place& place, FlowSimulation& simulation,
                                 std::vector<std::string>& changed) {
  if (checkpoint.empty()) return std::nullopt;
#ifdef CORPUSCLE_HDF5
  const Restored restored = read_checkpoint(checkpoint, simulation, scene.resolved, place.files);
  const auto totals = totals_of(checkpoint, restored);
  info("continuing from {:.6g} us", simulation.time());
  for (const auto& change : restored.changes) {
    warn("{} = {}, and it was {} until the checkpoint", change.key, change.now, change.before);
    changed.push_back(change.key);
  }
  if (simulation.done())
    throw InputError(fmt::format("{} is already at {:.6g} us, the end of this case; raise time.end_us", checkpoint, simulation.time()));
  if (simulation.at_outflow())
    throw InputError(
        fmt::format("{}: {}; to go on, lower time.stop_before_outflow_um, which is {:g} (the least is the way of "
                    "two steps)",
                    checkpoint, simulation.outflow_message(), scene.time.stop_before_outflow_um));
  tell_missing(scene, checkpoint, place.folder, simulation);
  return totals;
#else
  (void)scene, (void)place, (void)simulation, (void)changed;
  throw InputError("--restart: this build has no HDF5, so it has no checkpoints; configure with -DCORPUSCLE_HDF5=ON");
#endif
}

/// Energies of the same shape are others once a constant is: a balance over the restart cannot close.
void blame_changes(const std::vector<std::string>& changed, Report& report) {
  if (changed.empty()) return;
  for (auto& warning : report.warnings)
    if (warning["figure"].get<std::string>().rfind("energy_balance", 0) == 0)
      warning["message"] =
          fmt::format("{}. Or it is what the restart has changed: {}", warning["message"].get<std::string>(), fmt::join(changed, ", "));
}

/// A report of what was done before the computation broke down: by all ranks, or where some are stuck by those that are
/// not.
/// @param output  null if it could not even begin
void report_breakdown(const Comm& comm, const std::string& folder, FlowOutput* output, Report& report) {
  try {
    const bool together = all_here(comm);
    if (output) output->fill_broken(report, together);
#ifdef CORPUSCLE_MPI
    write_report(folder, together ? comm : Comm(MPI_COMM_SELF), report);
#else
    write_report(folder, comm, report);
#endif
  } catch (const std::exception&) {  // a full disk, perhaps: the error that is on its way says so
  }
}

/// Of the rank that sends most, a step of this run, output included: what many ranks must not have more of than few.
void report_traffic(const Comm& comm, const Traffic& before, long steps, Report& report) {
  if (comm.size() == 1 || steps == 0) return;
  const Traffic now = traffic();
  double each[3] = {static_cast<double>(now.messages - before.messages), static_cast<double>(now.bytes - before.bytes),
                    static_cast<double>(now.reductions - before.reductions)};
  comm.max(each, 3);
  const double n = static_cast<double>(steps);
  report.extra["traffic"] = {{"messages_per_step", each[0] / n}, {"bytes_per_step", each[1] / n}, {"reductions_per_step", each[2] / n}};
}

/// Steps until the end, a signal, or a cell at the outflow.
/// @return the signal, or an empty text
std::string advance(FlowSimulation& simulation, FlowOutput& output, StopSignal& signal, Progress& progress) {
  const long first = simulation.steps();
  while (!simulation.done()) {
    if (const auto name = signal.asked(); !name.empty()) return name;
    simulation.step();
    output.after_step();
    progress.update(simulation.steps() - first, simulation.time(), [&] { return output.worst_error(); });
    if (simulation.at_outflow()) break;
  }
  return "";
}

}  // namespace

Report start_report(const Comm& comm, const Case& scene) {
  Report report;
  report.ranks = comm.size();
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

Ending run_flow(const Comm& comm, Case scene, const RunOptions& options, const Place& place) {
  const auto start = Clock::now();
  Timers timers(options.profile);
  StopSignal signal(comm);
  auto packed = packed_before(comm, scene, options.restart, place);
  FlowSimulation simulation(comm, scene, timers, packed.get());
  packed.reset();
  print_packing(simulation);
  print_schedule(simulation.schedule());
  print_coupling(simulation);
  std::vector<std::string> changed;
  const auto totals = restart(scene, options.restart, place, simulation, changed);
  print_stability(simulation);
  place.begin();
  Ending ending{exit_done, start_report(comm, scene)};
  Report& report = ending.report;
  std::unique_ptr<FlowOutput> output;
  Progress progress(scene.time.end_us, simulation.steps_left());
  try {
    output = std::make_unique<FlowOutput>(place, std::move(scene), simulation, timers,
                                          totals ? std::optional(simulation.time()) : std::nullopt, start);
    place.settle();
    if (totals) {
      output->started_from(options.restart, *totals, changed);
    } else {
      output->after_step(true);
    }
    const Traffic before = traffic();
    const long first = simulation.steps();
    report.stopped = advance(simulation, *output, signal, progress);
    report_traffic(comm, before, simulation.steps() - first, report);
    progress.finish();
    if (!report.stopped.empty()) output->stop();
  } catch (const std::exception& error) {
    progress.finish();
    if (!output && dynamic_cast<const InputError*>(&error)) throw;  // results that this case cannot go on from
    report.broke_down =
        fmt::format("at {:.6g} us (step {}): {}", simulation.time() + simulation.next_step_us(), simulation.steps() + 1, error.what());
    report_breakdown(comm, place.folder, output.get(), report);
    const bool checkpoint = output && !output->last_checkpoint().empty();
    const std::string coarse = simulation.coupling() ? simulation.coupling()->coarse() : "";
    throw ComputationError(fmt::format("{}. {}Last good checkpoint: {}", report.broke_down,
                                       coarse.empty() ? "" : "But first: " + coarse + ". ",
                                       checkpoint ? output->last_checkpoint() : "none yet (output.checkpoint_every_us)"));
  }
  if (!report.stopped.empty()) {
    ending.code = exit_stopped;
  } else if (!simulation.done() && simulation.at_outflow()) {
    ending.code = exit_at_outflow;
    report.stopped = simulation.outflow_message();
  }
  fill_packing(report, simulation);
  output->fill(report);
  blame_changes(changed, report);
  write_report(place.folder, comm, report);
  return ending;
}

}  // namespace corpuscle
