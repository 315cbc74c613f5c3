// What a run's history tells of cells and bodies.
#pragma once

#include "blood/cell_shapes.hpp"
#include "coupling/flow_simulation.hpp"
#include "output/cell_series.hpp"
#include "output/history.hpp"

#include <memory>
#include <optional>

namespace corpuscle {

#ifdef CORPUSCLE_HDF5
/// Figures of this rank's cells, a table each.
struct CellFigures {
  explicit CellFigures(std::vector<std::pair<std::string, int>> columns) : names(std::move(columns)), values(names.size()) {}
  void add(const std::pair<std::string, int>& column) { names.push_back(column), values.emplace_back(); }
  std::vector<CellTable> tables() const {
    std::vector<CellTable> all;
    for (std::size_t n = 0; n < names.size(); ++n) all.push_back({names[n].first, names[n].second, values[n].data()});
    return all;
  }
  std::vector<std::pair<std::string, int>> names;  // with their components
  std::vector<std::vector<double>> values;
};
#endif

/// The largest relative changes of cells' volumes and areas that any sample has met.
struct CellDrifts {
  double volume = 0, area = 0;
  int widest = 0;  // number of the cell whose area it is
};

class BodyHistory {
 public:
  /// @param simulation  of a scene with bodies
  /// @param restart_us  time of the checkpoint that the run continues from: lines up to it are kept
  BodyHistory(const std::string& folder, const Case& scene, FlowSimulation& simulation, std::optional<double> restart_us);

  /// Take a sample, which write() stores as well. All ranks call.
  void measure();
  /// @throws ComputationError  when a file cannot be written
  void write();

  /// Whether each cell has lines of its own; cells.h5 has what each of many does.
  bool few_cells() const { return few_cells_; }
  /// Of every cell and body at the last sample; of many cells their mean, as number -1.
  const std::vector<HistorySample>& last() const { return last_; }
  /// Of all cells at the last sample, fJ.
  double elastic_energy() const { return elastic_energy_; }
  /// Of this run's samples.
  const CellDrifts& drifts() const { return drifts_; }
  /// The first of HistorySample::more, of cells.
  const std::vector<std::string>& shape_columns() const { return shape_columns_; }
#ifdef CORPUSCLE_HDF5
  /// Of each of this rank's cells what the history has of few, now.
  CellFigures cell_figures();
#endif

 private:
  void find_shape_columns(const Case& scene);
  const std::vector<std::vector<double>>& measure_shapes();
  void watch_cells(const std::vector<CellDiagnostics>& cells);
  Triple axis_at_start(int number) const;
  HistorySample cell_sample(int cell, const CellDiagnostics& d, const Triple& travelled, const std::vector<double>& turned) const;
  void measure_cells();
  void gather_samples();
  void measure_bodies();

  FlowSimulation& simulation_;
  bool few_cells_ = true;
  std::vector<Triple> axes_;  // of few cells, at the start
  std::unique_ptr<CellShapes> shapes_;
  std::vector<std::string> shape_columns_, body_columns_;
  std::unique_ptr<HistoryWriter> history_;
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<CellSeries> series_;  // of many cells
#endif
  std::vector<HistorySample> last_;
  CellDrifts drifts_;
  double elastic_energy_ = 0;
};

}  // namespace corpuscle
