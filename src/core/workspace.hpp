// Memory that parts of a step use one after the other.
#pragma once

#include <string>
#include <utility>

#include "common/types.hpp"

namespace corpuscle {

/// What one part leaves here the next may write over; whoever uses it asks for it anew each time.
class Workspace {
 public:
  /// Room for so many numbers, with some to spare.
  double* reserve(std::size_t numbers) {
    const std::size_t all = kept_ + numbers;
    if (memory_.extent(0) < all) {
      Array<double> before;
      if (kept_ > 0) before = memory_;
      memory_ = Array<double>();  // free before taking more
      memory_ = Array<double>(uninitialised("corpuscle::core::workspace"), all + all / 64 + 1);
      const auto kept = std::make_pair(std::size_t(0), kept_);
      if (kept_ > 0) Kokkos::deep_copy(Kokkos::subview(memory_, kept), Kokkos::subview(before, kept));
    }
    return memory_.data() + kept_;
  }

  /// Room for so many numbers that others leave alone until release(). Asked for again, it is where it is then: reserve() may move it.
  /// What is kept already stays, if it is as many.
  double* keep(std::size_t numbers) {
    if (kept_ != numbers) {
      kept_ = 0;
      reserve(numbers);
      kept_ = numbers;
    }
    return memory_.data();
  }
  std::size_t kept() const { return kept_; }
  void release() { kept_ = 0; }

 private:
  Array<double> memory_;
  std::size_t kept_ = 0;
};

}  // namespace corpuscle
