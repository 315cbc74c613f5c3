// Memory that parts of a step use one after the other.
#pragma once

#include <string>

#include "common/types.hpp"

namespace corpuscle {

/// What one part leaves here the next may write over; whoever uses it asks for it anew each time.
class Workspace {
 public:
  /// Room for so many numbers, with some to spare.
  double* reserve(std::size_t numbers) {
    if (memory_.extent(0) < numbers) {
      memory_ = Array<double>();  // free before taking more
      memory_ = Array<double>(uninitialised("corpuscle::core::workspace"), numbers + numbers / 32 + 1);
    }
    return memory_.data();
  }

 private:
  Array<double> memory_;
};

}  // namespace corpuscle
