// What a flow run writes: history, fields, cells, checkpoints, and the error figures of the report.
#pragma once

#include "app/run_totals.hpp"
#include "app/scene_runs.hpp"
#include "blood/blood_files.hpp"
#include "blood/cell_shapes.hpp"
#include "coupling/energy_balance.hpp"
#include "output/cell_series.hpp"
#include "output/field_writer.hpp"
#include "output/history.hpp"
#include "output/report.hpp"

#include <chrono>
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

class FlowOutput {
 public:
  /// @param restart_us  time of the checkpoint that the run continues from: files up to it are kept
  /// @param start       when the program began this run
  FlowOutput(const Place& place, Case scene, FlowSimulation& simulation, Timers& timers,
             std::optional<double> restart_us, std::chrono::steady_clock::time_point start);

  /// After every step (and before the first, with `start`): whatever is due.
  /// @throws ComputationError  when a file cannot be written
  void after_step(bool start = false);
  /// The run ends here, before its time: a checkpoint, and what the report says of cells and bodies, but no sample that a
  /// run without the stop would not have.
  void stop();
  const std::string& last_checkpoint() const { return last_checkpoint_; }
  /// The checkpoint that the run was started from is good until a newer one is written; the report goes on from its totals.
  void started_from(const std::string& checkpoint, const RunTotals& totals);
  /// Errors, iterations, counts and times gathered over the run, and over those that it goes on from.
  void fill(Report& report);
  /// The same where the state is of no use.
  /// @param together  all ranks call; otherwise what this one knows
  void fill_broken(Report& report, bool together);

 private:
  bool due(double every_us) const;
  void sample_flow();
  void gather();
  void write_history();
  void measure();
  void measure_bodies();
  void write_checkpoint_now();
  void fill_totals(Report& report, RunTotals now) const;
  void write_fields();
  void write_cells();
  RunTotals totals_now(bool together = true);
  void fill_energy(Report& report) const;
  void fill_quantities(Report& report) const;
  void judge_figures(Report& report) const;
  HistorySample cell_sample(int cell, const CellDiagnostics& d, const Triple& travelled, const std::vector<double>& turned) const;
  const std::vector<std::string>& find_columns();
  const std::vector<std::vector<double>>& measure_shapes();
  std::vector<double> wall_stress_Pa();
  Triple axis_at_start(int number) const;
  void watch_cells(const std::vector<CellDiagnostics>& cells);
  void gather_samples();
  void write_shared_cells();
#ifdef CORPUSCLE_HDF5
  CellFigures cell_figures();
#endif
  void sample_blood();
  void fill_blood(Report& report, const ContactReport& contact) const;

  std::string folder_, run_, files_;
  Case scene_;
  FlowSimulation& simulation_;
  Timers& timers_;
  std::optional<double> restart_us_;
  std::unique_ptr<HistoryWriter> history_;
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<FieldWriter> fields_;
  std::unique_ptr<CellWriter> cells_;
  std::unique_ptr<CellSeries> series_;  // of many cells
#endif
  std::string last_checkpoint_;
  bool few_cells_ = true;  // each has lines of its own in the history; cells.h5 has what each of many does
  std::unique_ptr<CellShapes> shapes_;
  std::unique_ptr<BloodSampler> blood_;
  std::unique_ptr<BloodFiles> blood_files_;
  Components<double> wall_stress_;
  std::vector<std::string> shape_columns_;  // of the history, of cells
  RunTotals totals_;  // `energy`, `immersed` and the times: only of the runs before this one
  std::optional<FlowSample> end_sample_;  // of the last step, where it is none of the regular ones
  std::chrono::steady_clock::time_point start_;
  EnergyBalance energy_;
  std::vector<HistorySample> last_;  // of every cell and body, at the last history sample
  double elastic_energy_ = 0;        // of all cells at the last history sample, fJ
};

}  // namespace corpuscle
