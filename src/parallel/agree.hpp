// One rank's failure, felt by all.
#pragma once

#include <string>

#include "parallel/comm.hpp"

namespace corpuscle {

/// How long a rank that has failed waits for the others: they may wait for it where it will never come.
constexpr double patience_s = 8;

/// Each rank brings its failure, or an empty text. All ranks get that of the lowest rank that has one; empty if none
/// has. A rank with a failure whose others do not come within `patience_s` gets its own back: it must end the program.
std::string agree(const Comm& comm, const std::string& failure);

/// Whether all ranks get here within `patience_s`. False on those that did: the others are stuck, or have ended.
bool all_here(const Comm& comm);

}  // namespace corpuscle
