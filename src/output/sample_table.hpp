// A CSV file with a line for each sample, that a restart goes on with.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "output/text_file.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

class SampleTable {
 public:
  /// Rank 0 writes; all ranks call.
  /// @param header      names of the columns, of which the first is the time, us
  /// @param restart_us  samples of an existing file up to this time are kept and continued; absent: a new file
  /// @throws InputError  the file cannot be written, or the one to continue has other columns
  SampleTable(const std::string& path, const Comm& comm, const std::string& header, std::optional<double> restart_us);

  /// Append a line and flush it; on rank 0 alone, within on_root().
  /// @throws ComputationError  the disk is full
  void write(const std::string& line) { file_->write(line + "\n"); }

 private:
  std::unique_ptr<TextFile> file_;  // rank 0 only
};

}  // namespace corpuscle
