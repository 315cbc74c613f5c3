// checkpoint.h5: everything a run needs to go on, as named arrays under a header. Readable on any number of ranks.
#pragma once

#ifdef CORPUSCLE_HDF5

#include <array>
#include <memory>

#include "core/fingerprint.hpp"
#include "output/hdf5_file.hpp"

namespace corpuscle {

struct CheckpointHeader {
  static constexpr int format_version = 5;

  std::string git;             // hash of the program that wrote it; filled in by the writer
  std::string resolved;        // the case, every key with the value used
  std::string files;           // fingerprints of the files that the case names (app/scene_files.hpp)
  std::string run;             // of which run this is a state (RunFolder)
  std::array<int, 3> cells{};  // of the whole grid; zero without a fluid
  long step = 0;
  double time_us = 0;
};

/// The header alone, without the arrays; every rank may call.
/// @throws InputError  as CheckpointReader does, but for damage to arrays
CheckpointHeader read_checkpoint_header(const std::string& path);

/// Writes under another name until commit(), so the last good checkpoint survives whatever happens before.
class CheckpointWriter {
 public:
  /// All calls are collective.
  /// @throws InputError  the file cannot be created
  CheckpointWriter(std::string path, const Comm& comm, const CheckpointHeader& header);
  /// Without commit() the unfinished file is removed.
  ~CheckpointWriter();
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  /// The same on all ranks.
  /// @throws ComputationError  writing failed; the previous checkpoint is as it was
  void add(const std::string& name, const Shape& shape, const double* values);
  void add(const std::string& name, const Shape& shape, const std::int64_t* values);
  /// Each rank its own box of the whole.
  void add(const std::string& name, const Shape& shape, const Slab& mine, const double* values);
  void add(const std::string& name, const Shape& shape, const Slab& mine, const std::int64_t* values);

  /// Each rank its own rows of the whole.
  void add(const std::string& name, const Shape& shape, const Rows& mine, const double* values);
  void add(const std::string& name, const Shape& shape, const Rows& mine, const std::int64_t* values);

  /// A text, the same on all ranks.
  void add_text(const std::string& name, const std::string& text);

  /// Finish the file and put it in the place of the previous one.
  void commit();

 private:
  template <class T>
  void add_whole(const std::string& name, const Shape& shape, const T* values);
  template <class T>
  void add_part(const std::string& name, const Shape& shape, const Slab& mine, const T* values);
  template <class T>
  void add_rows(const std::string& name, const Shape& shape, const Rows& mine, const T* values);
  void list_array(const std::string& name, const Shape& shape, std::int64_t sum);

  std::string path_, temporary_;
  CheckpointHeader header_;
  std::string arrays_, texts_;  // names so far, a line each
  Fingerprint array_seal_, text_seal_;
  Comm comm_;
  std::unique_ptr<Hdf5File> file_;
};

/// Each rank reads what it needs; all find the same faults.
class CheckpointReader {
 public:
  /// Opens the file and checks all that is in it: every array against its checksum, and everything else, those checksums
  /// included, against the file's seal; collective.
  /// @throws InputError  the file is missing, not HDF5, cut short, foreign, unfinished, damaged, or of another format
  ///                     version
  explicit CheckpointReader(const std::string& path, const Comm& comm = Comm());

  const CheckpointHeader& header() const { return header_; }
  /// @throws InputError  the checkpoint's grid is another one
  void require_grid(const std::array<int, 3>& cells) const;
  bool has(const std::string& name) const { return file_.has(name); }
  /// @throws InputError  there is no such text
  std::string text(const std::string& name) const { return file_.read_text(name); }
  Shape shape(const std::string& name) const { return file_.shape(name); }

  /// @throws InputError  the array is missing or has another shape than the case needs
  void read(const std::string& name, const Shape& shape, double* values) const;
  void read(const std::string& name, const Shape& shape, std::int64_t* values) const;
  void read(const std::string& name, const Shape& shape, const Slab& mine, double* values) const;
  void read(const std::string& name, const Shape& shape, const Slab& mine, std::int64_t* values) const;

 private:
  void check(const std::string& name, const Comm& comm) const;
  void require_shape(const std::string& name, const Shape& shape) const;

  Hdf5File file_;
  CheckpointHeader header_;
};

}  // namespace corpuscle

#endif
