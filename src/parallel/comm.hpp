// Message passing, or its absence: with CORPUSCLE_MPI off every call below is the single-rank answer.
#pragma once

#include <string>
#include <vector>

#ifdef CORPUSCLE_MPI
#include <mpi.h>
#endif

namespace corpuscle {

class Comm {
 public:
#ifdef CORPUSCLE_MPI
  /// Alone if message passing has not been started.
  explicit Comm(MPI_Comm comm = MPI_COMM_WORLD) : comm_(comm) {
    int started = 0;
    MPI_Initialized(&started);
    if (!started) return;
    MPI_Comm_rank(comm_, &rank_);
    MPI_Comm_size(comm_, &size_);
  }
  MPI_Comm handle() const { return comm_; }
#endif
  /// This rank by itself.
  static Comm alone();
  int rank() const { return rank_; }
  int size() const { return size_; }
  bool root() const { return rank_ == 0; }

  /// In place, over all ranks, on host memory. Extremes are not numbers on all ranks where any rank's is not.
  void sum(double* values, int n) const;
  void max(double* values, int n) const;
  double sum(double value) const { return sum(&value, 1), value; }
  double max(double value) const { return max(&value, 1), value; }
  double min(double value) const { return -max(-value); }
  long sum(long value) const;
  void barrier() const;
  void broadcast(std::string& text) const;

 private:
#ifdef CORPUSCLE_MPI
  MPI_Comm comm_;
#endif
  int rank_ = 0, size_ = 1;
};

}  // namespace corpuscle
