// Which of a report's error figures are so bad that a run must not pass them over, and what helps.
#pragma once

#include <nlohmann/json.hpp>

namespace corpuscle {

/// What counts as rest, um/us: shares of a speed are of this one at least.
constexpr double speed_at_rest = 1e-9;

/// What some figures are shares of. Where that is next to nothing, they say nothing.
struct FigureScales {
  double speed_um_per_us = 0;  // the largest so far
  double energy_fJ = 0;        // the largest term of the energy balance
  bool convection_left_out = false;
  bool stretching = false;  // no flow: a cell pulled at its ends
  bool forces = false;      // membranes are forces
  bool contact = false;     // that may touch
};

/// The warnings of a report, an array: each has the `figure`, its `value`, the `level`, the `key` of the case file that
/// helps, and the `message` for the screen with all of them.
/// @param errors  Report::errors, by name; figures that are missing or null are passed over, those that are not a number
///                are bad
nlohmann::json judge(const nlohmann::json& errors, const FigureScales& scales);

/// The figure that comes nearest to where it is bad, or is furthest beyond, and that level: "energy_balance 0.01 of 0.05"; "" without any.
std::string worst_figure(const nlohmann::json& errors, const FigureScales& scales);

}  // namespace corpuscle
