#include "app/run_totals.hpp"

#include "common/extremes.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <cmath>

namespace corpuscle {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Tally, samples, sum, largest)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ImmersedReport, classifications, immersed, inside, isolated, uncovered, velocity_fallbacks,
                                   least_wall_spacings, least_body_spacings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EnergyTotals, boundaries, gradient, dissipation, kinetic, on_cells, on_bodies, pushed, elastic, contact,
                                   membrane_dissipation, membrane_kinetic)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EnergyBalance::State, totals, rates, first, driving_pressure, time, samples)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ContactReport, crossings, limited, smallest_gap, smallest_own_gap, smallest_wall_gap,
                                                smallest_body_gap, lists)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunTotals, momentum, pressure, projections, coupling, substeps, residual, divergence, flux_correction,
                                   volume_drift, area_drift, speed, slip_speed, slip_um, way_um, splitting_us, splitting_until_us,
                                   splitting_max, immersed, contact, energy, blood, wall_s, wall_s_by_part)

namespace {

/// JSON has no word for what is not a number: it writes null.
void read_nulls(nlohmann::json& value) {
  if (value.is_null()) value = std::nan("");
  if (value.is_structured())
    for (auto& entry : value) read_nulls(entry);
}

}  // namespace

void RunTotals::add(const FlowSample& sample) {
  const double since = sample.time_us - splitting_until_us;
  splitting_us += sample.splitting * since;
  slip_um += sample.slip_speed * since;
  way_um += sample.speed * since;
  splitting_until_us = sample.time_us;
  splitting_max = larger(splitting_max, sample.splitting);
  slip_speed = larger(slip_speed, sample.slip_speed);
}

std::string to_text(const RunTotals& totals) {
  nlohmann::json json(totals);
  json["widest"] = totals.widest;
  return json.dump();
}

RunTotals totals_from(const std::string& text) {
  try {
    auto json = nlohmann::json::parse(text);
    read_nulls(json);
    for (const char* later : {"slip_um", "way_um"})  // than checkpoints that are still read
      if (json.is_object() && !json.contains(later)) json[later] = 0.0;
    auto totals = json.get<RunTotals>();
    totals.widest = json.value("widest", 0);
    return totals;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("'totals' is damaged: {}", error.what()));
  }
}

}  // namespace corpuscle
