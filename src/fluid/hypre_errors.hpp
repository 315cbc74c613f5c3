// What hypre says went wrong.
#pragma once

#include "parallel/comm.hpp"

namespace corpuscle {

/// hypre's calls return, and add to, one code for the whole process. It is read after each group of calls, kept here, and
/// told where all ranks can stop alike.
class HypreErrors {
 public:
  enum Step { none, matrix, vectors, amg_set_up, amg_cycle, krylov };

  /// Read, and take back, what the calls since the last check reported. That a method did not converge is no failure here.
  void check(Step step);
  /// On all ranks together. @throws ComputationError  on each of them, if any has found a failure since the last raise()
  void raise(const Comm& comm);

 private:
  Step step_ = none;
  int code_ = 0;  // the first failure's
};

}  // namespace corpuscle
