// fields.h5 and fields.xdmf: the flow at stored times, on the curvilinear grid, as ParaView opens it.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "grid/index_space.hpp"
#include "output/series.hpp"

namespace corpuscle {

/// Values of this rank's owned cells in compact order (i fastest), components of one cell side by side: host memory of
/// owned() * components numbers.
struct CellField {
  std::string name;  // with its unit: "velocity_um_per_us"
  int components;    // 1 or 3
  const double* values;
};

/// The same for small whole numbers, such as the kind of a node.
struct CellLabels {
  std::string name;
  const std::int8_t* values;
};

/// Each rank writes its block, collectively.
class FieldWriter {
 public:
  /// @param nodes       node coordinates of this rank's block, [n2 + 1, n1 + 1, n0 + 1, 3], um
  /// @param restart_us  an existing file keeps its times up to this one and is continued; absent: a new file
  /// @throws InputError  the files cannot be written, or the one to continue has another grid
  FieldWriter(const std::string& folder, const Comm& comm, const IndexSpace& index, const double* nodes,
              std::optional<double> restart_us = {});

  /// Store one time. A step that is there already is replaced.
  /// @throws ComputationError  on every rank, for example on a full disk
  void write(double time_us, long step, const std::vector<CellField>& fields, const std::vector<CellLabels>& labels = {});

 private:
  void create(const double* nodes);
  void require_same_grid(const std::string& path) const;
  std::string describe(const StoredTime& time, const Hdf5File& file) const;
  Shape global_cells() const;

  Comm comm_;
  IndexSpace index_;
  Series series_;
};

}  // namespace corpuscle

#endif
