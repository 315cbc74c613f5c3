#include "parallel/gathering.hpp"

#include "parallel/traffic.hpp"

#include <algorithm>

namespace corpuscle {

namespace {

struct Block {
  int first[3], n[3];
};

std::vector<Block> all_blocks(const Comm& comm, const IndexSpace& part) {
  std::vector<double> bounds(6 * comm.size(), 0.0);
  for (int d = 0; d < 3; ++d) {
    bounds[6 * comm.rank() + d] = part.first[d];
    bounds[6 * comm.rank() + 3 + d] = part.n[d];
  }
  comm.sum(bounds.data(), static_cast<int>(bounds.size()));
  std::vector<Block> blocks(comm.size());
  for (int r = 0; r < comm.size(); ++r)
    for (int d = 0; d < 3; ++d) {
      blocks[r].first[d] = static_cast<int>(bounds[6 * r + d]);
      blocks[r].n[d] = static_cast<int>(bounds[6 * r + 3 + d]);
    }
  return blocks;
}

}  // namespace

Gathering::Gathering(const Comm& comm, const IndexSpace& part, const IndexSpace& whole, int direction) : comm_(comm), end_{0} {
  const std::vector<Block> blocks = all_blocks(comm, part);
  std::vector<int> cells;
  for (int r = 0; r < comm.size(); ++r) {
    Block block = blocks[(comm.rank() + r) % comm.size()];
    if (direction >= 0 && block.first[direction] + block.n[direction] == whole.n[direction]) ++block.n[direction];
    for (int k = 0; k < block.n[2]; ++k)
      for (int j = 0; j < block.n[1]; ++j)
        for (int i = 0; i < block.n[0]; ++i) cells.push_back(whole.cell(block.first[0] + i, block.first[1] + j, block.first[2] + k));
    end_.push_back(static_cast<int>(cells.size()));
  }
  cell_ = Array<int>(uninitialised("corpuscle::gathering::cell"), cells.size());
  Kokkos::deep_copy(cell_, Kokkos::View<int*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged>(cells.data(), cells.size()));
  buffer_ = Array<float>(uninitialised("corpuscle::gathering::buffer"), 3 * cells.size());
  buffer_host_ = Kokkos::create_mirror_view(buffer_);
}

/// One message brings the values of as many ranks as are known already (Bruck et al., IEEE Trans. Parallel Distrib. Syst. 8, 1997): a rank
/// sends as many messages as the logarithm of their number to base two, where one for each other rank would be most of a step's.
void Gathering::pass_on([[maybe_unused]] int components) {
#ifdef CORPUSCLE_MPI
  const int all = comm_.size(), rank = comm_.rank();
  for (int known = 1; known < all; known *= 2) {
    const int more = std::min(known, all - known), begin = components * end_[known];
    const int count = components * end_[known + more] - begin, sent = components * end_[more];
    traffic().sent(static_cast<long>(sent) * sizeof(float));
    MPI_Sendrecv(buffer_host_.data(), sent, MPI_FLOAT, (rank - known + all) % all, 0, buffer_host_.data() + begin, count, MPI_FLOAT,
                 (rank + known) % all, 0, comm_.handle(), MPI_STATUS_IGNORE);
  }
#endif
}

template <class Field>
void Gathering::gather(const Field& field, int components) {
  pack_cells(cell_, 0, end_[1], field, buffer_);
  if (buffer_host_.data() != buffer_.data()) Kokkos::deep_copy(buffer_host_, buffer_);
  Exec().fence();
  pass_on(components);
  if (buffer_host_.data() != buffer_.data()) Kokkos::deep_copy(buffer_, buffer_host_);
  unpack_cells(cell_, end_[1], end_.back(), buffer_, field);
}

template void Gathering::gather(const Array<float>&, int);
template void Gathering::gather(const Components<float>&, int);

}  // namespace corpuscle
