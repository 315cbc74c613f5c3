// What a restart of the flow needs for the same bits as without the stop.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

struct FluidState {
  Components<double> u, u_old;         // [cell, 3] um/us
  Array<double> p;                     // [cell] kPa
  Array<double> flux[3], flux_old[3];  // [cell] um3/us; flux_old only with convection
  int history_levels = 0;              // how many earlier velocities are valid
  double reference_speed = 0;          // um/us
  double time_us = 0, step_us = 0;     // of u (not filled by FluidSolver::state()), and from u_old to u

  /// The same with memory of its own.
  FluidState copy() const;
};

}  // namespace corpuscle
