#include "app/error_estimate.hpp"

#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/step_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <string_view>

namespace corpuscle {

namespace {

/// Of the cell's built-in mesh.
int fewest_vertices(const CellSettings& cell) { return cell.shape == CellSettings::Shape::biconcave ? 200 : 42; }

[[noreturn]] void refuse(std::string_view kind, std::string_view why) {
  throw InputError(fmt::format("--estimate-error={}: {}", kind, why));
}

CoarserRun doubled_spacing(const Case& scene) {
  if (!scene.grid) refuse("spacing", "this scene has no grid; use --estimate-error=vertices");
  if (scene.grid->generator == GridSettings::Generator::file)
    refuse("spacing", "a grid from a file cannot be coarsened; use --estimate-error=step");
  std::array<int, 3> nodes{};
  double ratio = 2;
  for (int d = 0; d < 3; ++d) {
    const int cells = scene.grid->nodes[d] - 1;
    nodes[d] = std::max(3, (cells + 1) / 2) + 1;
    if (nodes[d] < scene.grid->nodes[d]) ratio = std::min(ratio, double(cells) / (nodes[d] - 1));
  }
  if (nodes == scene.grid->nodes) refuse("spacing", "the grid has no more than the 4 nodes that are needed");
  CoarserRun run{"spacing", ratio, {}, {}, {}};
  run.overrides.push_back(fmt::format("grid.nodes=[{},{},{}]", nodes[0], nodes[1], nodes[2]));
  return run;
}

CoarserRun longer_step(const Case& scene) {
  if (!scene.fluid) refuse("step", "this scene has no time; use --estimate-error=vertices");
  const StepSchedule countable(scene.time);
  const long steps = std::lround(scene.time.end_us / scene.time.step_us);
  long ratio = 2;
  while (ratio <= steps && steps % ratio != 0) ++ratio;
  if (ratio > steps) refuse("step", "the run is a single step");
  const auto steps_times = [&](double factor) {
    std::vector<std::string> overrides{fmt::format("time.step_us={:.15g}", scene.time.step_us * factor)};
    if (scene.time.first_step_us > 0) overrides.push_back(fmt::format("time.first_step_us={:.15g}", scene.time.first_step_us * factor));
    return overrides;
  };
  return {"step", double(ratio), steps_times(static_cast<double>(ratio)), steps_times(0.5), {}};
}

CoarserRun fewer_vertices(const Case& scene) {
  if (scene.cells.empty()) refuse("vertices", "this scene has no [[cells]]; use --estimate-error=spacing,step");
  CoarserRun run{"vertices", std::sqrt(2.0), {}, {}, {}};
  std::set<std::string> coarsened;  // cells of one type share a key
  for (std::size_t c = 0; c < scene.cells.size(); ++c) {
    const auto& cell = scene.cells[c];
    if (!cell.mesh.empty()) refuse("vertices", fmt::format("cells.{} comes from a file and cannot be coarsened", c));
    const std::string key = cell.type < 0 ? fmt::format("cells.{}.vertices", c) : constant_key(cell, "vertices");
    const int vertices = std::max(cell.vertices / 2, fewest_vertices(cell));
    if (vertices >= cell.vertices) refuse("vertices", fmt::format("{} = {}: no mesh is coarser; raise it", key, cell.vertices));
    run.ratio = std::min(run.ratio, std::sqrt(double(cell.vertices) / vertices));
    if (coarsened.insert(key).second) run.overrides.push_back(fmt::format("{}={}", key, vertices));
  }
  return run;
}

/// Packed on another grid or with other meshes, cells start elsewhere.
void refuse_packing_anew(const Case& scene, const char* kind) {
  if (!scene.populations.empty())
    refuse(kind, "populations would be packed anew, and the runs differ from their start; use --estimate-error=step");
}

/// Of the kinds that the scene has something of; those that cannot be had say why.
std::vector<CoarserRun> all_runs(const Case& scene) {
  std::vector<CoarserRun> runs;
  bool any = false;
  const auto take = [&](bool has, const char* kind, CoarserRun (*make)(const Case&)) {
    if (!has) return;
    try {
      if (kind != std::string_view("step")) refuse_packing_anew(scene, kind);
      runs.push_back(make(scene));
      any = true;
    } catch (const InputError& error) {
      CoarserRun none;
      none.kind = kind;
      none.refused = error.what();
      runs.push_back(none);
    }
  };
  take(scene.grid.has_value(), "spacing", doubled_spacing);
  take(scene.fluid.has_value(), "step", longer_step);
  take(scene.has_cells(), "vertices", fewer_vertices);
  if (!any) refuse("all", "nothing of this scene can be coarsened");
  return runs;
}

}  // namespace

std::vector<CoarserRun> coarser_runs(const Case& scene, const std::string& kinds) {
  if (kinds == "all") return all_runs(scene);
  std::vector<CoarserRun> runs;
  for (const char* kind : {"spacing", "vertices"})
    if (kinds.find(kind) != std::string::npos) refuse_packing_anew(scene, kind);
  std::stringstream list(kinds);
  for (std::string kind; std::getline(list, kind, ',');) {
    if (std::any_of(runs.begin(), runs.end(), [&](const CoarserRun& run) { return run.kind == kind; })) continue;
    if (kind == "spacing") {
      runs.push_back(doubled_spacing(scene));
    } else if (kind == "step") {
      runs.push_back(longer_step(scene));
    } else if (kind == "vertices") {
      runs.push_back(fewer_vertices(scene));
    } else {
      refuse(kind, "unknown; use spacing, step, vertices (comma-separated) or all");
    }
  }
  return runs;
}

void add_error_bars(Report& report, const CoarserRun& run, const Report& coarser) {
  for (const auto& [name, value] : report.quantities) {
    const auto other = coarser.quantities.find(name);
    if (other == coarser.quantities.end()) continue;
    report.error_bars[name] += std::abs(value - other->second) / std::abs(run.ratio - 1);
  }
  nlohmann::json entry;
  entry["coarser"] = run.kind;
  entry["ratio"] = run.ratio;
  entry["quantities"] = coarser.quantities;
  entry["wall_s"] = coarser.wall_s;
  report.extra["error_estimate"].push_back(entry);
}

CoarserRun halved_run(const CoarserRun& run) { return {run.kind, 0.5, run.halved, {}, {}}; }

void note_missing_bars(Report& report, const CoarserRun& run, const std::string& reason) {
  report.extra["error_estimate"].push_back({{"coarser", run.kind}, {"ratio", run.ratio}, {"failed", reason}});
  report.extra["error_bars_lack"].push_back(run.kind);
}

void print_quantities(const Report& report) {
  if (report.quantities.empty()) return;
  std::string lacking;
  if (const auto found = report.extra.find("error_bars_lack"); found != report.extra.end() && !report.error_bars.empty())
    for (const auto& kind : *found) lacking += (lacking.empty() ? "" : ", ") + kind.get<std::string>();
  info("at the end{}:", lacking.empty() ? "" : fmt::format(" (+- without the error from: {})", lacking));
  constexpr std::size_t most = 12;  // more are in the report
  std::size_t shown = 0;
  for (const auto& [name, value] : report.quantities) {
    if (++shown > most) {
      info("  ... and {} more in report.json", report.quantities.size() - most);
      return;
    }
    const auto bar = report.error_bars.find(name);
    info("  {:<34} {:.6g}{}", name, value, bar == report.error_bars.end() ? std::string() : fmt::format(" +- {:.2g}", bar->second));
  }
}

}  // namespace corpuscle
