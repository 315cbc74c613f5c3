#include "app/figure_levels.hpp"
#include "app/scene_runs.hpp"
#include "app/stop_signal.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "core/timers.hpp"
#include "membrane/stretching.hpp"
#include "output/cell_writer.hpp"
#include "output/history.hpp"
#include "output/owned_values.hpp"

#include <chrono>
#include <cmath>
#include <memory>

namespace corpuscle {

namespace {

using Clock = std::chrono::steady_clock;

/// Thrown where a signal has asked the test to end.
struct Stopped {};

HistorySample sample_of(const StretchingStep& step) {
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
  return sample;
}

void fill(Report& report, const Case& scene, const StretchingResult& result) {
  const auto& last = result.steps.back();
  report.errors["volume_drift"] = std::abs(last.cell.volume_um3 / last.cell.rest_volume_um3 - 1);
  report.errors["area_drift"] = std::abs(last.cell.area_um2 / last.cell.rest_area_um2 - 1);
  report.errors["rest_residual"] = last.residual;
  report.extra["rest_shape"] = {{"diameter_um", result.rest.diameter_um},
                                {"thickness_center_um", result.rest.thickness_center_um},
                                {"thickness_max_um", result.rest.thickness_max_um}};
  report.extra["patch_vertices"] = result.patch_vertices;
  if (!scene.stretching->experiment.empty()) {
    const auto comparison = compare(result, read_experiment(scene.stretching->experiment));
    report.errors["experiment_points"] = comparison.points;
    if (comparison.points > 0) {
      report.errors["experiment_axial_rms_um"] = comparison.rms_axial_um;
      report.errors["experiment_transverse_rms_um"] = comparison.rms_transverse_um;
      report.errors["experiment_points_inside_bars"] = comparison.inside_both;
      report.errors["experiment_interpolation_um"] = comparison.interpolation_um;
    }
  }
  FigureScales scales;
  scales.stretching = true;
  report.warnings = judge(report.errors, scales);
  report.quantities = {{"axial_um", last.axial_um},
                       {"transverse_um", last.transverse_um},
                       {"rest_diameter_um", result.rest.diameter_um},
                       {"rest_thickness_center_um", result.rest.thickness_center_um},
                       {"rest_thickness_max_um", result.rest.thickness_max_um}};
}

}  // namespace

Ending run_stretching(const Comm& comm, const Case& scene, const Place& place) {
  const std::string& folder = place.folder;
  const auto start = Clock::now();
  Timers timers;
  Report report = start_report(comm, scene);
  HistoryColumns columns;
  columns.cells = columns.stretching = true;
  StopSignal signal(comm);
  Membranes membranes(scene.cells);
  if (!scene.stretching->experiment.empty()) read_experiment(scene.stretching->experiment);  // refused now or never
  place.begin();
  HistoryWriter history(folder, comm, columns);
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<CellWriter> cells;
  if (scene.output.cells) {
    const auto& set = membranes.surfaces();
    const auto mesh = body_mesh(set, 0);
    std::vector<std::int32_t> triangles;
    for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    cells = std::make_unique<CellWriter>(folder, comm, triangles, std::vector<std::int32_t>(set.triangles, 0), set.vertices);
  }
#endif
  place.settle();
  timers.start("relaxation");
  long number = 0;
  const auto write = [&](const StretchingStep& step) {
    const auto scope = timers.scope("output");
    history.write(sample_of(step));
#ifdef CORPUSCLE_HDF5
    if (cells) cells->write(step.force_pN, number, vertex_values(membranes.vertices(), membranes.surfaces().x).data());
#endif
    ++number;
    info("{:7.1f} pN   axial {:7.3f} um   transverse {:7.3f} um   {:6d} iterations   residual {:.1e}", step.force_pN, step.axial_um,
         step.transverse_um, step.iterations, step.residual);
    if (report.stopped = signal.asked(); !report.stopped.empty()) throw Stopped{};
  };
  const auto finish = [&] {
    timers.stop();
    report.steps = number;
    report.wall_s = std::chrono::duration<double>(Clock::now() - start).count();
    report.wall_s_by_part = timers.seconds();
    write_report(folder, comm, report);
  };
  try {
    fill(report, scene, stretch_cell(membranes, *scene.stretching, write));
  } catch (const Stopped&) {
    finish();
    return {exit_stopped, report};
  } catch (const ComputationError& error) {
    report.broke_down = error.what();
    finish();
    throw;
  }
  finish();
  return {exit_done, report};
}

}  // namespace corpuscle
