// A file that is added to and yet, under its name, whole at every moment.
#pragma once

#include <string>

namespace corpuscle {

/// What is added goes into a second file, which is one step behind, and then the two change places: the cost of a step does
/// not grow with the file, and a process that is killed leaves one that can be read.
class GrowingFile {
 public:
  explicit GrowingFile(std::string path);
  /// Removes the second file.
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  const std::string& path() const { return path_; }
  /// The second file, to be written under this name.
  const std::string& spare() const { return spare_; }
  /// Make the second file from the first, as where somebody reads the one there was. @throws ComputationError
  void copy();
  /// There may be none: at the start, and where a file system cannot give one file two names.
  bool has_spare() const { return has_spare_; }
  /// The second file gets the name; the first becomes the second, unless it is of no more use.
  /// @throws ComputationError
  void put_in_place(bool keep);

 private:
  std::string path_, spare_;
  bool has_spare_ = false;
};

}  // namespace corpuscle
