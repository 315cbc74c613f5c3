// A run of a scene, once its case is read and its folder found.
#pragma once

#include "app/run.hpp"
#include "coupling/step_schedule.hpp"
#include "output/report.hpp"

#include <functional>

namespace corpuscle {

/// Where a run puts its results, what to do there once it is sure to begin, and what its checkpoints say of it.
struct Place {
  std::string folder;
  std::function<void()> begin;
  std::function<void()> settle;  // once all outputs are open: what is out of date goes, the case as it is run is written
  std::string run;               // its name, see RunFolder
  std::string files;             // see fingerprint_files()
};

/// How a run has ended, other than by an error.
struct Ending {
  ExitCode code = exit_done;
  Report report;
};

/// What a report says whatever the run does.
Report start_report(const Comm& comm, const Case& scene);
/// Say where steps change their length.
void print_schedule(const StepSchedule& schedule);

/// Both write the report, also where the computation breaks down.
/// @param scene  given away, since the list of many cells is not to stay on every rank
/// @throws InputError        before anything in the folder has changed
/// @throws ComputationError
Ending run_flow(const Comm& comm, Case scene, const RunOptions& options, const Place& place);
Ending run_stretching(const Comm& comm, const Case& scene, const Place& place);

}  // namespace corpuscle
