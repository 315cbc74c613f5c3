// What differs between the case that a checkpoint was written with and the one that goes on from it.
#pragma once

#include <string>
#include <vector>

namespace corpuscle {

struct CaseChange {
  std::string key;          // "fluid.kinematic_viscosity_um2_per_us", "cells.0.mass_pg"
  std::string before, now;  // as TOML; "absent" where the case has no such key
  bool geometry = false;    // the stored state does not fit: another grid, other sides, another surface
};

/// Keys whose values differ, in the order of the case, without those that only say when to stop and what to write.
/// @param before, now  resolved cases, as Case::resolved has them
std::vector<CaseChange> case_changes(const std::string& before, const std::string& now);

/// Files that both name under the same key, and whose content differs.
/// @param before, now  a line for each: "cells.0.mesh = <fingerprint of its content> <path>"
std::vector<CaseChange> file_changes(const std::string& before, const std::string& now);

}  // namespace corpuscle
