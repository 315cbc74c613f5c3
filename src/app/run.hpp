// The commands of the program.
#pragma once

#include "core/exit_code.hpp"
#include "parallel/comm.hpp"

#include <optional>
#include <string>
#include <vector>

namespace corpuscle {

struct RunOptions {
  std::string case_path;
  std::optional<std::string> case_text;  // where it has been read already: from a pipe it comes only once
  std::string folder;                    // empty: runs/<name of the case file>-001, or the first number that is free
  bool overwrite = false;                // results that the folder holds
  std::vector<std::string> overrides;    // section.key=value
  std::string restart;                   // checkpoint to continue from, or its folder; empty: from the start
  bool profile = false;                  // wait for the device at the end of each part that is timed
  std::string estimate;                  // coarser runs for error bars (error_estimate.hpp); empty: none
};

/// Run a case to its end, and then the coarser runs for its error bars.
/// @return how it ended, other than by an error
/// @throws InputError, ComputationError
ExitCode run_case(const Comm& comm, const RunOptions& options);

/// Validate a case and print modules, unknowns and estimates of memory and time; run nothing. @throws InputError
void check_case(const Comm& comm, const RunOptions& options);

/// Print the case with every default filled in, as a case file. @throws InputError
void print_resolved(const Comm& comm, const RunOptions& options);

/// Write the biconcave mesh with exactly this many vertices as OFF or STL. @throws InputError
void write_mesh(int vertices, const std::string& path);

}  // namespace corpuscle
