// How contacts went so far.
#pragma once

namespace corpuscle {

struct ContactReport {
  long crossings = 0;          // vertices that went through a surface, all of which were put back
  long limited = 0;            // approaches in a step that would have taken more than half of a gap
  double smallest_gap = 1e30;  // um, between different bodies
  long lists = 0;              // how often they were made
};

}  // namespace corpuscle
