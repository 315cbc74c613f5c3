// The pressure as the unknown of a fixed point (momentum equation, then projection), accelerated.
#pragma once

#include "core/anderson.hpp"
#include "fluid/flux.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

class PressureAcceleration {
 public:
  PressureAcceleration(const Comm& comm, const IndexSpace& index)
      : index_(index),
        anderson_(index.owned(), remembered, [comm](double* values, int n) { comm.sum(values, n); }),
        guess_("corpuscle::fluid::pressure_guess", index.owned()),
        change_("corpuscle::fluid::pressure_change", index.owned()) {}

  /// Forget the passes so far. @param p  [cell] the pressure that the first one starts from
  void start(const Array<double>& p) {
    anderson_.start();
    compact_from_scalar(index_, p, guess_);
  }
  /// The pressure for the next pass, in place of what the last one made of its own; owned cells.
  void advance(const Array<double>& p) {
    compact_difference(index_, p, guess_, change_);
    anderson_.advance(guess_, change_);
    scalar_from_compact(index_, guess_, p);
  }

 private:
  static constexpr int remembered = 4;
  IndexSpace index_;
  AndersonAcceleration anderson_;
  Array<double> guess_, change_;  // compact
};

}  // namespace corpuscle
