#include "parallel/gathering.hpp"

#include "parallel/traffic.hpp"

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

Gathering::Gathering(const Comm& comm, const IndexSpace& part, const IndexSpace& whole, int direction) : comm_(comm) {
  std::vector<int> cells;
  for (Block block : all_blocks(comm, part)) {
    if (direction >= 0 && block.first[direction] + block.n[direction] == whole.n[direction]) ++block.n[direction];
    first_.push_back(static_cast<int>(cells.size()));
    for (int k = 0; k < block.n[2]; ++k)
      for (int j = 0; j < block.n[1]; ++j)
        for (int i = 0; i < block.n[0]; ++i)
          cells.push_back(whole.cell(block.first[0] + i, block.first[1] + j, block.first[2] + k));
    count_.push_back(static_cast<int>(cells.size()) - first_.back());
  }
  sent_ = count_, at_ = first_;
  cell_ = Array<int>(uninitialised("corpuscle::gathering::cell"), cells.size());
  Kokkos::deep_copy(cell_, Kokkos::View<int*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged>(cells.data(), cells.size()));
  buffer_ = Array<float>(uninitialised("corpuscle::gathering::buffer"), 3 * cells.size());
  buffer_host_ = Kokkos::create_mirror_view(buffer_);
}

template <class Field>
void Gathering::gather(const Field& field, int components) {
  const int rank = comm_.rank(), begin = first_[rank], all = static_cast<int>(cell_.extent(0));
  for (std::size_t r = 0; r < count_.size(); ++r) sent_[r] = components * count_[r], at_[r] = components * first_[r];
  pack_cells(cell_, begin, begin + count_[rank], field, buffer_);
  if (buffer_host_.data() != buffer_.data()) Kokkos::deep_copy(buffer_host_, buffer_);
  Exec().fence();
#ifdef CORPUSCLE_MPI
  for (int rank = 1; rank < comm_.size(); ++rank) traffic().sent(static_cast<long>(sent_[comm_.rank()]) * sizeof(float));
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, buffer_host_.data(), sent_.data(), at_.data(), MPI_FLOAT, comm_.handle());
#endif
  if (buffer_host_.data() != buffer_.data()) Kokkos::deep_copy(buffer_, buffer_host_);
  unpack_cells(cell_, 0, all, buffer_, field);
}

template void Gathering::gather(const Array<float>&, int);
template void Gathering::gather(const Components<float>&, int);

}  // namespace corpuscle
