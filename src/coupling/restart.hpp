// Checkpoints of a flow simulation.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "coupling/flow_simulation.hpp"

#include <string>

namespace corpuscle {

/// Write everything that continuing with the same bits needs; the previous checkpoint stays until this one is complete.
/// @throws ComputationError  when the disk is full
void write_checkpoint(const std::string& path, FlowSimulation& simulation, const std::string& resolved);

/// @throws InputError  for a file that is damaged, foreign, or of another grid or other cells
void read_checkpoint(const std::string& path, FlowSimulation& simulation);

}  // namespace corpuscle

#endif
