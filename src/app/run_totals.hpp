// What the report says of a whole run: counted step by step, and carried over a restart in the checkpoint.
#pragma once

#include "coupling/energy_balance.hpp"
#include "output/report.hpp"

#include <map>
#include <string>

namespace corpuscle {

struct RunTotals {
  Tally momentum, pressure, projections, coupling, substeps, residual;
  double divergence = 0, flux_correction = 0, volume_drift = 0, area_drift = 0, slip = 0;
  double splitting = 0;  // largest at the times of fields and cells
  ImmersedReport immersed;
  EnergyBalance::State energy;
  double wall_s = 0;                             // of the runs before this one, and of each part
  std::map<std::string, double> wall_s_by_part;
};

/// As text for a checkpoint: every number with all its digits.
std::string to_text(const RunTotals& totals);
/// @throws InputError  the text is not what to_text() wrote
RunTotals totals_from(const std::string& text);

}  // namespace corpuscle
