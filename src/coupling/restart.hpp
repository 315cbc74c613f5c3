// Checkpoints of a flow simulation.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "coupling/flow_simulation.hpp"
#include "input/case_changes.hpp"

#include <string>
#include <vector>

namespace corpuscle {

/// What a checkpoint says beyond the state of the simulation; all the same on all ranks.
struct CheckpointTexts {
  std::string resolved;  // the case, as Case::resolved has it
  std::string files;     // fingerprints of the files that it names, see file_changes()
  std::string run;       // which run this is
  std::string totals;    // what the report has gathered so far
};

/// Write everything that continuing with the same bits needs; the previous checkpoint stays until this one is complete.
/// @throws ComputationError  when the disk is full
void write_checkpoint(const std::string& path, FlowSimulation& simulation, const CheckpointTexts& texts);

/// Where the cells of populations were packed by the run that wrote the checkpoint.
/// @throws InputError  for a checkpoint of another scene, or as CheckpointReader
PackedCells read_packed_cells(const std::string& path, const Comm& comm, const Case& scene, const std::string& files);

struct Restored {
  std::string totals;
  std::vector<CaseChange> changes;  // of keys that a restart may change
};

/// Go on from a checkpoint, on any number of ranks.
/// @param resolved, files  of the present case
/// @throws InputError  for a file that is damaged, foreign, or of another grid, other sides, or other cells or bodies
Restored read_checkpoint(const std::string& path, FlowSimulation& simulation, const std::string& resolved, const std::string& files);

}  // namespace corpuscle

#endif
