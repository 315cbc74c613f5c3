// How contacts went so far.
#pragma once

#include <algorithm>

namespace corpuscle {

struct ContactReport {
  long crossings = 0;          // vertices that went through a surface, all of which were put back
  long limited = 0;            // approaches in a step that would have taken more than half of a gap
  double smallest_gap = 1e30;  // um, between different bodies
  double smallest_own_gap = 1e30, smallest_wall_gap = 1e30;  // um, of a body to itself and to walls; 1e30: none within reach
  long lists = 0;              // how often they were made

  double smallest() const { return std::min({smallest_gap, smallest_own_gap, smallest_wall_gap}); }
};

}  // namespace corpuscle
