// Fields of few cells, of which every rank gets those of all.
#pragma once

#include "grid/halo_copy.hpp"
#include "parallel/comm.hpp"

#include <vector>

namespace corpuscle {

/// Cells, or faces along one direction, of a whole grid that its ranks hold a block of each.
class Gathering {
 public:
  static constexpr int of_cells = -1;

  /// @param part       this rank's block of the grid
  /// @param whole      the grid as a rank alone would have it: the same global cells, all of them owned
  /// @param direction  whose faces are gathered, each with the cell above it, that at the end of the grid too; or of_cells
  Gathering(const Comm& comm, const IndexSpace& part, const IndexSpace& whole, int direction);

  /// Each rank's own cells of `field` [cell of the whole] to all others.
  void run(const Array<float>& field) { gather(field, 1); }
  void run(const Components<float>& field) { gather(field, 3); }

 private:
  template <class Field>
  void gather(const Field& field, int components);
  void pass_on(int components);

  Comm comm_;
  std::vector<int> end_;  // [n] cells of n ranks, this one first and those that follow it
  Array<int> cell_;       // of the whole, rank by rank in that order
  Array<float> buffer_;
  HostMirror<Array<float>> buffer_host_;
};

}  // namespace corpuscle
