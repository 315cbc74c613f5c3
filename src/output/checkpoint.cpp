#ifdef CORPUSCLE_HDF5

#include "output/checkpoint.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"
#include "output/report.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "Corpuscle checkpoint";

}  // namespace

CheckpointWriter::CheckpointWriter(std::string path, const Comm& comm, const CheckpointHeader& header)
    : path_(std::move(path)), temporary_(path_ + ".part"), comm_(comm) {
  file_ = std::make_unique<Hdf5File>(Hdf5File::create(temporary_, comm_));
  file_->attribute("/", "format", format_name);
  file_->attribute("/", "version", static_cast<std::int64_t>(CheckpointHeader::format_version));
  file_->attribute("/", "git", git_hash());
  file_->attribute("/", "step", static_cast<std::int64_t>(header.step));
  file_->attribute("/", "time_us", header.time_us);
  for (int d = 0; d < 3; ++d)
    file_->attribute("/", fmt::format("cells_{}", "ijk"[d]), static_cast<std::int64_t>(header.cells[d]));
  file_->write_text("case", header.resolved);
}

CheckpointWriter::~CheckpointWriter() {
  if (!file_) return;
  file_.reset();
  std::error_code ignored;
  if (comm_.root()) std::filesystem::remove(temporary_, ignored);
}

void CheckpointWriter::add(const std::string& name, const Shape& shape, const double* values) {
  file_->write(name, shape, values);
}
void CheckpointWriter::add(const std::string& name, const Shape& shape, const std::int64_t* values) {
  file_->write(name, shape, values);
}
void CheckpointWriter::add(const std::string& name, const Shape& shape, const Slab& mine, const double* values) {
  file_->write(name, shape, mine, values);
}
void CheckpointWriter::add(const std::string& name, const Shape& shape, const Slab& mine, const std::int64_t* values) {
  file_->write(name, shape, mine, values);
}

void CheckpointWriter::commit() {
  file_->attribute("/", "complete", std::int64_t{1});
  file_->close();
  on_root(comm_, [&] {
    std::error_code error;
    std::filesystem::rename(temporary_, path_, error);
    if (error)
      throw ComputationError(fmt::format("{}: cannot put the checkpoint in place: {}", path_, error.message()));
  });
  file_.reset();
}

CheckpointReader::CheckpointReader(const std::string& path) : file_(Hdf5File::read(path)) {
  if (!file_.has_attribute("/", "format") || file_.text("/", "format") != format_name)
    throw InputError(fmt::format("{}: this HDF5 file is not a checkpoint of Corpuscle", path));
  const auto version = file_.integer("/", "version");
  if (version != CheckpointHeader::format_version)
    throw InputError(fmt::format("{}: this checkpoint has format version {}, and this program reads version {}", path,
                                 version, CheckpointHeader::format_version));
  if (!file_.has_attribute("/", "complete"))
    throw InputError(fmt::format("{}: this checkpoint was not finished; use an older one", path));
  header_.git = file_.text("/", "git");
  header_.step = static_cast<long>(file_.integer("/", "step"));
  header_.time_us = file_.number("/", "time_us");
  for (int d = 0; d < 3; ++d)
    header_.cells[d] = static_cast<int>(file_.integer("/", fmt::format("cells_{}", "ijk"[d])));
  header_.resolved = file_.read_text("case");
}

void CheckpointReader::require_grid(const std::array<int, 3>& cells) const {
  if (cells == header_.cells) return;
  // Case files count nodes, one more than cells.
  const auto nodes = [](std::array<int, 3> n) { return fmt::format("[{}, {}, {}]", n[0] + 1, n[1] + 1, n[2] + 1); };
  throw InputError(fmt::format("{}: this checkpoint has a grid of {} nodes, and the case has grid.nodes = {}",
                               file_.path(), nodes(header_.cells), nodes(cells)));
}

void CheckpointReader::require_shape(const std::string& name, const Shape& shape) const {
  if (!file_.has(name))
    throw InputError(fmt::format("{}: this checkpoint has no '{}', which the case needs: it is from another scene",
                                 file_.path(), name));
  const auto found = file_.shape(name);
  if (found != shape)
    throw InputError(fmt::format("{}: '{}' has {} entries in this checkpoint, and the case needs {}", file_.path(),
                                 name, fmt::join(found, " x "), fmt::join(shape, " x ")));
}

void CheckpointReader::read(const std::string& name, const Shape& shape, double* values) const {
  require_shape(name, shape);
  file_.read(name, values);
}
void CheckpointReader::read(const std::string& name, const Shape& shape, std::int64_t* values) const {
  require_shape(name, shape);
  file_.read(name, values);
}
void CheckpointReader::read(const std::string& name, const Shape& shape, const Slab& mine, double* values) const {
  require_shape(name, shape);
  file_.read(name, mine, values);
}
void CheckpointReader::read(const std::string& name, const Shape& shape, const Slab& mine, std::int64_t* values) const {
  require_shape(name, shape);
  file_.read(name, mine, values);
}

}  // namespace corpuscle

#endif
