// What a run and `check` say of packed populations.
#pragma once

#include "coupling/flow_simulation.hpp"
#include "output/report.hpp"

namespace corpuscle {

/// Counts, hematocrits and smallest gaps; nothing without populations.
void print_packing(FlowSimulation& simulation);
/// The same for the report: `populations` and `tube_hematocrit`.
void fill_packing(Report& report, FlowSimulation& simulation);

}  // namespace corpuscle
