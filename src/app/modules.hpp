// Which parts of the program a case uses, and which it does without.
#pragma once

#include "input/case.hpp"

namespace corpuscle {

struct ModuleList {
  std::vector<std::string> active, left_out;
};

ModuleList list_modules(const Case& scene, int ranks);

/// Two lines for the screen.
void print_modules(const ModuleList& modules);

}  // namespace corpuscle
