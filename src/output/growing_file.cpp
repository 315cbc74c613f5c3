#include "output/growing_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "core/error.hpp"

namespace corpuscle {
namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const std::string& path, const std::error_code& error) {
  throw ComputationError(fmt::format("{}: cannot put this file in place: {}", path, error.message()));
}

}  // namespace

GrowingFile::GrowingFile(std::string path) : path_(std::move(path)), spare_(path_ + ".part") {}

GrowingFile::~GrowingFile() {
  std::error_code ignored;
  if (has_spare_) fs::remove(spare_, ignored);
}

void GrowingFile::copy() {
  std::error_code error;
  fs::remove(spare_, error);  // whoever reads it keeps it
  fs::copy_file(path_, spare_, error);
  if (error) fail(spare_, error);
  has_spare_ = true;
}

void GrowingFile::put_in_place(bool keep) {
  const auto old = path_ + ".old";
  std::error_code error;
  fs::remove(old, error);  // of a run that was killed
  has_spare_ = keep && ::link(path_.c_str(), old.c_str()) == 0;
  fs::rename(spare_, path_, error);
  if (error) fail(path_, error);
  if (!has_spare_) return;
  fs::rename(old, spare_, error);
  if (error) fail(spare_, error);
}

}  // namespace corpuscle
