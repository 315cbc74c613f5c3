// The files that a case names, and what is in them.
#pragma once

#include "input/case.hpp"
#include "parallel/comm.hpp"

#include <string>

namespace corpuscle {

/// A line for each surface and grid file: "cells.0.mesh = <fingerprint of what is read from it> <path>". Rank 0 reads; the
/// same on all ranks.
/// @throws InputError  a file cannot be read
std::string fingerprint_files(const Comm& comm, const Case& scene);

}  // namespace corpuscle
