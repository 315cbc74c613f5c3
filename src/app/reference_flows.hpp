// Scenes whose developed flow is known exactly: their error is part of the report.
#pragma once

#include "coupling/flow_simulation.hpp"

#include <map>

namespace corpuscle {

/// Errors against the exact developed flow, by name; empty where none is known, or while what the sides prescribe still changes.
/// Straight tube without bodies, its wall at rest: Hagen-Poiseuille three quarters down the tube. Box with one moving wall
/// opposite a resting one, the other directions periodic: Couette.
std::map<std::string, double> reference_errors(const Case& scene, FlowSimulation& simulation);

}  // namespace corpuscle
