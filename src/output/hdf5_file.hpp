// HDF5 files with errors that say what went wrong: a thin layer over the C interface. Only in builds with HDF5.
//
// HDF5 itself cannot recover from a write that fails: the file can then not be closed, and the library brings the
// process down when MPI is finalised. So space is asked for before each write, and a program that has met a failed
// write all the same should end without finalising MPI.
//
// Several ranks write one file together, and a rank that fails must not leave the others waiting in a collective call:
// what can fail on one rank alone is agreed on before each of these, and a file that has failed is never closed.
#pragma once

#ifdef CORPUSCLE_HDF5

#include <hdf5.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "parallel/comm.hpp"

namespace corpuscle {

using Shape = std::vector<hsize_t>;  // slowest index first

/// A box of a data set: what one rank holds of it.
struct Slab {
  Shape offset, count;
};

/// Rows of a data set, in rising order: what one rank holds where that is no box.
struct Rows {
  struct Piece {
    hsize_t first, count;
  };
  std::vector<Piece> pieces;

  /// Adds rows behind the others; what continues the last piece becomes part of it.
  void add(hsize_t first, hsize_t count);
  hsize_t count() const;
};

class Hdf5File {
 public:
  /// A new file. With a communicator of several ranks every call below is collective.
  /// @throws InputError  on every rank: the file cannot be created
  static Hdf5File create(const std::string& path, const Comm& comm);
  static Hdf5File create(const std::string& path);
  /// For reading, by each rank on its own.
  /// @throws InputError  the file is missing, empty, not HDF5, or cut short
  static Hdf5File read(const std::string& path);
  /// To add to what is there, by one rank alone.
  /// @throws InputError  as above, or somebody else has it open
  static Hdf5File append(const std::string& path);

  Hdf5File(Hdf5File&& other) noexcept;
  Hdf5File& operator=(Hdf5File&&) = delete;
  /// Closes the file, unless an error is on its way or several ranks would have to do it together after one.
  ~Hdf5File();
  /// @throws ComputationError  on every rank: what was written did not reach the disk
  void close();

  /// A whole data set, the same on all ranks. Groups in the name are created.
  /// @throws ComputationError  on every rank: there is too little space for it, or writing failed
  void write(const std::string& name, const Shape& shape, const double* data);
  void write(const std::string& name, const Shape& shape, const std::int32_t* data);
  void write(const std::string& name, const Shape& shape, const std::int64_t* data);
  /// This rank's part of a data set, from memory of shape `memory` (at its origin; empty: the slab's own shape).
  void write(const std::string& name, const Shape& shape, const Slab& mine, const double* data, const Shape& memory = {});
  void write(const std::string& name, const Shape& shape, const Slab& mine, const std::int8_t* data);
  void write(const std::string& name, const Shape& shape, const Slab& mine, const std::int64_t* data);

  /// This rank's rows of a data set, one after the other in memory.
  void write(const std::string& name, const Shape& shape, const Rows& mine, const double* data);
  void write(const std::string& name, const Shape& shape, const Rows& mine, const std::int32_t* data);
  void write(const std::string& name, const Shape& shape, const Rows& mine, const std::int64_t* data);

  /// A text of any length as a data set (attributes end at 64 KiB).
  void write_text(const std::string& name, const std::string& text);

  void attribute(const std::string& object, const std::string& name, double value);
  void attribute(const std::string& object, const std::string& name, std::int64_t value);
  void attribute(const std::string& object, const std::string& name, const std::string& value);

  /// A link to an object of another file, whose path is relative to this one's folder.
  void link(const std::string& name, const std::string& file, const std::string& object);

  bool has(const std::string& object) const;
  bool has_attribute(const std::string& object, const std::string& name) const;
  std::vector<std::string> entries(const std::string& group) const;
  Shape shape(const std::string& name) const;
  bool is_integer(const std::string& name) const;

  /// @throws InputError  the data set or attribute is missing or holds something else
  void read(const std::string& name, double* data) const;
  void read(const std::string& name, std::int32_t* data) const;
  void read(const std::string& name, std::int64_t* data) const;
  void read(const std::string& name, const Slab& part, double* data) const;
  void read(const std::string& name, const Slab& part, std::int64_t* data) const;
  std::string read_text(const std::string& name) const;
  double number(const std::string& object, const std::string& name) const;
  std::int64_t integer(const std::string& object, const std::string& name) const;
  std::string text(const std::string& object, const std::string& name) const;

  const std::string& path() const { return path_; }

 private:
  Hdf5File(std::string path, hid_t file, const Comm* comm);
  static Hdf5File open(const std::string& path, unsigned how);
  void require_space(const std::string& name, double bytes) const;
  void write_slab(const std::string& name, const Shape& shape, const Slab* mine, hid_t type, const void* data, const Shape& memory);
  void write_rows(const std::string& name, const Shape& shape, const Rows& mine, hid_t type, const void* data);
  void write_selected(const std::string& name, hid_t set, hid_t type, hid_t source, hid_t space, const void* data, std::string failure);
  void read_slab(const std::string& name, const Slab* part, hid_t type, void* data) const;
  void write_attribute(const std::string& object, const std::string& name, hid_t type, const void* value);
  void read_attribute(const std::string& object, const std::string& name, hid_t type, void* value) const;
  std::string write_failure(const std::string& what) const;
  void settle(const std::string& failure);
  [[noreturn]] void fail_read(const std::string& what) const;

  std::string path_;
  hid_t file_;
  bool failed_ = false;       // beyond repair: left open until the program ends
  std::optional<Comm> comm_;  // of several ranks, whose calls are collective; absent: this process alone
};

}  // namespace corpuscle

#endif
