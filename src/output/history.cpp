#include "output/history.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "core/units.hpp"
#include "output/on_root.hpp"

namespace corpuscle {
namespace {

std::string header(const HistoryColumns& columns) {
  std::string names =
      "time_us,cell,centroid_x_um,centroid_y_um,centroid_z_um,"
      "velocity_x_mm_per_s,velocity_y_mm_per_s,velocity_z_mm_per_s";
  if (columns.cells || columns.stretching) names += ",extent_x_um,extent_y_um,extent_z_um,area_um2,volume_um3,elastic_energy_fJ";
  if (columns.stretching) names += ",axial_um,transverse_um,force_pN";
  if (columns.bodies) names += ",force_x_nN,force_y_nN,force_z_nN,torque_x_nN_um,torque_y_nN_um,torque_z_nN_um";
  for (const auto& name : columns.more) names += "," + name;
  return names;
}

void add(std::string& line, const std::optional<double>& value, double unit = 1) {
  line += ',';
  if (value) line += fmt::format("{:.17g}", *value / unit);
}

void add(std::string& line, const std::optional<Triple>& values, double unit = 1) {
  for (int d = 0; d < 3; ++d) add(line, values ? std::optional((*values)[d]) : std::nullopt, unit);
}

}  // namespace

HistoryWriter::HistoryWriter(const std::string& folder, const Comm& comm, const HistoryColumns& columns, std::optional<double> restart_us)
    : comm_(comm), columns_(columns), table_((std::filesystem::path(folder) / "history.csv").string(), comm, header(columns), restart_us) {}

void HistoryWriter::write(const HistorySample& sample) {
  on_root(comm_, [&] {
    auto line = fmt::format("{:.17g},", sample.time_us);
    if (sample.cell >= 0) line += std::to_string(sample.cell);
    add(line, sample.centroid_um);
    add(line, sample.velocity_um_per_us, units::mm_per_s);
    if (columns_.cells || columns_.stretching) {
      add(line, sample.extent_um);
      add(line, sample.area_um2);
      add(line, sample.volume_um3);
      add(line, sample.elastic_energy_fJ);
    }
    if (columns_.stretching) {
      add(line, sample.axial_um);
      add(line, sample.transverse_um);
      add(line, sample.force_pN);
    }
    if (columns_.bodies) {
      add(line, sample.force_nN);
      add(line, sample.torque_nN_um);
    }
    for (std::size_t m = 0; m < columns_.more.size(); ++m)
      add(line, m < sample.more.size() && !std::isnan(sample.more[m]) ? std::optional(sample.more[m]) : std::nullopt);
    table_.write(line);
  });
}

}  // namespace corpuscle
