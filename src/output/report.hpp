// report.json: what a run did, how long each part took, and how large its errors are.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/extremes.hpp"
#include "input/case.hpp"
#include "output/version.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

/// A count that is taken once per step: its mean and maximum.
struct Tally {
  long samples = 0;
  double sum = 0, largest = 0;
  void add(double value) {
    ++samples;
    sum += value;
    largest = larger(largest, value);
  }
};

struct Report {
  std::string case_path, title;
  std::string stopped;                                      // by which signal, or because of what; empty: it ran to its end
  std::string broke_down;                                   // the message; empty: it did not
  int ranks = 0;                                            // 0: those that write the report
  std::string resolved;                                     // every key with the value used, as TOML
  std::vector<std::string> active, left_out;                // modules
  nlohmann::json left_out_cost = nlohmann::json::object();  // by module, where known: kernels_per_step, memory_mb
  long steps = 0;
  double simulated_us = 0;
  double wall_s = 0;                             // with the runs that this one goes on from
  double wall_s_this_run = 0;                    // 0: the same
  std::map<std::string, double> wall_s_by_part;  // of this rank; all ranks have the same parts
  Tally momentum_iterations, pressure_iterations, projections, coupling_iterations, membrane_substeps;
  /// Error measures by name; those of the contract that a run does not have are written as null.
  nlohmann::json errors = nlohmann::json::object();
  /// Of those that are bad: figure, value, level, key, message.
  nlohmann::json warnings = nlohmann::json::array();
  /// What the run is about, at its end, by names that carry the unit; and how far off these may be, where estimated.
  std::map<std::string, double> quantities, error_bars;
  /// Further entries of the top level.
  nlohmann::json extra = nlohmann::json::object();
};

/// Write `folder`/report.json, with all that has been warned of so far as `told`. All ranks call: wall_s_by_part is the largest over the
/// ranks, memory is summed.
/// @throws InputError, ComputationError  on every rank, if the file cannot be written
void write_report(const std::string& folder, const Comm& comm, const Report& report);

/// Outputs that the case asks for and this build cannot write, one line each with the reason; empty with HDF5.
std::vector<std::string> outputs_left_out(const OutputSettings& output);

/// Threads of the host execution space on this rank.
int thread_count();
/// Kokkos version and settings, as Kokkos prints them.
std::string kokkos_configuration();
/// Largest memory that this rank has occupied so far, MB.
double peak_rss_mb();

}  // namespace corpuscle
