// What a flow run writes: history, fields, cells, checkpoints, and the error figures of the report.
#pragma once

#include "app/body_history.hpp"
#include "app/flow_report.hpp"
#include "app/run_totals.hpp"
#include "app/scene_runs.hpp"
#include "blood/blood_files.hpp"
#include "coupling/energy_balance.hpp"
#include "output/field_writer.hpp"
#include "output/report.hpp"

#include <chrono>
#include <memory>
#include <optional>

namespace corpuscle {

class FlowOutput {
 public:
  /// @param restart_us  time of the checkpoint that the run continues from: files up to it are kept
  /// @param start       when the program began this run
  FlowOutput(const Place& place, Case scene, FlowSimulation& simulation, Timers& timers, std::optional<double> restart_us,
             std::chrono::steady_clock::time_point start);

  /// After every step (and before the first, with `start`): whatever is due.
  /// @throws ComputationError  when a file cannot be written
  void after_step(bool start = false);
  /// The run ends here, before its time: a checkpoint, and what the report says of cells and bodies, but no sample that a
  /// run without the stop would not have.
  void stop();
  const std::string& last_checkpoint() const { return last_checkpoint_; }
  /// The checkpoint that the run was started from is good until a newer one is written; the report goes on from its totals.
  /// @param changed  keys of the case that are others than until then
  void started_from(const std::string& checkpoint, const RunTotals& totals, const std::vector<std::string>& changed);
  /// Errors, iterations, counts and times gathered over the run, and over those that it goes on from.
  void fill(Report& report);
  /// Of the errors that are known between steps, the one nearest to where it is bad, or furthest beyond. No rank waits for another.
  std::string worst_error() const;
  /// The same where the state is of no use.
  /// @param together  all ranks call; otherwise what this one knows
  void fill_broken(Report& report, bool together);

 private:
  bool due(double every_us) const;
  bool passed(double every_us) const;
  bool regular() const;
  void sample_flow();
  void gather();
  void measure_bodies();
  void write_fields();
  std::vector<double> wall_stress_Pa();
  void write_cells();
  void write_shared_cells();
#ifdef CORPUSCLE_HDF5
  void write_surfaces(CellWriter& writer, const SurfaceSet& set, const Components<double>& tractions) const;
#endif
  void write_checkpoint_now();
  void sample_blood();
  RunTotals totals_now(bool together = true);
  FlowRecord record() const;
  void fill_totals(Report& report, RunTotals now) const;
  void fill_blood(Report& report, const ContactReport& contact) const;
  void fill_blood_quantities(Report& report) const;

  std::string folder_, run_, files_;
  Case scene_;
  FlowSimulation& simulation_;
  Timers& timers_;
  std::unique_ptr<BodyHistory> history_;  // of a scene with bodies
#ifdef CORPUSCLE_HDF5
  std::unique_ptr<FieldWriter> fields_;
  std::unique_ptr<CellWriter> cells_;
  std::unique_ptr<CellWriter> bodies_;  // beside cells that are shared out
#endif
  std::string last_checkpoint_;
  std::unique_ptr<BloodSampler> blood_;
  std::unique_ptr<BloodFiles> blood_files_;
  Components<double> wall_stress_;
  RunTotals totals_;                                // `energy`, `immersed` and the times: only of the runs before this one
  std::optional<FlowSample> end_sample_;            // of the last step, where it is none of the regular ones
  std::optional<EnergyBalance::State> end_energy_;  // the same
  std::chrono::steady_clock::time_point start_;
  EnergyBalance energy_;
};

}  // namespace corpuscle
