#ifdef CORPUSCLE_HDF5

#include "output/hdf5_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <utility>

#include "core/error.hpp"
#include "output/on_root.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {
namespace {

// Closes an HDF5 object at the end of a scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }
  bool bad() const { return id_ < 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Errors become exceptions here; HDF5's own printing of them is switched off.
void be_quiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

// The innermost reason on HDF5's error stack, which carries the system's message.
std::string reason() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* out) -> herr_t {
        auto& first = *static_cast<std::string*>(out);
        if (first.empty() && error->desc) first = error->desc;
        return 0;
      },
      &text);
  return text.empty() ? "no reason given" : text;
}

bool distributed(const Comm& comm) { return comm.size() > 1; }

hid_t access_list(const Comm* comm) {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
#ifdef CORPUSCLE_MPI
  if (comm && distributed(*comm)) H5Pset_fapl_mpio(access, comm->handle(), MPI_INFO_NULL);
#else
  (void)comm;
#endif
  return access;
}

hid_t create_file(const std::string& path, const Comm* comm) {
  be_quiet();
  const Comm alone = comm ? *comm : Comm();
  const bool together = comm && distributed(alone);
  // The usual obstacles are met by one rank alone, before all open the file together.
  if (together)
    on_root(alone, [&] {
      std::FILE* probe = std::fopen(path.c_str(), "w");
      if (!probe) throw InputError(fmt::format("{}: cannot create this file: {}", path, std::strerror(errno)));
      std::fclose(probe);
    });
  const Handle access(access_list(comm), H5Pclose);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  std::string failure = file < 0 ? fmt::format("{}: cannot create this file: {}", path, reason()) : "";
  if (together) failure = agree(alone, failure);
  if (!failure.empty()) throw InputError(failure);
  return file;
}

}  // namespace

Hdf5File::Hdf5File(std::string path, hid_t file, const Comm* comm) : path_(std::move(path)), file_(file) {
  if (comm && distributed(*comm)) comm_ = *comm;
}

Hdf5File::Hdf5File(Hdf5File&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), failed_(other.failed_), comm_(other.comm_) {}

Hdf5File::~Hdf5File() {
  const bool unsafe = failed_ || (comm_ && std::uncaught_exceptions() > 0);
  if (file_ >= 0 && !unsafe) H5Fclose(file_);
}

Hdf5File Hdf5File::create(const std::string& path, const Comm& comm) { return {path, create_file(path, &comm), &comm}; }
Hdf5File Hdf5File::create(const std::string& path) { return {path, create_file(path, nullptr), nullptr}; }

Hdf5File Hdf5File::read(const std::string& path) { return open(path, H5F_ACC_RDONLY); }
Hdf5File Hdf5File::append(const std::string& path) { return open(path, H5F_ACC_RDWR); }

Hdf5File Hdf5File::open(const std::string& path, unsigned how) {
  be_quiet();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw InputError(fmt::format("{}: there is no such file", path));
  if (std::filesystem::file_size(path, error) == 0) throw InputError(fmt::format("{}: this file is empty", path));
  const auto is_hdf5 = H5Fis_hdf5(path.c_str());
  if (is_hdf5 < 0) throw InputError(fmt::format("{}: cannot read this file: {}", path, reason()));
  if (is_hdf5 == 0) throw InputError(fmt::format("{}: this is not an HDF5 file, or less than its beginning", path));
  const Handle access(access_list(nullptr), H5Pclose);
  const hid_t file = H5Fopen(path.c_str(), how, access);
  if (file < 0) throw InputError(fmt::format("{}: this HDF5 file is cut short or damaged: {}", path, reason()));
  return {path, file, nullptr};
}

void Hdf5File::close() {
  if (file_ < 0) return;
  // Closing waits for all ranks: each makes sure first that its own part has gone out.
  settle(H5Fflush(file_, H5F_SCOPE_LOCAL) < 0 ? write_failure("the end of this file") : "");
  const hid_t file = std::exchange(file_, -1);
  settle(H5Fclose(file) < 0 ? write_failure("the end of this file") : "");
}

std::string Hdf5File::write_failure(const std::string& what) const {
  const auto why = reason();
  const bool full = why.find("No space left") != std::string::npos || why.find("quota") != std::string::npos;
  return fmt::format("{}: writing {} failed: {}; {}choose another folder with --out", path_, what, why, full ? "free some space or " : "");
}

/// One rank's failure is all ranks'.
void Hdf5File::settle(const std::string& failure) {
  const std::string first = comm_ ? agree(*comm_, failure) : failure;
  if (first.empty()) return;
  failed_ = true;
  throw ComputationError(first);
}

void Hdf5File::fail_read(const std::string& what) const {
  throw InputError(fmt::format("{}: cannot read {}: {}; the file is damaged or was not written by this program", path_, what, reason()));
}

void Hdf5File::require_space(const std::string& name, double bytes) const {
  constexpr double mb = 1e6, margin = 1.0;  // for HDF5's own tables and the small files beside this one
  const auto check = [&] {
    std::error_code unknown;
    const double free = static_cast<double>(std::filesystem::space(path_, unknown).available) / mb;
    if (!unknown && free < bytes / mb + margin)
      throw ComputationError(
          fmt::format("{}: the disk is full: {} needs {:.4g} MB and {:.4g} MB are free; what was written before is complete. "
                      "Free some space or choose another folder with --out",
                      path_, name, bytes / mb + margin, free));
  };
  if (comm_)
    on_root(*comm_, check);
  else
    check();
}

void Hdf5File::write_slab(const std::string& name, const Shape& shape, const Slab* mine, hid_t type, const void* data,
                          const Shape& memory) {
  double bytes = static_cast<double>(H5Tget_size(type));
  for (const auto n : shape) bytes *= static_cast<double>(n);
  require_space(name, bytes);
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links, 1);
  const Handle set(H5Dcreate2(file_, name.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  std::string failure = set.bad() ? write_failure(name) : "";

  const Shape origin(shape.size(), 0);
  const Shape& count = mine ? mine->count : shape;
  const Shape& in_memory = memory.empty() ? count : memory;
  const Handle source(H5Screate_simple(static_cast<int>(in_memory.size()), in_memory.data(), nullptr), H5Sclose);
  if (mine || !comm_ || comm_->root()) {
    H5Sselect_hyperslab(space, H5S_SELECT_SET, mine ? mine->offset.data() : origin.data(), nullptr, count.data(), nullptr);
    H5Sselect_hyperslab(source, H5S_SELECT_SET, origin.data(), nullptr, count.data(), nullptr);
    if (failure.empty() && (H5Sselect_valid(space) <= 0 || H5Sselect_valid(source) <= 0))
      failure = fmt::format("{}: writing {} failed: this rank's part lies outside the array", path_, name);
  } else {
    H5Sselect_none(space);
    H5Sselect_none(source);
  }
  write_selected(name, set, type, source, space, data, failure);
}

/// Each rank writes its part on its own, and what that came to is agreed on: in a collective write that fails on one rank
/// the others may wait for it for ever (Open MPI 4.1).
void Hdf5File::write_selected(const std::string& name, hid_t set, hid_t type, hid_t source, hid_t space, const void* data,
                              std::string failure) {
  settle(failure);
  settle(H5Dwrite(set, type, source, space, H5P_DEFAULT, data) < 0 ? write_failure(name) : "");
}

void Rows::add(hsize_t first, hsize_t count) {
  if (count == 0) return;
  if (!pieces.empty() && pieces.back().first + pieces.back().count == first)
    pieces.back().count += count;
  else
    pieces.push_back({first, count});
}

hsize_t Rows::count() const {
  hsize_t sum = 0;
  for (const Piece& piece : pieces) sum += piece.count;
  return sum;
}

void Hdf5File::write_rows(const std::string& name, const Shape& shape, const Rows& mine, hid_t type, const void* data) {
  double bytes = static_cast<double>(H5Tget_size(type));
  for (const auto n : shape) bytes *= static_cast<double>(n);
  require_space(name, bytes);
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links, 1);
  const Handle set(H5Dcreate2(file_, name.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  std::string failure = set.bad() ? write_failure(name) : "";
  Shape first(shape.size(), 0), count = shape;
  H5Sselect_none(space);
  for (const Rows::Piece& piece : mine.pieces) {
    first[0] = piece.first, count[0] = piece.count;
    H5Sselect_hyperslab(space, H5S_SELECT_OR, first.data(), nullptr, count.data(), nullptr);
  }
  count[0] = mine.count();
  const bool none = count[0] == 0;
  if (none) count[0] = 1;
  const Handle source(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
  if (none) H5Sselect_none(source);
  if (failure.empty() && !none && H5Sselect_valid(space) <= 0)
    failure = fmt::format("{}: writing {} failed: this rank's part lies outside the array", path_, name);
  const double nothing = 0;
  write_selected(name, set, type, source, space, none ? &nothing : data, failure);
}

void Hdf5File::write(const std::string& name, const Shape& shape, const Rows& mine, const double* data) {
  write_rows(name, shape, mine, H5T_NATIVE_DOUBLE, data);
}
void Hdf5File::write(const std::string& name, const Shape& shape, const Rows& mine, const std::int32_t* data) {
  write_rows(name, shape, mine, H5T_NATIVE_INT32, data);
}
void Hdf5File::write(const std::string& name, const Shape& shape, const Rows& mine, const std::int64_t* data) {
  write_rows(name, shape, mine, H5T_NATIVE_INT64, data);
}

void Hdf5File::write(const std::string& name, const Shape& shape, const double* data) {
  write_slab(name, shape, nullptr, H5T_NATIVE_DOUBLE, data, {});
}
void Hdf5File::write(const std::string& name, const Shape& shape, const std::int32_t* data) {
  write_slab(name, shape, nullptr, H5T_NATIVE_INT32, data, {});
}
void Hdf5File::write(const std::string& name, const Shape& shape, const std::int64_t* data) {
  write_slab(name, shape, nullptr, H5T_NATIVE_INT64, data, {});
}
void Hdf5File::write(const std::string& name, const Shape& shape, const Slab& mine, const double* data, const Shape& memory) {
  write_slab(name, shape, &mine, H5T_NATIVE_DOUBLE, data, memory);
}
void Hdf5File::write(const std::string& name, const Shape& shape, const Slab& mine, const std::int8_t* data) {
  write_slab(name, shape, &mine, H5T_NATIVE_INT8, data, {});
}
void Hdf5File::write(const std::string& name, const Shape& shape, const Slab& mine, const std::int64_t* data) {
  write_slab(name, shape, &mine, H5T_NATIVE_INT64, data, {});
}

void Hdf5File::write_text(const std::string& name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, text.size() + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  write_slab(name, {1}, nullptr, type, text.c_str(), {});
}

std::string Hdf5File::read_text(const std::string& name) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (set.bad()) fail_read(name);
  const Handle type(H5Dget_type(set), H5Tclose);
  if (shape(name) != Shape{1} || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) fail_read(name);
  std::string value(H5Tget_size(type), '\0');
  if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value.data()) < 0) fail_read(name);
  return value.c_str();
}

void Hdf5File::write_attribute(const std::string& object, const std::string& name, hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate_by_name(file_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  const bool bad = attribute.bad() || H5Awrite(attribute, type, value) < 0;
  settle(bad ? write_failure("attribute " + name) : "");
}

void Hdf5File::attribute(const std::string& object, const std::string& name, double value) {
  write_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
}
void Hdf5File::attribute(const std::string& object, const std::string& name, std::int64_t value) {
  write_attribute(object, name, H5T_NATIVE_INT64, &value);
}
void Hdf5File::attribute(const std::string& object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, value.size() + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  write_attribute(object, name, type, value.c_str());
}

bool Hdf5File::has(const std::string& object) const {
  if (object == "/") return true;
  for (std::size_t cut = object.find('/', 1); cut != std::string::npos; cut = object.find('/', cut + 1))
    if (H5Lexists(file_, object.substr(0, cut).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(file_, object.c_str(), H5P_DEFAULT) > 0;
}

bool Hdf5File::has_attribute(const std::string& object, const std::string& name) const {
  return has(object) && H5Aexists_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

void Hdf5File::link(const std::string& name, const std::string& file, const std::string& object) {
  const bool bad = H5Lcreate_external(file.c_str(), object.c_str(), file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT) < 0;
  settle(bad ? write_failure("link " + name) : "");
}

std::vector<std::string> Hdf5File::entries(const std::string& group) const {
  std::vector<std::string> names;
  const Handle open(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose);
  if (open.bad()) fail_read(group);
  H5Literate(
      open, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
      },
      &names);
  return names;
}

Shape Hdf5File::shape(const std::string& name) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (set.bad()) fail_read(name);
  const Handle space(H5Dget_space(set), H5Sclose);
  Shape dims(H5Sget_simple_extent_ndims(space));
  H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  return dims;
}

bool Hdf5File::is_integer(const std::string& name) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (set.bad()) fail_read(name);
  const Handle type(H5Dget_type(set), H5Tclose);
  return H5Tget_class(type) == H5T_INTEGER;
}

void Hdf5File::read_slab(const std::string& name, const Slab* part, hid_t type, void* data) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (set.bad()) fail_read(name);
  const Handle stored(H5Dget_type(set), H5Tclose);
  if (H5Tget_class(stored) != H5Tget_class(type))
    throw InputError(fmt::format("{}: {} holds another type of number than expected", path_, name));
  if (!part) {
    if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) fail_read(name);
    return;
  }
  const Handle space(H5Dget_space(set), H5Sclose);
  const Handle memory(H5Screate_simple(static_cast<int>(part->count.size()), part->count.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space, H5S_SELECT_SET, part->offset.data(), nullptr, part->count.data(), nullptr) < 0 ||
      H5Dread(set, type, memory, space, H5P_DEFAULT, data) < 0)
    fail_read(name);
}

void Hdf5File::read(const std::string& name, double* data) const { read_slab(name, nullptr, H5T_NATIVE_DOUBLE, data); }
void Hdf5File::read(const std::string& name, std::int32_t* data) const { read_slab(name, nullptr, H5T_NATIVE_INT32, data); }
void Hdf5File::read(const std::string& name, std::int64_t* data) const { read_slab(name, nullptr, H5T_NATIVE_INT64, data); }
void Hdf5File::read(const std::string& name, const Slab& part, double* data) const { read_slab(name, &part, H5T_NATIVE_DOUBLE, data); }
void Hdf5File::read(const std::string& name, const Slab& part, std::int64_t* data) const { read_slab(name, &part, H5T_NATIVE_INT64, data); }

void Hdf5File::read_attribute(const std::string& object, const std::string& name, hid_t type, void* value) const {
  const Handle attribute(H5Aopen_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute.bad() || H5Aread(attribute, type, value) < 0) fail_read("attribute " + name);
}

double Hdf5File::number(const std::string& object, const std::string& name) const {
  double value = 0;
  read_attribute(object, name, H5T_NATIVE_DOUBLE, &value);
  return value;
}

std::int64_t Hdf5File::integer(const std::string& object, const std::string& name) const {
  std::int64_t value = 0;
  read_attribute(object, name, H5T_NATIVE_INT64, &value);
  return value;
}

std::string Hdf5File::text(const std::string& object, const std::string& name) const {
  const Handle attribute(H5Aopen_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute.bad()) fail_read("attribute " + name);
  const Handle type(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) fail_read("attribute " + name);
  std::string value(H5Tget_size(type), '\0');
  if (H5Aread(attribute, type, value.data()) < 0) fail_read("attribute " + name);
  return value.c_str();
}

}  // namespace corpuscle

#endif
