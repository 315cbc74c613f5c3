// Text files whose every write is checked: a full disk is an error, not a short file.
#pragma once

#include <cstdio>
#include <string>

namespace corpuscle {

class TextFile {
 public:
  /// @param keep_bytes  negative: a new file; otherwise the file is cut to that length and continued
  /// @throws InputError  the file cannot be created or opened
  explicit TextFile(std::string path, long keep_bytes = -1);
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  /// Append and flush.
  /// @throws ComputationError  naming the file, how much of it was written, and the system's reason
  void write(const std::string& text);
  void close();

 private:
  [[noreturn]] void fail();

  std::string path_;
  std::FILE* file_;
  long written_ = 0;
};

/// Write a whole file under another name and rename it, so that readers see the old or the new one, never a part.
void replace_text_file(const std::string& path, const std::string& text);

/// Wait until a closed file is on the disk, so that a rename cannot overtake what is in it when power fails.
void reach_disk(const std::string& path);

/// Create the folder for the results if it is not there, and make sure that files can be written in it.
/// @throws InputError  saying why not
void prepare_folder(const std::string& folder);

}  // namespace corpuscle
