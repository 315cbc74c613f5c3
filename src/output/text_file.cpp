#include "output/text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/error.hpp"

namespace corpuscle {
namespace fs = std::filesystem;

TextFile::TextFile(std::string path, long keep_bytes) : path_(std::move(path)) {
  if (keep_bytes >= 0) {
    std::error_code error;
    fs::resize_file(path_, static_cast<std::uintmax_t>(keep_bytes), error);
    if (error) throw InputError(fmt::format("{}: cannot continue this file: {}", path_, error.message()));
    written_ = keep_bytes;
  }
  file_ = std::fopen(path_.c_str(), keep_bytes >= 0 ? "a" : "w");
  if (!file_) throw InputError(fmt::format("{}: cannot write this file: {}", path_, std::strerror(errno)));
}

TextFile::~TextFile() {
  if (file_) std::fclose(file_);
}

void TextFile::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size() || std::fflush(file_) != 0) fail();
  written_ += static_cast<long>(text.size());
}

void TextFile::close() {
  auto* file = file_;
  file_ = nullptr;
  if (file && std::fclose(file) != 0) fail();
}

void TextFile::fail() {
  const int why = errno;
  throw ComputationError(fmt::format("{}: writing failed: {}; {} bytes of it were written before. {} another folder with --out.", path_,
                                     std::strerror(why), written_,
                                     why == ENOSPC || why == EDQUOT ? "Free some space or choose" : "Choose"));
}

void replace_text_file(const std::string& path, const std::string& text) {
  const auto temporary = path + ".part";
  TextFile file(temporary);
  file.write(text);
  file.close();
  std::error_code error;
  fs::rename(temporary, path, error);
  if (error) throw InputError(fmt::format("{}: cannot write this file: {}", path, error.message()));
}

void reach_disk(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

void prepare_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder))
    throw InputError(
        fmt::format("--out {}: cannot create this folder: {}", folder, error ? error.message() : "something else has its name"));
  const auto probe = fs::path(folder) / ".corpuscle_write_test";
  auto* file = std::fopen(probe.c_str(), "w");
  if (!file) throw InputError(fmt::format("--out {}: cannot write in this folder: {}", folder, std::strerror(errno)));
  std::fclose(file);
  fs::remove(probe, error);
}

}  // namespace corpuscle
