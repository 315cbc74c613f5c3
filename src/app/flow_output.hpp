// What a flow run writes: history, fields, cells, checkpoints, and the error figures of the report.
#pragma once

#include "coupling/energy_balance.hpp"
#include "output/cell_writer.hpp"
#include "output/field_writer.hpp"
#include "output/history.hpp"
#include "output/report.hpp"

#include <memory>
#include <optional>

namespace corpuscle {

class FlowOutput {
 public:
  /// @param restart_us  time of the checkpoint that the run continues from: files up to it are kept
  FlowOutput(const std::string& folder, const Case& scene, FlowSimulation& simulation, Timers& timers,
             std::optional<double> restart_us);

  /// Membranes break when their area has grown by 2 to 4 % (Evans, Waugh and Melnik, Biophys. J. 16, 1976): beyond the first
  /// a run warns at its end, beyond the second it is stopped.
  static constexpr double lysis_area = 0.04, senseless_area = 0.1;

  /// After every step (and before the first, with `start`): whatever is due.
  /// @throws ComputationError  when a file cannot be written, or a membrane has stretched far beyond what one can
  void after_step(bool start = false);
  /// The state as it is, at the end of a run that has finished or broken down.
  void write_checkpoint_now();
  const std::string& last_checkpoint() const { return last_checkpoint_; }
  /// The checkpoint that the run was started from is good until a newer one is written.
  void started_from(const std::string& checkpoint) { last_checkpoint_ = checkpoint; }
  /// Errors, iterations and counts gathered over the run.
  void fill(Report& report);

 private:
  bool due(double every_us) const;
  void gather();
  void write_history();
  void write_fields();
  void write_cells();
  void fill_energy(Report& report) const;
  void fill_quantities(Report& report) const;
  double traction_fallbacks() const;
  HistorySample cell_sample(int cell, const CellDiagnostics& d, const Triple& travelled) const;
  void watch_cells(const std::vector<CellDiagnostics>& cells);

  std::string folder_;
  Case scene_;
  FlowSimulation& simulation_;
  Timers& timers_;
  std::optional<double> restart_us_;
  std::unique_ptr<HistoryWriter> history_;
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<FieldWriter> fields_;
  std::unique_ptr<CellWriter> cells_;
#endif
  std::string last_checkpoint_;
  std::vector<double> first_area_, first_volume_;
  Tally momentum_, pressure_, projections_, coupling_, substeps_, residual_;
  EnergyBalance energy_;
  std::vector<HistorySample> last_;  // of every cell and body, at the last history sample
  double elastic_energy_ = 0;  // of all cells at the last history sample, fJ
  double divergence_ = 0, flux_correction_ = 0, volume_drift_ = 0, area_drift_ = 0, slip_ = 0;
  double splitting_ = 0;  // largest at the times of fields and cells
};

}  // namespace corpuscle
