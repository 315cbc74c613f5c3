// What the report says of a whole run: counted step by step, and carried over a restart in the checkpoint.
#pragma once

#include "coupling/energy_balance.hpp"
#include "output/report.hpp"

#include <map>
#include <string>

namespace corpuscle {

/// Figures of one step that are not taken after each.
struct FlowSample {
  double time_us = 0, splitting = 0;
  double slip_speed = 0, speed = 0;  // um/us, the largest at a surface and of the flow
};

struct RunTotals {
  Tally momentum, pressure, projections, coupling, substeps, residual;
  double divergence = 0, flux_correction = 0, volume_drift = 0, area_drift = 0;
  int widest = 0;                                                      // number of the cell whose area has drifted most
  double splitting_us = 0, splitting_until_us = 0, splitting_max = 0;  // integral over time until then, from the sampled steps
  double speed = 0;                                                    // um/us, the largest at a node so far
  double slip_speed = 0;                                               // um/us, the largest of the sampled steps
  double slip_um = 0, way_um = 0;                                      // integrals over time of slip and flow, from the same
  ImmersedReport immersed;
  ContactReport contact;
  EnergyBalance::State energy;
  std::vector<double> blood;  // of BloodSampler
  double wall_s = 0;          // of the runs before this one, and of each part
  std::map<std::string, double> wall_s_by_part;

  /// A sample stands for the time since the one before it.
  void add(const FlowSample& sample);
  /// Mean slip over the mean speed of the flow: a start from rest, or a pause, is a small part of both.
  double slip() const { return way_um <= 0 ? 0 : slip_um / way_um; }
};

/// As text for a checkpoint: every number with all its digits.
std::string to_text(const RunTotals& totals);
/// @throws InputError  the text is not what to_text() wrote
RunTotals totals_from(const std::string& text);

}  // namespace corpuscle
