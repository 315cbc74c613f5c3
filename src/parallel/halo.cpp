#include "parallel/halo.hpp"

#include "core/error.hpp"
#include "parallel/traffic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace corpuscle {

namespace {

/// Rank coordinates, i fastest.
std::array<int, 3> coordinates(int rank, const std::array<int, 3>& ranks) {
  return {rank % ranks[0], (rank / ranks[0]) % ranks[1], rank / (ranks[0] * ranks[1])};
}

bool cut_is_possible(const std::array<int, 3>& ranks, const std::array<int, 3>& global) {
  for (int d = 0; d < 3; ++d)
    if (ranks[d] > 1 && global[d] / ranks[d] < IndexSpace::halo) return false;
  return true;
}

/// Slab of `layers` cells on one side, inside (owned) or outside (halo), as wide as already exchanged directions allow.
CellBox slab(const IndexSpace& index, int d, int side, bool outside, int layers) {
  CellBox box;
  for (int e = 0; e < 3; ++e) {
    const int pad = e < d ? layers : 0;
    box.lower[e] = -pad;
    box.upper[e] = index.n[e] + pad;
  }
  const int h = layers, n = index.n[d];
  if (side == 0) {
    box.lower[d] = outside ? -h : 0;
    box.upper[d] = outside ? 0 : h;
  } else {
    box.lower[d] = outside ? n : n - h;
    box.upper[d] = outside ? n + h : n;
  }
  return box;
}

/// Whether messages may start and end in the fields themselves.
constexpr bool whole_planes_pass = Kokkos::SpaceAccessibility<Kokkos::HostSpace, Memory>::accessible;

#ifdef CORPUSCLE_MPI
/// Along the last direction layers are whole planes, each component's in one piece, which pass from field to field in one message.
template <class Field>
void exchange_planes(const Comm& comm, const IndexSpace& index, const int (&neighbour)[2], const Field& field, int components, int layers) {
  using Value = typename Field::non_const_value_type;
  const int h = IndexSpace::halo, n = index.n[2], plane = index.stride(2), size = layers * plane;
  const int bytes = size * static_cast<int>(sizeof(Value)), first = index.cell(-h, -h, 0);
  const int sent[2] = {first, first + (n - layers) * plane}, filled[2] = {first - size, first + n * plane};
  MPI_Datatype planes = MPI_BYTE;  // all components'
  if (components > 1) {
    MPI_Type_create_hvector(components, bytes, static_cast<MPI_Aint>(index.size() * sizeof(Value)), MPI_BYTE, &planes);
    MPI_Type_commit(&planes);
  }
  const int count = components > 1 ? 1 : bytes;
  MPI_Request request[4];
  int pending = 0;
  Exec().fence();
  for (int side = 0; side < 2; ++side)
    if (neighbour[side] >= 0)
      MPI_Irecv(field.data() + filled[side], count, planes, neighbour[side], 1 - side, comm.handle(), &request[pending++]);
  for (int side = 0; side < 2; ++side) {
    if (neighbour[side] < 0) continue;
    traffic().sent(static_cast<long>(components) * bytes);
    MPI_Isend(field.data() + sent[side], count, planes, neighbour[side], side, comm.handle(), &request[pending++]);
  }
  MPI_Waitall(pending, request, MPI_STATUSES_IGNORE);
  if (components > 1) MPI_Type_free(&planes);
}
#endif

}  // namespace

std::array<int, 3> ranks_per_direction(int ranks, const std::array<int, 3>& global) {
  std::array<int, 3> best{};
  double least = std::numeric_limits<double>::max();
  for (int a = 1; a <= ranks; ++a) {
    if (ranks % a) continue;
    for (int b = 1; b <= ranks / a; ++b) {
      if ((ranks / a) % b) continue;
      const std::array<int, 3> blocks{a, b, ranks / a / b};
      if (!cut_is_possible(blocks, global)) continue;
      double cut = 0;
      for (int d = 0; d < 3; ++d) cut += (blocks[d] - 1.0) * global[(d + 1) % 3] * global[(d + 2) % 3];
      if (cut < least) least = cut, best = blocks;
    }
  }
  if (best[0] == 0)
    throw InputError(
        fmt::format("the grid of {} x {} x {} cells cannot be cut into {} blocks of at least {} cells a side: use fewer ranks or "
                    "a finer grid (grid.nodes)",
                    global[0], global[1], global[2], ranks, IndexSpace::halo));
  return best;
}

IndexSpace decompose(const Comm& comm, const std::array<int, 3>& global, const std::array<bool, 3>& periodic, std::array<int, 3>* ranks) {
  const std::array<int, 3> best = ranks_per_direction(comm.size(), global);
  const auto at = coordinates(comm.rank(), best);
  IndexSpace index;
  for (int d = 0; d < 3; ++d) {
    const int share = global[d] / best[d], rest = global[d] % best[d];
    index.n[d] = share + (at[d] < rest ? 1 : 0);
    index.first[d] = at[d] * share + std::min(at[d], rest);
    index.global[d] = global[d];
    index.periodic[d] = periodic[d];
  }
  if (ranks) *ranks = best;
  return index;
}

Halo::Halo(const Comm& comm, const IndexSpace& index, const std::array<int, 3>& ranks) : comm_(comm), index_(index) {
  const auto at = coordinates(comm.rank(), ranks);
  int largest = 0;
  for (int d = 0; d < 3; ++d) {
    for (int side = 0; side < 2; ++side) {
      auto to = at;
      to[d] += side == 0 ? -1 : 1;
      const bool beyond = to[d] < 0 || to[d] >= ranks[d];
      to[d] = (to[d] + ranks[d]) % ranks[d];
      neighbour_[d][side] = beyond && !index.periodic[d] ? -1 : to[0] + ranks[0] * (to[1] + ranks[1] * to[2]);
      if (neighbour_[d][side] >= 0 && neighbour_[d][side] != comm.rank())
        largest = std::max(largest, slab(index, d, side, true, IndexSpace::halo).size());
    }
  }
  for (int side = 0; side < 2 && largest > 0; ++side) {
    send_[side] = Array<double>(uninitialised("corpuscle::halo::send"), 3 * largest);
    receive_[side] = Array<double>(uninitialised("corpuscle::halo::receive"), 3 * largest);
    send_host_[side] = Kokkos::create_mirror_view(send_[side]);
    receive_host_[side] = Kokkos::create_mirror_view(receive_[side]);
  }
}

bool Halo::cut() const { return with_others(1).size() > index_.owned(); }

CellBox Halo::with_others(int layers) const {
  CellBox box;
  const auto around = [&](int rank) { return rank >= 0 && rank != comm_.rank() ? layers : 0; };
  for (int d = 0; d < 3; ++d) {
    box.lower[d] = -around(neighbour_[d][0]);
    box.upper[d] = index_.n[d] + around(neighbour_[d][1]);
  }
  return box;
}

bool Halo::shared() const {
  for (const auto& sides : neighbour_)
    if (sides[0] >= 0 || sides[1] >= 0) return true;
  return false;
}

template <class Field>
void Halo::run(const Field& field, int layers, bool own_too) {
  using Value = typename Field::non_const_value_type;
  [[maybe_unused]] const int components = Field::rank == 1 ? 1 : static_cast<int>(field.extent(1));
  // What comes from this rank itself, along directions that follow each other, in one go.
  CellBoxes within;
  std::array<bool, 3> around{};
  const auto copy_within = [&] {
    copy_around_periods(index_, within, around, field);
    within = {}, around = {};
  };
  for (int d = 0; d < 3; ++d) {
    const int low = neighbour_[d][0], high = neighbour_[d][1];
    if (low < 0 && high < 0) continue;
    if (wraps(d)) {
      if (!own_too) continue;
      for (int side = 0; side < 2; ++side) within.add(slab(index_, d, side, true, layers));
      around[d] = true;
      continue;
    }
    copy_within();
#ifdef CORPUSCLE_MPI
    if (d == 2 && whole_planes_pass) {
      exchange_planes(comm_, index_, neighbour_[2], field, components, layers);
      continue;
    }
    MPI_Request request[4];
    int pending = 0;
    for (int side = 0; side < 2; ++side) {
      if (neighbour_[d][side] < 0) continue;
      const int count = slab(index_, d, side, true, layers).size() * components;
      MPI_Irecv(receive_host_[side].data(), count * static_cast<int>(sizeof(Value)), MPI_BYTE, neighbour_[d][side], 1 - side,
                comm_.handle(), &request[pending++]);
    }
    for (int side = 0; side < 2; ++side) {
      if (neighbour_[d][side] < 0) continue;
      const CellBox box = slab(index_, d, side, false, layers);
      Kokkos::View<Value*, Memory, Kokkos::MemoryUnmanaged> buffer(reinterpret_cast<Value*>(send_[side].data()), box.size() * components);
      pack_box(index_, box, field, buffer);
      if (send_host_[side].data() != send_[side].data()) Kokkos::deep_copy(send_host_[side], send_[side]);
      Exec().fence();
      traffic().sent(static_cast<long>(box.size()) * components * sizeof(Value));
      MPI_Isend(send_host_[side].data(), box.size() * components * static_cast<int>(sizeof(Value)), MPI_BYTE, neighbour_[d][side], side,
                comm_.handle(), &request[pending++]);
    }
    MPI_Waitall(pending, request, MPI_STATUSES_IGNORE);
    for (int side = 0; side < 2; ++side) {
      if (neighbour_[d][side] < 0) continue;
      const CellBox box = slab(index_, d, side, true, layers);
      if (receive_[side].data() != receive_host_[side].data()) Kokkos::deep_copy(receive_[side], receive_host_[side]);
      Kokkos::View<Value*, Memory, Kokkos::MemoryUnmanaged> buffer(reinterpret_cast<Value*>(receive_[side].data()),
                                                                   box.size() * components);
      unpack_box(index_, box, buffer, field);
    }
#endif
  }
  copy_within();
}

template void Halo::run(const Components<double>&, int, bool);
template void Halo::run(const Array<double>&, int, bool);
template void Halo::run(const Components<float>&, int, bool);
template void Halo::run(const Array<float>&, int, bool);
template void Halo::run(const Array<int>&, int, bool);
template void Halo::run(const Array<unsigned long long>&, int, bool);
template void Halo::run(const Array<NodeKind>&, int, bool);
template void Halo::run(const Array<std::int8_t>&, int, bool);

}  // namespace corpuscle
