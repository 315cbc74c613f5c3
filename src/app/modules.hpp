// Which parts of the program a case uses, and which it does without.
#pragma once

#include "input/case.hpp"

#include <map>

namespace corpuscle {

/// What a module that is left out would add: kernels to every step (to every sub-step, for membrane viscosity) and memory.
/// For the immersed search both are the least that a body costs, if it moves.
struct ModuleCost {
  int kernels = 0;
  double megabytes = 0;
};

struct ModuleList {
  std::vector<std::string> active, left_out;
  std::map<std::string, ModuleCost> cost;  // of those left out, where the case says enough to know
};

ModuleList list_modules(const Case& scene, int ranks);

/// Two lines for the screen.
void print_modules(const ModuleList& modules);

}  // namespace corpuscle
