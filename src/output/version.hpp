// What this program is, and what it was built with: for --version, reports and files.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace corpuscle {

/// Semantic version, "0.1.0".
std::string version_number();
/// Hash of the source this program was built from, "unknown" outside a checkout.
std::string git_hash();
/// Name of the Kokkos execution space that kernels run in, such as "OpenMP".
std::string backend_name();
/// The libraries with their versions; "none" for one that this build does without.
std::vector<std::pair<std::string, std::string>> libraries();
/// Host, processor, cores and system, as far as they can be told.
std::vector<std::pair<std::string, std::string>> machine();
/// Program and libraries, a line each.
std::string version_text();

}  // namespace corpuscle
