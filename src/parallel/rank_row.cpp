#include "parallel/rank_row.hpp"

#include "parallel/traffic.hpp"

namespace corpuscle {

#ifdef CORPUSCLE_MPI

RankRow::RankRow(const Comm& comm, const std::array<int, 3>& ranks, int d) : size_(ranks[d]) {
  if (size_ == 1) return;
  const int at[3] = {comm.rank() % ranks[0], comm.rank() / ranks[0] % ranks[1], comm.rank() / (ranks[0] * ranks[1])};
  at_ = at[d];
  const int e = (d + 1) % 3, f = (d + 2) % 3;
  MPI_Comm_split(comm.handle(), at[e] + ranks[e] * at[f], at_, &row_);
}

RankRow::~RankRow() {
  int ended = 0;
  MPI_Finalized(&ended);
  if (row_ != MPI_COMM_NULL && !ended) MPI_Comm_free(&row_);
}

bool RankRow::add_up(int* starts, const int* changes, int n) {
  if (size_ == 1) return true;
  below_.assign(n, 0);  // what the lowest rank receives is left as it is
  traffic().reductions += 2;
  MPI_Allreduce(MPI_IN_PLACE, starts, n, MPI_INT, MPI_SUM, row_);
  MPI_Exscan(changes, below_.data(), n, MPI_INT, MPI_SUM, row_);
  bool closed = true;
  for (int i = 0; i < n; ++i) {
    closed = closed && (at_ < size_ - 1 || below_[i] + changes[i] == 0);
    starts[i] += below_[i];
  }
  return closed;
}

#else

RankRow::RankRow(const Comm&, const std::array<int, 3>&, int) {}
RankRow::~RankRow() = default;
bool RankRow::add_up(int*, const int*, int) { return true; }

#endif

}  // namespace corpuscle
