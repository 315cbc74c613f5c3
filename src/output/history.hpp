// history.csv: one line per sample and body, every number with all its digits.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "input/case.hpp"
#include "output/sample_table.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

/// What is known of one cell or rigid body at one time; what is absent is an empty field of its line.
struct HistorySample {
  double time_us = 0;
  int cell = -1;  // number in the surface set: cells first, then rigid bodies; negative: a line about the flow
  std::optional<Triple> centroid_um, velocity_um_per_us, extent_um;
  std::optional<double> area_um2, volume_um3, elastic_energy_fJ;
  std::optional<double> axial_um, transverse_um, force_pN;  // stretching
  std::optional<Triple> force_nN, torque_nN_um;             // rigid bodies
  std::vector<double> more;                                 // values of the further columns
};

/// Groups of columns beyond time, number and motion.
struct HistoryColumns {
  bool cells = false, stretching = false, bodies = false;
  std::vector<std::string> more = {};  // names, with units
};

class HistoryWriter {
 public:
  /// Rank 0 writes; all ranks call.
  /// @param restart_us  samples of an existing history.csv up to this time are kept and continued; absent: a new file
  /// @throws InputError  the file cannot be written, or the one to continue has other columns
  HistoryWriter(const std::string& folder, const Comm& comm, const HistoryColumns& columns, std::optional<double> restart_us = {});

  /// Append one line and flush it. All ranks call; only rank 0's sample counts.
  /// @throws ComputationError  the disk is full
  void write(const HistorySample& sample);

 private:
  Comm comm_;
  HistoryColumns columns_;
  SampleTable table_;
};

}  // namespace corpuscle
