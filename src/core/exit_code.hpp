// How a run can end: every exit code of the program, the same on all ranks.
#pragma once

#include "core/error.hpp"

namespace corpuscle {

enum ExitCode {
  exit_done = 0,
  exit_input_wrong = InputError::exit_code,       // 2: nothing was run, nothing in the folder has changed
  exit_broke_down = ComputationError::exit_code,  // 3: with a report that says what; results so far are there
  exit_stopped = 4,                               // by a signal: with report and checkpoint
  exit_at_outflow = 5,                            // a cell reached the outflow: with all results and a checkpoint
};

}  // namespace corpuscle
