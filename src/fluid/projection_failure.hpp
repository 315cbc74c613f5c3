// Why a projection did not make the flow free of divergence, as far as its figures tell.
#pragma once

#include <string>

namespace corpuscle {

/// Largest magnitudes over all ranks. Divergences are net fluxes out of one cell, um3/us.
struct ProjectionFailure {
  double divergence = 0, target = 0;    // what is left, and what was wanted
  double before = 0;                    // what the last linear solve started from
  double net_inflow = 0;                // um3/us, into a region without an outflow: no pressure can take it away
  double face_flux = 0;                 // um3/us
  double speed = 0, earlier_speed = 0;  // um/us; the second is the larger of a step before and of what is prescribed
  int iterations = 0;                   // of all solves in this step
  bool skewed = false;
};

/// What failed, the figures, the cause that they show, and the key that helps.
std::string explain(const ProjectionFailure& failure);

}  // namespace corpuscle
