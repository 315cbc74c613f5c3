// How the grid is cut over ranks, and the exchange of halo layers between them.
#pragma once

#include "grid/halo_copy.hpp"
#include "parallel/comm.hpp"

#include <array>

namespace corpuscle {

/// How many blocks along each direction have the least surface between them.
/// @throws InputError  when some block would be thinner than the halo.
std::array<int, 3> ranks_per_direction(int ranks, const std::array<int, 3>& global);

/// Cut a grid of global[] cells into comm.size() blocks along all three directions, with the least surface.
/// @throws InputError  when some block would be thinner than the halo.
IndexSpace decompose(const Comm& comm, const std::array<int, 3>& global, const std::array<bool, 3>& periodic,
                     std::array<int, 3>* ranks_per_direction = nullptr);

/// Fills halo layers from neighbouring ranks and periodic images; layers beyond physical boundaries are not touched.
class Halo {
 public:
  Halo(const Comm& comm, const IndexSpace& index, const std::array<int, 3>& ranks_per_direction);

  /// @param layers  how many of them to fill, from the block outwards
  template <class Field>
  void exchange(const Field& field, int layers = IndexSpace::halo) {
    run(field, layers);
  }
  /// Of those that come from other ranks alone: what is at the other end of a period of this rank's is left to the caller.
  template <class Field>
  void exchange_with_others(const Field& field, int layers) {
    run(field, layers, false);
  }
  /// Whether this rank is its own neighbour along direction d.
  bool wraps(int d) const { return neighbour_[d][0] == comm_.rank() && neighbour_[d][1] == comm_.rank(); }
  /// Whether any layer comes from another rank.
  bool cut() const;
  /// This rank's block, and around it so many layers of what other ranks own.
  CellBox with_others(int layers) const;
  /// Whether any layer is filled: it is not on a rank alone without periodic directions.
  bool shared() const;

  /// Rank owning the neighbouring block on side (0 low, 1 high) of direction d; -1 beyond a physical boundary.
  int neighbour(int d, int side) const { return neighbour_[d][side]; }

 private:
  template <class Field>
  void run(const Field& field, int layers, bool own_too = true);

  Comm comm_;
  IndexSpace index_;
  int neighbour_[3][2];
  Array<double> send_[2], receive_[2];
  HostMirror<Array<double>> send_host_[2], receive_host_[2];
};

}  // namespace corpuscle
