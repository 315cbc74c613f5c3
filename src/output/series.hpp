// What the two time series, fields and cells, have in common: their stored times and the XDMF file that lists them.
#pragma once

#ifdef CORPUSCLE_HDF5

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "output/hdf5_file.hpp"

namespace corpuscle {

/// One stored time of a series: a group of the HDF5 file.
struct StoredTime {
  std::string group;  // "step_000000100"
  double time_us;
};

/// Name of the group of a step.
std::string step_group(long step);

/// The stored times of a file, in order of step.
/// @throws InputError  the file is not a series of this program
std::vector<StoredTime> stored_times(const std::string& path, const std::string& format);

/// Remove from a file the times later than `last_us`, or one step, if it is there.
void remove_later(Hdf5File& file, std::vector<StoredTime>& times, double last_us);
void remove_step(Hdf5File& file, std::vector<StoredTime>& times, const std::string& group);

/// Write `path`: one <Grid> of a temporal collection per stored time, its content given by `grid(time)`.
void write_xdmf(const std::string& path, const std::string& title, const std::vector<StoredTime>& times,
                const std::function<std::string(const StoredTime&)>& grid);

/// A <DataItem> that refers to a data set. `number` is "Float", "Int" or "Char".
std::string xdmf_item(const std::string& file, const std::string& data_set, const Shape& shape, const char* number,
                      int bytes);

/// An <Attribute> on top of it; components 1 or 3; center "Cell" or "Node".
std::string xdmf_attribute(const std::string& name, int components, const char* center, const std::string& item);

}  // namespace corpuscle

#endif
