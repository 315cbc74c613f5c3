// Values that are allowed and far from what anybody has measured: most are a slip of the unit.
#pragma once

#include "input/case.hpp"

#include <string>
#include <vector>

namespace corpuscle {

/// One text for each constant of the fluid, and of each kind of cell, that is hundreds of times off the usual range: key, value, the
/// range, and the unit. None where the constant is 0 or its default.
std::vector<std::string> unusual_values(const Case& scene);

}  // namespace corpuscle
