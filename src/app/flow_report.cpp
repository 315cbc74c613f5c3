#include "app/flow_report.hpp"

#include "app/figure_levels.hpp"
#include "app/reference_flows.hpp"
#include "core/units.hpp"
#include "fluid/flow_balances.hpp"
#include "immersed/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// Share of the surfaces' vertices whose last traction did not come from a full fit.
/// @param fits  how many came about in which way, by TractionFallback
double poor_share(const std::vector<long>& fits) {
  long all = 0, poor = 0;
  for (int how = traction_fitted; how <= traction_nothing; ++how) all += fits[how];
  for (int how : {traction_gradient, traction_normal, traction_nothing, pressure_average, pressure_nothing}) poor += fits[how];
  return all > 0 ? static_cast<double>(poor) / static_cast<double>(all) : 0;
}

void report_energy(const FlowRecord& record, Report& report) {
  const auto& [scene, simulation, energy, history, widest] = record;
  if (const auto whole = energy.imbalance()) report.errors["energy_balance"] = *whole;
  const auto& t = energy.totals();
  auto& terms = report.extra["energy_fJ"];
  terms = {{"boundaries", t.boundaries}, {"pressure_gradient", t.gradient}, {"dissipation", t.dissipation}, {"kinetic", t.kinetic}};
  if (simulation.rigid_bodies()) terms["on_bodies"] = t.on_bodies;
  if (!simulation.membranes()) return;
  if (const auto own = energy.coupling_imbalance()) report.errors["energy_balance_coupling"] = *own;
  if (t.membrane_dissipation < 0 && energy.largest_fJ() > 0)
    report.errors["membrane_drive"] = -t.membrane_dissipation / energy.largest_fJ();
  terms["on_cells"] = t.on_cells;
  terms["elastic"] = t.elastic;
  if (t.pushed != 0) terms["pushed"] = t.pushed;
  if (scene.contact) terms["contact"] = t.contact;
  terms["membrane_dissipation"] = t.membrane_dissipation;
  terms["membrane_kinetic"] = t.membrane_kinetic;
}

void report_quantities(const FlowRecord& record, Report& report) {
  const auto& [scene, simulation, energy, history, widest] = record;
  auto& all = report.quantities;
  const char* axes[] = {"x", "y", "z"};
  static const std::vector<HistorySample> none;
  for (const auto& sample : history ? history->last() : none) {
    if (sample.cell < 0) continue;
    const bool cell = sample.cell < simulation.cells();
    const std::string of = fmt::format("{}_{}_", cell ? "cell" : "body", sample.cell);
    if (cell) {
      const auto& v = *sample.velocity_um_per_us;
      all[of + "speed_mm_per_s"] = std::hypot(v[0], v[1], v[2]) / units::mm_per_s;
      all[of + "area_um2"] = *sample.area_um2;
      all[of + "elastic_energy_fJ"] = *sample.elastic_energy_fJ;
      const auto& shapes = history->shape_columns();
      for (std::size_t n = 0; n < shapes.size(); ++n) all[of + shapes[n]] = sample.more[n];
    }
    for (int d = 0; d < 3; ++d) {
      if (cell) all[of + "centroid_" + axes[d] + "_um"] = (*sample.centroid_um)[d];
      // The momentum balance converges faster: 0.4 to 1.4 % off where the sum of tractions is 4 to 22 % low.
      if (!cell) all[of + "force_" + axes[d] + "_nN"] = sample.more[sample.more.size() - 3 + d];
      if (!cell && simulation.shared_cells()) all[of + "contact_force_" + axes[d] + "_nN"] = sample.more[sample.more.size() - 6 + d];
      if (!cell) all[of + "traction_force_" + axes[d] + "_nN"] = (*sample.force_nN)[d];
      if (!cell) all[of + "torque_" + axes[d] + "_nN_um"] = (*sample.torque_nN_um)[d];
    }
  }
  const Triple mean = mean_velocity(simulation.fluid());
  all["superficial_speed_mm_per_s"] = std::hypot(mean[0], mean[1], mean[2]) / units::mm_per_s;
  if (energy.driving_pressure_kPa() > 0) all["driving_pressure_Pa"] = 1e3 * energy.driving_pressure_kPa();
}

void report_search(FlowSimulation& simulation, const RunTotals& now, Report& report) {
  if (!simulation.immersed()) return;
  auto& errors = report.errors;
  // Of the flow's own speed, prescribed or computed: the solvers' reference may be that of a membrane's return to its shape.
  errors["slip"] = now.slip();
  errors["slip_max"] = now.slip_speed / std::max({simulation.fluid().boundaries().largest_speed(), now.speed, speed_at_rest});
  const auto& search = now.immersed;
  report.extra["immersed"] = {{"classifications", search.classifications},
                              {"immersed_nodes", search.immersed},
                              {"inside_nodes", search.inside},
                              {"isolated_nodes", search.isolated},
                              {"uncovered_nodes", search.uncovered},
                              {"velocity_fallbacks", search.velocity_fallbacks},
                              {"least_wall_spacings", search.least_wall_spacings}};
  if (search.least_wall_spacings < 1e30) errors["least_wall_spacings"] = search.least_wall_spacings;
  if (search.least_body_spacings < 1e30)
    errors["least_body_spacings"] = report.extra["immersed"]["least_body_spacings"] = search.least_body_spacings;
}

void report_contact(FlowSimulation& simulation, const RunTotals& now, Report& report) {
  if (!simulation.coupling() || !simulation.coupling()->contact_report()) return;
  report.errors["crossings"] = now.contact.crossings;
  report.extra["contact"] = {
      {"crossings", now.contact.crossings}, {"limited_approaches", now.contact.limited}, {"lists", now.contact.lists}};
  for (const auto& [name, gap] : {std::pair{"smallest_gap_um", now.contact.smallest()},
                                  {"smallest_gap_between_cells_um", now.contact.smallest_gap},
                                  {"smallest_gap_within_cells_um", now.contact.smallest_own_gap},
                                  {"smallest_gap_to_walls_um", now.contact.smallest_wall_gap},
                                  {"smallest_gap_to_bodies_um", now.contact.smallest_body_gap}})
    report.extra["contact"][name] = gap < 1e30 ? nlohmann::json(gap) : nlohmann::json();
}

/// The section that the constants of a cell are in: of [[cells]], of a population's type.
std::string section_of(const Case& scene, const CellNames* names, int number) {
  int type = -1, beyond = number - static_cast<int>(scene.cells.size());
  if (beyond < 0) type = scene.cells[number].type;
  for (std::size_t p = 0; names && beyond >= 0 && p < names->count.size(); beyond -= names->count[p++]) type = scene.populations[p].type;
  return type < 0 ? fmt::format("cells.{}.", number) : fmt::format("cell_types.{}.", type);
}

/// What is said of the first cell is of the one whose area has drifted most, or of its type.
void name_cell(const Case& scene, const CellNames* names, int number, nlohmann::json& warnings) {
  const std::string named = "cells.0.", right = section_of(scene, names, number);
  if (right == named) return;
  for (auto& warning : warnings)
    for (const char* entry : {"key", "message"}) {
      std::string text = warning[entry];
      for (std::size_t at = text.find(named); at != std::string::npos; at = text.find(named, at + right.size()))
        text.replace(at, named.size(), right);
      warning[entry] = text;
    }
}

}  // namespace

void report_totals(const FlowRecord& record, const RunTotals& now, Report& report) {
  const auto& [scene, simulation, energy, history, widest] = record;
  auto& errors = report.errors;
  errors["max_divergence"] = now.divergence;
  errors["flux_correction"] = now.flux_correction;
  errors["splitting"] = now.splitting_until_us > 0 ? now.splitting_us / now.splitting_until_us : 0.0;
  errors["splitting_max"] = now.splitting_max;
  report_search(simulation, now, report);
  report_contact(simulation, now, report);
  if (simulation.membranes()) {
    errors["volume_drift"] = now.volume_drift;
    if (simulation.membranes()->any_holds_area()) errors["area_drift"] = now.area_drift;
    if (!simulation.shared_cells()) {
      errors["coupling_residual"] = now.residual.samples ? now.residual.sum / static_cast<double>(now.residual.samples) : 0.0;
      errors["coupling_residual_max"] = now.residual.largest;
    }
    report.extra["stability"] = simulation.coupling()->report(simulation.last_step_us());
  }
  report_energy(record, report);
  report.momentum_iterations = now.momentum;
  report.pressure_iterations = now.pressure;
  report.projections = now.projections;
  report.coupling_iterations = now.coupling;
  report.membrane_substeps = now.substeps;
  report.extra["cells"] = {simulation.grid().index().global[0], simulation.grid().index().global[1], simulation.grid().index().global[2]};
  report.wall_s = now.wall_s;
  report.wall_s_by_part = now.wall_s_by_part;
  report.steps = simulation.steps();
  report.simulated_us = simulation.time();
}

FigureScales scales_of(const FlowRecord& record) {
  return {record.simulation.fluid().statistics().reference_speed,
          record.energy.largest_fJ(),
          record.scene.fluid->convection == FluidSettings::Convection::none,
          false,
          record.simulation.shared_cells() != nullptr,
          record.scene.contact.has_value()};
}

void judge_figures(const FlowRecord& record, Report& report) {
  report.warnings = judge(report.errors, scales_of(record));
  const SurfaceSet* surfaces = record.simulation.surfaces();
  name_cell(record.scene, surfaces ? surfaces->names : nullptr, record.widest, report.warnings);
}

void report_state(const FlowRecord& record, Report& report) {
  const auto& [scene, simulation, energy, history, widest] = record;
  auto& errors = report.errors;
  errors["convection_over_viscosity"] = convection_over_viscosity(simulation.fluid());
  if (simulation.immersed()) {
    const auto fits = simulation.immersed()->traction_fits();
    report.extra["immersed"]["traction_fits"] = fits;
    errors["traction_fallbacks"] = poor_share(fits);
  }
  judge_figures(record, report);
  report_quantities(record, report);
  for (const auto& [name, value] : reference_errors(scene, simulation)) errors[name] = value;
  Triple mean = mean_velocity(simulation.fluid());
  for (double& component : mean) component /= units::mm_per_s;
  report.extra["superficial_velocity_mm_per_s"] = mean;
}

}  // namespace corpuscle
