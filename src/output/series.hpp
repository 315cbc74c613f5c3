// What the two time series, fields and cells, have in common. Each stored time is a file of its own below
// <name>/, complete before it gets its name; <name>.h5 links them together, and <name>.xdmf lists them for ParaView: both
// are growing files, to which a time is added at a cost that does not depend on how many there are. So whatever a run was
// doing when it ended, all that it had stored can be read, and a restart goes on from it.
#pragma once

#ifdef CORPUSCLE_HDF5

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "output/growing_file.hpp"
#include "output/hdf5_file.hpp"

namespace corpuscle {

/// One stored time of a series: a group of NAME.h5, which is a link to a file's root.
struct StoredTime {
  std::string group;  // "step_000000100"
  double time_us;
};

/// Name of the group of a step.
std::string step_group(long step);

/// The stored times of a series, in order of step.
/// @throws InputError  the file is not a series of this program
std::vector<StoredTime> stored_times(const std::string& path, const std::string& format);

/// Rank 0 writes what is said of the files here; the files themselves are their writers'.
class Series {
 public:
  /// Content of a stored time's grid element, from its file.
  using Describe = std::function<std::string(const StoredTime&, const Hdf5File&)>;

  /// @param name    "fields": of the folder and of both files beside it
  /// @param format  what NAME.h5 says it is
  /// @param shared  arrays that all times share, of NAME/SHARED_FILE.h5
  Series(const std::string& folder, const std::string& name, const std::string& format, const Comm& comm, const std::string& shared_file,
         const std::vector<std::string>& shared, Describe describe);

  /// Forget what is there and start anew; the folder is created.
  /// @throws InputError  on every rank
  void create();
  /// Whether there is a series to continue; the same on all ranks.
  bool exists() const;
  /// Keep the times up to `last_us`, remove the later ones.
  /// @throws InputError  on every rank: it is something else
  void resume(double last_us);

  /// Files to be written: of the arrays that all times share, and of one time. They get their names by finish().
  std::string shared_path() const { return path(shared_file_) + unfinished; }
  std::string step_path(long step) const { return path(step_group(step)) + unfinished; }
  /// Give the file of the shared arrays, or of a stored time, its name, and list it.
  /// @throws ComputationError  on every rank
  void finish_shared();
  void finish(long step, double time_us);

  static constexpr const char* unfinished = ".part";

 private:
  std::string path(const std::string& file) const { return folder_ + "/" + file + ".h5"; }
  void put_in_place(const std::string& file) const;
  std::string grid_text(const StoredTime& time) const;
  void write_index();
  void append_index();
  void rewrite_xdmf();
  void append_xdmf();

  std::string folder_, name_, format_;
  GrowingFile index_, xdmf_;
  Comm comm_;
  std::string shared_file_;
  std::vector<std::string> shared_;
  Describe describe_;
  std::vector<StoredTime> times_;  // rank 0 only
  std::size_t indexed_ = 0;        // of them, in the second index
  std::string xdmf_text_;          // of the last time, which the second .xdmf lacks
  std::size_t xdmf_length_ = 0;    // of the second .xdmf, without its end
};

/// A <DataItem> that refers to a data set. `number` is "Float", "Int" or "Char".
std::string xdmf_item(const std::string& file, const std::string& data_set, const Shape& shape, const char* number, int bytes);

/// An <Attribute> on top of it; components 1 or 3; center "Cell" or "Node".
std::string xdmf_attribute(const std::string& name, int components, const char* center, const std::string& item);

}  // namespace corpuscle

#endif
