// Error bars of a run's main quantities, from further runs that are coarser in one respect each.
#pragma once

#include "input/case.hpp"
#include "output/report.hpp"

#include <string>
#include <vector>

namespace corpuscle {

/// A run to compare with.
struct CoarserRun {
  std::string kind;                    // "spacing", "step" or "vertices"
  double ratio = 2;                    // of grid spacings, steps or edge lengths, to those of the main run
  std::vector<std::string> overrides;  // section.key=value, on top of the main run's
  std::vector<std::string> halved;     // of steps: those of a finer run, should this one not be possible; else none
  std::string refused;                 // why there is no such run of this scene; else ""
};
/// In place of one that is not possible.
CoarserRun halved_run(const CoarserRun& run);

/// @param kinds  comma-separated: "spacing" (of the grid, doubled), "step" (doubled, or the next multiple that divides
///               the run), "vertices" (half as many on each cell); "all" takes those that the scene has;
///               one that is named twice counts once
/// @throws InputError  for a kind that does not exist or that the scene does not have
std::vector<CoarserRun> coarser_runs(const Case& scene, const std::string& kinds);

/// Add to the report: how the coarser run's quantities differ, and what that adds to their error bars. An error
/// proportional to the spacing to the power p is |difference| / (ratio^p - 1); p = 1 is taken, below every order shown for
/// this program, so that bars are too wide rather than too narrow.
void add_error_bars(Report& report, const CoarserRun& run, const Report& coarser);

/// The bars lack what a run of that kind would have told.
void note_missing_bars(Report& report, const CoarserRun& run, const std::string& reason);

/// The main quantities, with bars where there are any, for the screen; and which errors the bars lack.
void print_quantities(const Report& report);

}  // namespace corpuscle
