#include "app/body_history.hpp"

#include "blood/guided_flow.hpp"
#include "cells/cell_state.hpp"
#include "common/extremes.hpp"
#include "core/log.hpp"
#include "membrane/shape_measures.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// Further columns of cells that move in a flow, before those of their shapes.
const std::vector<std::string> parachute_columns = {"rear_hollow_um", "front_dimple_um", "length_um", "diameter_um", "asymmetry"};
/// Further columns of rigid bodies: the force from the fluid's momentum balance, beside that from tractions.
const std::vector<std::string> balance_columns = {"balance_force_x_nN", "balance_force_y_nN", "balance_force_z_nN"};
/// And that of cells that touch them.
const std::vector<std::string> contact_columns = {"contact_force_x_nN", "contact_force_y_nN", "contact_force_z_nN"};

}  // namespace

BodyHistory::BodyHistory(const std::string& folder, const Case& scene, FlowSimulation& simulation, std::optional<double> restart_us)
    : simulation_(simulation) {
  const Comm& comm = simulation.grid().comm();
#ifdef CORPUSCLE_HDF5
  few_cells_ = simulation.cells() <= scene.output.cells_in_history || !simulation.shared_cells();
  // A file a sample, so not in every step.
  if (!few_cells_ && scene.output.history_every_us > 0)
    series_ = std::make_unique<CellSeries>(folder, comm, simulation.cells(), cell_rows(*simulation.shared_cells()), restart_us);
#endif
  if (!few_cells_ && scene.output.history_every_us == 0 && !scene.output.cells)
    warn(
        "there are {} cells, more than output.cells_in_history = {}: nothing of each is kept; set output.history_every_us (cell_series.h5) "
        "or "
        "output.cells = true",
        simulation.cells(), scene.output.cells_in_history);
  HistoryColumns columns;
  columns.cells = simulation.cells() > 0;
  columns.bodies = simulation.rigid_bodies() != nullptr;
  if (columns.cells) {
    find_shape_columns(scene);
    columns.more = shape_columns_;
    if (few_cells_)
      for (const auto& cell : scene.cells) axes_.push_back(cell.axis);
  }
  if (columns.bodies) {
    body_columns_ = balance_columns;
    if (simulation.shared_cells()) body_columns_.insert(body_columns_.begin(), contact_columns.begin(), contact_columns.end());
    columns.more.insert(columns.more.end(), body_columns_.begin(), body_columns_.end());
  }
  history_ = std::make_unique<HistoryWriter>(folder, comm, columns, restart_us);
}

/// What measures shapes is made for the flow that guides the cells.
void BodyHistory::find_shape_columns(const Case& scene) {
  const auto flow = find_guided_flow(scene, simulation_.fluid());
  shapes_ = std::make_unique<CellShapes>(simulation_.membranes()->types(), flow ? &flow->frame : nullptr);
  shape_columns_ = parachute_columns;
  shape_columns_.insert(shape_columns_.end(), shapes_->columns().begin(), shapes_->columns().end());
}

const std::vector<std::vector<double>>& BodyHistory::measure_shapes() {
  const Membranes& membranes = *simulation_.membranes();
  return shapes_->measure(membranes.surfaces(), membranes.cells(), membranes.views().type);
}

void BodyHistory::watch_cells(const std::vector<CellDiagnostics>& cells) {
  const double before = drifts_.area;  // of all ranks
  const Membranes& membranes = *simulation_.membranes();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    drifts_.volume = larger(drifts_.volume, std::abs(cells[c].volume_um3 / cells[c].rest_volume_um3 - 1));
    const int cell = static_cast<int>(c);
    // A capsule's sheet may grow; a red cell's bilayer may not, and what holds it says so.
    if (!membranes.holds_area(cell)) continue;
    const double area = std::abs(cells[c].area_um2 / cells[c].rest_area_um2 - 1);
    if (area > drifts_.area) drifts_.widest = membranes.number(cell);
    drifts_.area = larger(drifts_.area, area);
  }
  if (!simulation_.shared_cells()) return;
  const Comm& comm = simulation_.grid().comm();
  double drifts[2] = {drifts_.volume, drifts_.area};
  comm.max(drifts, 2);
  if (drifts[1] > before) drifts_.widest = static_cast<int>(comm.max(drifts_.area == drifts[1] ? drifts_.widest : -1.0));
  drifts_.volume = drifts[0], drifts_.area = drifts[1];
}

/// z for those that were packed.
Triple BodyHistory::axis_at_start(int number) const { return number < static_cast<int>(axes_.size()) ? axes_[number] : Triple{0, 0, 1}; }

/// @param travelled  by how much the cell has been moved back through periodic sides, um
/// @param turned     what CellShapes has found
HistorySample BodyHistory::cell_sample(int cell, const CellDiagnostics& d, const Triple& travelled,
                                       const std::vector<double>& turned) const {
  HistorySample sample;
  sample.time_us = simulation_.time();
  sample.cell = simulation_.membranes()->number(cell);
  sample.centroid_um = {d.centroid_um[0] + travelled[0], d.centroid_um[1] + travelled[1], d.centroid_um[2] + travelled[2]};
  sample.velocity_um_per_us = d.velocity_um_per_us;
  sample.extent_um = d.extent_um();
  sample.area_um2 = d.area_um2;
  sample.volume_um3 = d.volume_um3;
  sample.elastic_energy_fJ = d.energy_fJ();
  if (!few_cells_) return sample;
  const auto& v = d.velocity_um_per_us;
  // In a shear that goes past on both sides, and once a flow has come to rest, the way of the cell is but what rounding leaves.
  const double slow = std::max(1e-9, 0.01 * simulation_.fluid().statistics().reference_speed);
  const bool moving = std::hypot(v[0], v[1], v[2]) > slow;
  const auto shape = parachute_measures(body_mesh(*simulation_.surfaces(), cell), d.centroid_um, moving ? v : axis_at_start(sample.cell));
  sample.more = {shape.rear_hollow_um, shape.front_dimple_um, shape.length_um, shape.diameter_um, shape.asymmetry};
  sample.more.insert(sample.more.end(), turned.begin(), turned.end());
  return sample;
}

void BodyHistory::write() {
  for (const auto& sample : last_) history_->write(sample);
#ifdef CORPUSCLE_HDF5
  if (!series_) return;
  const CellFigures figures = cell_figures();
  series_->write(simulation_.time(), simulation_.steps(), cell_rows(*simulation_.shared_cells()), figures.tables());
#endif
}

void BodyHistory::measure() {
  last_.clear();
  if (simulation_.membranes()) measure_cells();
  if (simulation_.rigid_bodies()) measure_bodies();
}

void BodyHistory::measure_cells() {
  const auto cells = simulation_.membranes()->diagnostics();
  watch_cells(cells);
  elastic_energy_ = 0;
  for (const auto& cell : cells) elastic_energy_ += cell.energy_fJ();
  const auto travelled = simulation_.coupling()->wrapped_by();
  static const std::vector<std::vector<double>> none;
  const auto& turned = few_cells_ ? measure_shapes() : none;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    auto sample = cell_sample(static_cast<int>(c), cells[c], travelled[c], few_cells_ ? turned[c] : std::vector<double>());
    last_.push_back(sample);
  }
  if (simulation_.shared_cells()) gather_samples();
  for (auto& sample : last_)
    if (!body_columns_.empty()) sample.more.resize(shape_columns_.size() + body_columns_.size(), std::nan(""));
}

/// Every rank's samples to all, if cells are few, and else their mean.
void BodyHistory::gather_samples() {
  const Comm& comm = simulation_.grid().comm();
  constexpr std::size_t width = 12;
  const std::size_t more = few_cells_ ? shape_columns_.size() : 0, rows = few_cells_ ? simulation_.cells() : 1;
  std::vector<double> table(rows * (width + more), 0.0);
  table.push_back(elastic_energy_);
  for (const auto& sample : last_) {
    double* row = table.data() + (few_cells_ ? sample.cell * (width + more) : 0);
    for (int d = 0; d < 3; ++d) {
      row[d] += (*sample.centroid_um)[d];
      row[3 + d] += (*sample.velocity_um_per_us)[d];
      row[6 + d] += (*sample.extent_um)[d];
    }
    row[9] += *sample.area_um2, row[10] += *sample.volume_um3, row[11] += *sample.elastic_energy_fJ;
    for (std::size_t n = 0; n < more; ++n) row[width + n] += sample.more[n];
  }
  comm.sum(table.data(), static_cast<int>(table.size()));
  elastic_energy_ = table.back();
  last_.clear();
  for (std::size_t n = 0; n < rows; ++n) {
    double* row = table.data() + n * (width + more);
    if (!few_cells_)
      for (std::size_t k = 0; k < width; ++k) row[k] /= simulation_.cells();
    HistorySample sample;
    sample.time_us = simulation_.time();
    sample.cell = few_cells_ ? static_cast<int>(n) : -1;
    sample.centroid_um = {row[0], row[1], row[2]};
    sample.velocity_um_per_us = {row[3], row[4], row[5]};
    sample.extent_um = {row[6], row[7], row[8]};
    sample.area_um2 = row[9], sample.volume_um3 = row[10], sample.elastic_energy_fJ = row[11];
    sample.more.assign(row + width, row + width + more);
    last_.push_back(sample);
  }
}

void BodyHistory::measure_bodies() {
  const auto* bodies = simulation_.rigid_bodies();
  auto& immersed = *simulation_.immersed();
  simulation_.coupling()->tractions_for_output();
  const int first = immersed.surfaces().cells;
  const double dt = simulation_.last_step_us() > 0 ? simulation_.last_step_us() : simulation_.next_step_us();
  std::vector<Triple> centre(immersed.surfaces().bodies);
  for (int b = 0; b < bodies->count(); ++b) centre[first + b] = bodies->centre(b);
  const auto loads = immersed.loads(centre);
  const auto balance_force = immersed.balance_forces();
  for (int b = 0; b < bodies->count(); ++b) {
    const int number = simulation_.cells() + b;
    HistorySample sample;
    sample.time_us = simulation_.time();
    sample.cell = number;
    sample.centroid_um = bodies->centre(b);
    sample.velocity_um_per_us = bodies->velocity(b);
    sample.force_nN = loads[first + b][0];
    sample.torque_nN_um = loads[first + b][1];
    if (simulation_.membranes()) sample.more.assign(shape_columns_.size(), std::nan(""));
    if (simulation_.shared_cells()) {
      const auto contact = simulation_.coupling()->contact_load(b, dt);
      sample.more.insert(sample.more.end(), contact.begin(), contact.begin() + 3);
    }
    for (double f : balance_force[first + b]) sample.more.push_back(f);
    last_.push_back(sample);
  }
}

#ifdef CORPUSCLE_HDF5
CellFigures BodyHistory::cell_figures() {
  const auto travelled = simulation_.coupling()->wrapped_by();
  const auto cells = simulation_.membranes()->diagnostics();
  const auto& names = shapes_->columns();
  CellFigures figures(
      {{"centroid_um", 3}, {"velocity_um_per_us", 3}, {"extent_um", 3}, {"area_um2", 1}, {"volume_um3", 1}, {"elastic_energy_fJ", 1}});
  for (const auto& shape : names) figures.add({shape, 1});
  const auto& shapes = measure_shapes();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Triple size = cells[c].extent_um();
    for (int d = 0; d < 3; ++d) {
      figures.values[0].push_back(cells[c].centroid_um[d] + travelled[c][d]);
      figures.values[1].push_back(cells[c].velocity_um_per_us[d]);
      figures.values[2].push_back(size[d]);
    }
    figures.values[3].push_back(cells[c].area_um2);
    figures.values[4].push_back(cells[c].volume_um3);
    figures.values[5].push_back(cells[c].energy_fJ());
    for (std::size_t n = 0; n < names.size(); ++n) figures.values[6 + n].push_back(shapes[c][n]);
  }
  return figures;
}
#endif

}  // namespace corpuscle
