// How contacts went so far.
#pragma once

#include <algorithm>

namespace corpuscle {

struct ContactReport {
  long crossings = 0;          // vertices that went through a surface, all of which were put back
  long limited = 0;            // approaches in a step that would have taken more than half of a gap
  double smallest_gap = 1e30;  // um, between different cells; 1e30: none within reach
  double smallest_own_gap = 1e30, smallest_wall_gap = 1e30, smallest_body_gap = 1e30;  // to itself, to walls and to rigid bodies
  long lists = 0;                                                                      // how often they were made

  double smallest() const { return std::min({smallest_gap, smallest_own_gap, smallest_wall_gap, smallest_body_gap}); }
};

}  // namespace corpuscle
