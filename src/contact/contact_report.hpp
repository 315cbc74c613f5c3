// How contacts went so far.
#pragma once

namespace corpuscle {

struct ContactReport {
  long crossings = 0;          // vertices found on the wrong side of a surface, all of which were put back
  double smallest_gap = 1e30;  // um, between different bodies
  long lists = 0;              // how often they were made
};

}  // namespace corpuscle
