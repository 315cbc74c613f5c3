#include "output/sample_table.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "output/on_root.hpp"

namespace corpuscle {
namespace {

// Length of the part of an existing file to keep: its header and the whole lines up to the time of restart.
long kept_bytes(const std::string& path, const std::string& header, double restart_us) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  std::getline(in, line);
  if (line != header)
    throw InputError(
        fmt::format("{}: cannot continue this file, its columns are not those of this case; choose another folder with --out", path));
  long bytes = static_cast<long>(header.size()) + 1;
  // Times are multiples of the step: half an ulp-sized slack keeps the line of the restart time itself.
  const double last = restart_us * (1 + 1e-12);
  while (std::getline(in, line) && !in.eof() && std::strtod(line.c_str(), nullptr) <= last) bytes += static_cast<long>(line.size()) + 1;
  return bytes;
}

}  // namespace

SampleTable::SampleTable(const std::string& path, const Comm& comm, const std::string& header, std::optional<double> restart_us) {
  on_root(comm, [&] {
    if (restart_us && std::filesystem::exists(path)) {
      file_ = std::make_unique<TextFile>(path, kept_bytes(path, header, *restart_us));
    } else {
      file_ = std::make_unique<TextFile>(path);
      write(header);
    }
  });
}

}  // namespace corpuscle
