#ifdef CORPUSCLE_HDF5

#include "output/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "core/error.hpp"
#include "core/fingerprint.hpp"
#include "output/checksum.hpp"
#include "output/on_root.hpp"
#include "output/report.hpp"
#include "output/text_file.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "Corpuscle checkpoint";
constexpr hsize_t piece = hsize_t{1} << 22;  // entries that a rank reads at once to check them

std::uint32_t sum_over_ranks(const Comm& comm, std::uint32_t part) { return static_cast<std::uint32_t>(comm.sum(static_cast<long>(part))); }

/// Checksum of rows [first, first + count) of a stored array.
template <class T>
std::uint32_t stored_checksum(const Hdf5File& file, const std::string& name, const Shape& shape, const Slab& rows) {
  hsize_t entries = 1;
  for (const auto n : rows.count) entries *= n;
  std::vector<T> values(entries);
  file.read(name, rows, values.data());
  return checksum(shape, rows, values.data());
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string cells_attribute(int d) { return fmt::format("cells_{}", "ijk"[d]); }

/// Numbers and texts of the header from a file that is a whole checkpoint of this format.
CheckpointHeader header_of(const Hdf5File& file) {
  CheckpointHeader header;
  header.git = file.text("/", "git");
  header.step = static_cast<long>(file.integer("/", "step"));
  header.time_us = file.number("/", "time_us");
  for (int d = 0; d < 3; ++d) header.cells[d] = static_cast<int>(file.integer("/", cells_attribute(d)));
  header.resolved = file.read_text("case");
  header.files = file.read_text("files");
  header.run = file.read_text("run");
  return header;
}

void seal_text(Fingerprint& seal, const std::string& name, const std::string& text) {
  seal.add(name);
  seal.add(text);
}

void seal_array(Fingerprint& seal, const std::string& name, const Shape& shape, std::int64_t sum) {
  seal.add(name);
  seal.add(shape.data(), shape.size() * sizeof shape[0]);
  seal.add(&sum, sizeof sum);
}

/// Fingerprint of all that a checkpoint says but its arrays' entries, whose checksums it covers.
std::string seal_of(const CheckpointHeader& header, const Fingerprint& texts, const Fingerprint& arrays) {
  Fingerprint seal;
  seal.add(header.git);
  const std::int64_t numbers[] = {header.step, header.cells[0], header.cells[1], header.cells[2]};
  seal.add(numbers, sizeof numbers);
  seal.add(&header.time_us, sizeof header.time_us);
  const std::uint64_t parts[] = {texts.value(), arrays.value()};
  seal.add(parts, sizeof parts);
  return fmt::format("{:016x}", seal.value());
}

std::string seal_of(const Hdf5File& file) {
  Fingerprint texts, arrays;
  for (const auto& name : lines_of(file.read_text("texts"))) seal_text(texts, name, file.read_text(name));
  for (const auto& name : lines_of(file.read_text("arrays"))) seal_array(arrays, name, file.shape(name), file.integer(name, "checksum"));
  return seal_of(header_of(file), texts, arrays);
}

void require_checkpoint(const Hdf5File& file) {
  const auto& path = file.path();
  if (!file.has_attribute("/", "format") || file.text("/", "format") != format_name)
    throw InputError(fmt::format("{}: this HDF5 file is not a checkpoint of Corpuscle", path));
  const auto version = file.integer("/", "version");
  if (version != CheckpointHeader::format_version)
    throw InputError(
        fmt::format("{}: this checkpoint has format version {}, and this program reads version {}: it was written by "
                    "another version of the program, with which it can be gone on from; or run the case anew",
                    path, version, CheckpointHeader::format_version));
  if (!file.has_attribute("/", "complete")) throw InputError(fmt::format("{}: this checkpoint was not finished; use an older one", path));
  if (!file.has_attribute("/", "seal") || file.text("/", "seal") != seal_of(file))
    throw InputError(
        fmt::format("{}: its header (time, step, case and the like) is damaged: it is not what was written; use "
                    "another checkpoint",
                    path));
}

}  // namespace

CheckpointHeader read_checkpoint_header(const std::string& path) {
  const auto file = Hdf5File::read(path);
  require_checkpoint(file);
  return header_of(file);
}

CheckpointWriter::CheckpointWriter(std::string path, const Comm& comm, const CheckpointHeader& header)
    : path_(std::move(path)), temporary_(path_ + ".part"), header_(header), comm_(comm) {
  header_.git = git_hash();
  file_ = std::make_unique<Hdf5File>(Hdf5File::create(temporary_, comm_));
  file_->attribute("/", "format", format_name);
  file_->attribute("/", "version", static_cast<std::int64_t>(CheckpointHeader::format_version));
  file_->attribute("/", "git", header_.git);
  file_->attribute("/", "step", static_cast<std::int64_t>(header.step));
  file_->attribute("/", "time_us", header.time_us);
  for (int d = 0; d < 3; ++d) file_->attribute("/", cells_attribute(d), static_cast<std::int64_t>(header.cells[d]));
  add_text("case", header.resolved);
  add_text("files", header.files);
  add_text("run", header.run);
}

CheckpointWriter::~CheckpointWriter() {
  if (!file_) return;
  file_.reset();
  std::error_code ignored;
  if (comm_.root()) std::filesystem::remove(temporary_, ignored);
}

template <class T>
void CheckpointWriter::add_whole(const std::string& name, const Shape& shape, const T* values) {
  file_->write(name, shape, values);
  list_array(name, shape, checksum(shape, whole_of(shape), values));
}

template <class T>
void CheckpointWriter::add_part(const std::string& name, const Shape& shape, const Slab& mine, const T* values) {
  file_->write(name, shape, mine, values);
  const auto sum = sum_over_ranks(comm_, checksum(shape, mine, values));
  list_array(name, shape, sum);
}

template <class T>
void CheckpointWriter::add_rows(const std::string& name, const Shape& shape, const Rows& mine, const T* values) {
  file_->write(name, shape, mine, values);
  std::uint32_t sum = 0;
  hsize_t row = 1;
  for (std::size_t d = 1; d < shape.size(); ++d) row *= shape[d];
  for (const Rows::Piece& piece : mine.pieces) {
    Slab part = whole_of(shape);
    part.offset[0] = piece.first, part.count[0] = piece.count;
    sum += checksum(shape, part, values);
    values += piece.count * row;
  }
  list_array(name, shape, sum_over_ranks(comm_, sum));
}

void CheckpointWriter::list_array(const std::string& name, const Shape& shape, std::int64_t sum) {
  file_->attribute(name, "checksum", sum);
  seal_array(array_seal_, name, shape, sum);
  arrays_ += name + "\n";
}

void CheckpointWriter::add(const std::string& name, const Shape& shape, const double* values) { add_whole(name, shape, values); }
void CheckpointWriter::add(const std::string& name, const Shape& shape, const std::int64_t* values) { add_whole(name, shape, values); }
void CheckpointWriter::add(const std::string& name, const Shape& shape, const Slab& mine, const double* values) {
  add_part(name, shape, mine, values);
}
void CheckpointWriter::add(const std::string& name, const Shape& shape, const Slab& mine, const std::int64_t* values) {
  add_part(name, shape, mine, values);
}

void CheckpointWriter::add(const std::string& name, const Shape& shape, const Rows& mine, const double* values) {
  add_rows(name, shape, mine, values);
}
void CheckpointWriter::add(const std::string& name, const Shape& shape, const Rows& mine, const std::int64_t* values) {
  add_rows(name, shape, mine, values);
}

void CheckpointWriter::add_text(const std::string& name, const std::string& text) {
  file_->write_text(name, text);
  seal_text(text_seal_, name, text);
  texts_ += name + "\n";
}

void CheckpointWriter::commit() {
  file_->write_text("arrays", arrays_);
  file_->write_text("texts", texts_);
  file_->attribute("/", "seal", seal_of(header_, text_seal_, array_seal_));
  file_->attribute("/", "complete", std::int64_t{1});
  file_->close();
  on_root(comm_, [&] {
    reach_disk(temporary_);
    std::error_code error;
    std::filesystem::rename(temporary_, path_, error);
    if (error) throw ComputationError(fmt::format("{}: cannot put the checkpoint in place: {}", path_, error.message()));
  });
  file_.reset();
}

CheckpointReader::CheckpointReader(const std::string& path, const Comm& comm) : file_(Hdf5File::read(path)) {
  require_checkpoint(file_);
  header_ = header_of(file_);
  for (const auto& name : lines_of(file_.read_text("arrays"))) check(name, comm);
}

/// The ranks share the array's rows. A rank that cannot read its own counts as a wrong sum, so that all ranks stop.
void CheckpointReader::check(const std::string& name, const Comm& comm) const {
  const Shape shape = file_.has(name) ? file_.shape(name) : Shape{};
  std::uint32_t sum = 0;
  double unreadable = shape.empty() || !file_.has_attribute(name, "checksum") ? 1 : 0;
  if (unreadable == 0) {
    hsize_t row = 1;
    for (std::size_t d = 1; d < shape.size(); ++d) row *= shape[d];
    const hsize_t rows = std::max<hsize_t>(piece / std::max<hsize_t>(row, 1), 1);
    hsize_t turn = 0;
    try {
      for (hsize_t first = 0; first < shape[0]; first += rows, ++turn) {
        if (turn % comm.size() != static_cast<hsize_t>(comm.rank())) continue;
        Slab part = whole_of(shape);
        part.offset[0] = first;
        part.count[0] = std::min(rows, shape[0] - first);
        sum += file_.is_integer(name) ? stored_checksum<std::int64_t>(file_, name, shape, part)
                                      : stored_checksum<double>(file_, name, shape, part);
      }
    } catch (const InputError&) {
      unreadable = 1;
    }
  }
  sum = sum_over_ranks(comm, sum);
  if (comm.max(unreadable) > 0 || sum != static_cast<std::uint32_t>(file_.integer(name, "checksum")))
    throw InputError(fmt::format("{}: '{}' is damaged: it is not what was written; use another checkpoint", file_.path(), name));
}

void CheckpointReader::require_grid(const std::array<int, 3>& cells) const {
  if (cells == header_.cells) return;
  // Case files count nodes, one more than cells.
  const auto nodes = [](std::array<int, 3> n) { return fmt::format("[{}, {}, {}]", n[0] + 1, n[1] + 1, n[2] + 1); };
  throw InputError(fmt::format("{}: this checkpoint has a grid of {} nodes, and the case has grid.nodes = {}", file_.path(),
                               nodes(header_.cells), nodes(cells)));
}

void CheckpointReader::require_shape(const std::string& name, const Shape& shape) const {
  if (!file_.has(name))
    throw InputError(fmt::format("{}: this checkpoint has no '{}', which the case needs: it is from another scene", file_.path(), name));
  const auto found = file_.shape(name);
  if (found != shape)
    throw InputError(fmt::format("{}: '{}' has {} entries in this checkpoint, and the case needs {}", file_.path(), name,
                                 fmt::join(found, " x "), fmt::join(shape, " x ")));
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
