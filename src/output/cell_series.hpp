// cell_series.h5 and cell_series.xdmf: figures of each of many cells at the history's times, as points that ParaView
// opens.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "output/cell_writer.hpp"

namespace corpuscle {

class CellSeries {
 public:
  /// Every rank calls. @param mine  rows of this rank's cells; @param restart_us  as CellWriter
  /// @throws InputError  on every rank, if the files cannot be written or the one to continue has other cells
  CellSeries(const std::string& folder, const Comm& comm, hsize_t cells, const Rows& mine, std::optional<double> restart_us);

  /// Store one time; one of the tables is "centroid_um". Every rank calls. A step that is there already is replaced.
  /// @throws ComputationError  on every rank, for example on a full disk
  void write(double time_us, long step, const Rows& mine, const std::vector<CellTable>& tables);

 private:
  std::string describe(const StoredTime& time, const Hdf5File& file) const;

  Comm comm_;
  hsize_t cells_;
  Series series_;
};

}  // namespace corpuscle

#endif
