#include "output/report.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <filesystem>
#include <sstream>

#include "common/types.hpp"
#include "core/log.hpp"
#include "output/on_root.hpp"
#include "output/text_file.hpp"

namespace corpuscle {

namespace {

nlohmann::json to_json(const Tally& tally) {
  if (tally.samples == 0) return nullptr;
  return {{"mean", tally.sum / static_cast<double>(tally.samples)}, {"max", tally.largest}};
}

}  // namespace

std::vector<std::string> outputs_left_out(const OutputSettings& output) {
  std::vector<std::string> lines;
#ifdef CORPUSCLE_HDF5
  (void)output;
#else
  const std::string reason = ": this program was built without HDF5 (configure with -DCORPUSCLE_HDF5=ON)";
  if (output.fields) lines.push_back("fields.h5 and fields.xdmf" + reason);
  if (output.cells) lines.push_back("cells.h5 and cells.xdmf" + reason);
  lines.push_back("checkpoint.h5" + reason);
#endif
  return lines;
}

int thread_count() { return Kokkos::DefaultHostExecutionSpace().concurrency(); }

std::string kokkos_configuration() {
  std::ostringstream out;
  Kokkos::print_configuration(out);
  return out.str();
}

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
#ifdef __APPLE__
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);  // bytes there
#else
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
#endif
}

void write_report(const std::string& folder, const Comm& comm, const Report& report) {
  nlohmann::json json = report.extra;
  json["case"] = report.case_path;
  json["title"] = report.title;
  json["resolved_case"] = report.resolved;
  json["version"] = version_number();
  json["git"] = git_hash();
  json["backend"] = backend_name();
  json["kokkos"] = kokkos_configuration();
  for (const auto& [name, value] : machine()) json["machine"][name] = value;
  for (const auto& [name, version] : libraries()) json["libraries"][name] = version;
  json["ranks"] = report.ranks > 0 ? report.ranks : comm.size();
  if (!report.stopped.empty()) json["stopped"] = report.stopped;
  if (!report.broke_down.empty()) json["broke_down"] = report.broke_down;
  json["threads"] = thread_count();
  json["modules"] = {{"active", report.active}, {"left_out", report.left_out}, {"left_out_cost", report.left_out_cost}};
  json["steps"] = report.steps;
  json["simulated_us"] = report.simulated_us;
  json["wall_s"] = report.wall_s;
  json["wall_s_this_run"] = report.wall_s_this_run > 0 ? report.wall_s_this_run : report.wall_s;
  json["wall_s_by_part"] = nlohmann::json::object();
  for (const auto& [part, seconds] : report.wall_s_by_part) json["wall_s_by_part"][part] = comm.max(seconds);
  json["peak_rss_mb"] = comm.sum(peak_rss_mb());
  json["peak_rss_mb_largest_rank"] = comm.max(peak_rss_mb());
  json["iterations"] = {{"momentum", to_json(report.momentum_iterations)},
                        {"pressure", to_json(report.pressure_iterations)},
                        {"projections", to_json(report.projections)},
                        {"coupling", to_json(report.coupling_iterations)},
                        {"membrane_substeps", to_json(report.membrane_substeps)}};
  json["errors"] = report.errors;
  for (const char* name : {"max_divergence", "volume_drift", "area_drift", "slip", "flux_correction", "coupling_residual"})
    if (!json["errors"].contains(name)) json["errors"][name] = nullptr;
  json["warnings"] = report.warnings;
  if (const WarningsTold* told = warnings_told()) {
    json["told"] = told->texts;
    if (told->more > 0) json["told"].push_back(fmt::format("{} more on the screen", told->more));
  }
  json["quantities"] = report.quantities;
  if (!report.error_bars.empty()) json["error_bars"] = report.error_bars;
  const auto path = (std::filesystem::path(folder) / "report.json").string();
  on_root(comm, [&] { replace_text_file(path, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n"); });
}

}  // namespace corpuscle
