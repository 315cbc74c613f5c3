// What a flow run's report says: error figures, energies, main quantities.
#pragma once

#include "app/body_history.hpp"
#include "app/figure_levels.hpp"
#include "app/run_totals.hpp"
#include "coupling/energy_balance.hpp"
#include "output/report.hpp"

namespace corpuscle {

/// What a report is made from.
struct FlowRecord {
  const Case& scene;
  FlowSimulation& simulation;
  const EnergyBalance& energy;
  const BodyHistory* history;  // null without bodies
  int widest;                  // RunTotals::widest
};

/// Errors, iterations, counts and times, as far as they were counted on the way.
/// @param totals  of this run and those before it
void report_totals(const FlowRecord& record, const RunTotals& totals, Report& report);
/// What the present state adds, once a run has come to its end. All ranks call.
void report_state(const FlowRecord& record, Report& report);
/// What the scene's error figures are shares of, as far as this rank knows.
FigureScales scales_of(const FlowRecord& record);
/// Warnings about error figures, from those that are there.
void judge_figures(const FlowRecord& record, Report& report);

}  // namespace corpuscle
