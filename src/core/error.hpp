// The two ways a run can end badly, and the exit code of each.
#pragma once

#include <stdexcept>
#include <string>

namespace corpuscle {

/// The input is wrong: the message names file, line, key, value and what is allowed. Exit code 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
  static constexpr int exit_code = 2;
};

/// The computation broke down: the message names quantity, where, when and the likely cause. Exit code 3.
struct ComputationError : std::runtime_error {
  using std::runtime_error::runtime_error;
  static constexpr int exit_code = 3;
};

}  // namespace corpuscle
