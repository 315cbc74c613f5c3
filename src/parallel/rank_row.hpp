// The ranks whose blocks lie one behind the other along a direction of the grid.
#pragma once

#include <array>

#include "parallel/comm.hpp"

namespace corpuscle {

class RankRow {
 public:
  /// Along direction d, of blocks cut as the grid's. All ranks call.
  RankRow(const Comm& comm, const std::array<int, 3>& ranks_per_direction, int d);
  ~RankRow();
  RankRow(const RankRow&) = delete;
  RankRow& operator=(const RankRow&) = delete;

  int size() const { return size_; }
  /// starts [n] = their sum over the row, and the sum of changes [n] over the ranks below this one.
  /// @returns whether the changes of the whole row add up to nothing everywhere, as the last rank sees it
  bool add_up(int* starts, const int* changes, int n);

 private:
  std::vector<int> below_;
  int size_ = 1, at_ = 0;
#ifdef CORPUSCLE_MPI
  MPI_Comm row_ = MPI_COMM_NULL;
#endif
};

}  // namespace corpuscle
