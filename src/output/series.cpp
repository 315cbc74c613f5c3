#ifdef CORPUSCLE_HDF5

#include "output/series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"
#include "output/report.hpp"
#include "output/text_file.hpp"

namespace corpuscle {
namespace fs = std::filesystem;

namespace {

constexpr const char* xdmf_end = "  </Grid>\n </Domain>\n</Xdmf>\n";

bool is_step(const std::string& name) { return name.rfind("step_", 0) == 0; }

/// Whole ones, and what a killed run had begun.
std::vector<fs::path> files_of_steps(const std::string& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder))
    if (is_step(entry.path().filename().string())) paths.push_back(entry.path());
  return paths;
}

}  // namespace

std::string step_group(long step) { return fmt::format("step_{:09d}", step); }

std::vector<StoredTime> stored_times(const std::string& path, const std::string& format) {
  const auto file = Hdf5File::read(path);
  if (!file.has_attribute("/", "format") || file.text("/", "format") != format)
    throw InputError(
        fmt::format("{}: cannot continue this file, it is not {}; choose another folder with --out", path, format));
  std::vector<StoredTime> times;
  for (const auto& name : file.entries("/"))
    if (is_step(name) && file.has_attribute(name, "time_us")) times.push_back({name, file.number(name, "time_us")});
  return times;
}

Series::Series(const std::string& folder, const std::string& name, const std::string& format, const Comm& comm,
               const std::string& shared_file, const std::vector<std::string>& shared, Describe describe)
    : folder_((fs::path(folder) / name).string()),
      name_(name),
      format_(format),
      comm_(comm),
      shared_file_(shared_file),
      shared_(shared),
      describe_(std::move(describe)) {}

void Series::create() {
  on_root(comm_, [&] {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw InputError(fmt::format("{}: cannot create this folder: {}", folder_, error.message()));
    times_.clear();
    for (const auto& path : files_of_steps(folder_)) fs::remove(path, error);
  });
}

bool Series::exists() const {
  std::string there;
  if (comm_.root() && fs::exists(index_path())) there = "yes";
  comm_.broadcast(there);
  return !there.empty();
}

void Series::resume(double last_us) {
  on_root(comm_, [&] {
    stored_times(index_path(), format_);
    // The files themselves: a run that was killed may have stored one more time than it had listed.
    times_.clear();
    std::vector<fs::path> others;
    for (const auto& path : files_of_steps(folder_)) {
      // Times are multiples of the step; the slack keeps the one at which the run starts again.
      const bool whole = path.extension() == ".h5";
      const double time = whole ? Hdf5File::read(path.string()).number("/", "time_us") : 0;
      if (whole && time <= last_us * (1 + 1e-12))
        times_.push_back({path.stem().string(), time});
      else
        others.push_back(path);
    }
    std::sort(times_.begin(), times_.end(), [](const auto& a, const auto& b) { return a.group < b.group; });
    write_index();
    rewrite_xdmf();
    for (const auto& path : others) fs::remove(path);
  });
}

void Series::put_in_place(const std::string& file) const {
  std::error_code error;
  fs::rename(path(file) + unfinished, path(file), error);
  if (error) throw ComputationError(fmt::format("{}: cannot put this file in place: {}", path(file), error.message()));
}

void Series::finish_shared() {
  on_root(comm_, [&] {
    put_in_place(shared_file_);
    write_index();
    rewrite_xdmf();
  });
}

void Series::finish(long step, double time_us) {
  on_root(comm_, [&] {
    const StoredTime time{step_group(step), time_us};
    put_in_place(time.group);
    const bool again =
        std::any_of(times_.begin(), times_.end(), [&](const StoredTime& t) { return t.group == time.group; });
    if (!again) times_.push_back(time);
    write_index();
    if (again)
      rewrite_xdmf();
    else
      append_xdmf(time);
  });
}

/// Links only, so that writing it anew costs little however large the arrays are.
void Series::write_index() const {
  const auto temporary = index_path() + unfinished;
  auto index = Hdf5File::create(temporary);
  index.attribute("/", "format", format_);
  index.attribute("/", "git", git_hash());
  for (const auto& array : shared_) index.link(array, name_ + "/" + shared_file_ + ".h5", "/" + array);
  for (const auto& time : times_) index.link(time.group, name_ + "/" + time.group + ".h5", "/");
  index.close();
  std::error_code error;
  fs::rename(temporary, index_path(), error);
  if (error) throw ComputationError(fmt::format("{}: cannot put this file in place: {}", index_path(), error.message()));
}

std::string Series::grid_text(const StoredTime& time) const {
  return fmt::format("   <Grid Name=\"{}\" GridType=\"Uniform\">\n    <Time Value=\"{}\"/>\n{}   </Grid>\n", name_,
                     time.time_us, describe_(time, Hdf5File::read(path(time.group))));
}

void Series::rewrite_xdmf() {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
      "  <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
      name_);
  for (const auto& time : times_) text += grid_text(time);
  xdmf_length_ = text.size();
  replace_text_file(folder_ + ".xdmf", text + xdmf_end);
}

/// The new time over the file's end, and the end after it, in one write: its cost does not grow with the times before.
void Series::append_xdmf(const StoredTime& time) {
  const auto path = folder_ + ".xdmf", text = grid_text(time), whole = text + xdmf_end;
  std::FILE* file = std::fopen(path.c_str(), "r+");
  const bool written = file && std::setvbuf(file, nullptr, _IOFBF, whole.size() + 1) == 0 &&
                       std::fseek(file, static_cast<long>(xdmf_length_), SEEK_SET) == 0 &&
                       std::fwrite(whole.data(), 1, whole.size(), file) == whole.size() && std::fflush(file) == 0;
  const int why = errno;
  if (file) std::fclose(file);
  if (!written) throw ComputationError(fmt::format("{}: writing failed: {}", path, std::strerror(why)));
  xdmf_length_ += text.size();
}

std::string xdmf_item(const std::string& file, const std::string& data_set, const Shape& shape, const char* number,
                      int bytes) {
  return fmt::format("<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" Format=\"HDF\">{}:/{}</DataItem>",
                     fmt::join(shape, " "), number, bytes, file, data_set);
}

std::string xdmf_attribute(const std::string& name, int components, const char* center, const std::string& item) {
  return fmt::format("    <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">\n     {}\n    </Attribute>\n",
                     name, components == 3 ? "Vector" : "Scalar", center, item);
}

}  // namespace corpuscle

#endif
