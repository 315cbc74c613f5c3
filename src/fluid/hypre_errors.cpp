#include "fluid/hypre_errors.hpp"

#include "core/error.hpp"

#include <HYPRE_utilities.h>
#include <fmt/format.h>

namespace corpuscle {

namespace {

const char* name_of(HypreErrors::Step step) {
  switch (step) {
    case HypreErrors::matrix:
      return "take the matrix of the pressure equation";
    case HypreErrors::vectors:
      return "take the right-hand side of the pressure equation";
    case HypreErrors::amg_set_up:
      return "set up BoomerAMG for the pressure equation";
    case HypreErrors::amg_cycle:
      return "run a cycle of BoomerAMG for the pressure equation";
    default:
      return "solve the pressure equation by flexible GMRES";
  }
}

/// hypre's own words. Of an argument it remembers only this process's, so that its number is taken from the code.
std::string describe(int code) {
  if (code & HYPRE_ERROR_ARG) return fmt::format("[Error in argument {}]", code >> 3 & 31);
  char text[256] = "";
  HYPRE_DescribeError(code, text);
  std::string words = text;
  while (!words.empty() && words.back() == ' ') words.pop_back();
  return words;
}

}  // namespace

void HypreErrors::check(Step step) {
  const int code = HYPRE_GetError();
  if (code == 0) return;
  HYPRE_ClearAllErrors();
  if (code_ == 0 && (code & ~HYPRE_ERROR_CONV)) step_ = step, code_ = code & ~HYPRE_ERROR_CONV;
}

void HypreErrors::raise(const Comm& comm) {
  constexpr int codes = 1024;  // more than any code
  const int worst = static_cast<int>(comm.max(static_cast<double>(codes * step_ + code_ % codes)));
  step_ = none, code_ = 0;
  if (worst == 0) return;
  const int code = worst % codes;
  throw ComputationError(fmt::format(
      "pressure: hypre could not {}: error {}, {}. Likely cause: {}", name_of(static_cast<Step>(worst / codes)), code, describe(code),
      code & HYPRE_ERROR_MEMORY
          ? "not enough memory: take a coarser grid (grid.nodes) or more ranks on more machines"
          : "a row of the equation that is zero or not a number, of a diverging run (reduce time.step_us) or of a degenerate "
            "cell of the grid (grid.nodes, grid.file); or another hypre than the program was built with (./setup.sh)"));
}

}  // namespace corpuscle
