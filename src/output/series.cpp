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

bool before(const StoredTime& a, const StoredTime& b) { return a.group < b.group; }

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
    throw InputError(fmt::format("{}: cannot continue this file, it is not {}; choose another folder with --out", path, format));
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
      index_(folder_ + ".h5"),
      xdmf_(folder_ + ".xdmf"),
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
  if (comm_.root() && fs::exists(index_.path())) there = "yes";
  comm_.broadcast(there);
  return !there.empty();
}

void Series::resume(double last_us) {
  on_root(comm_, [&] {
    stored_times(index_.path(), format_);
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
    std::sort(times_.begin(), times_.end(), before);
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
    const auto at = std::lower_bound(times_.begin(), times_.end(), time, before);
    if (at != times_.end() && at->group == time.group) {
      write_index();
      rewrite_xdmf();
      return;
    }
    times_.push_back(time);
    append_index();
    append_xdmf();
  });
}

/// Links only, so that writing it anew costs little however large the arrays are.
void Series::write_index() {
  auto index = Hdf5File::create(index_.spare());
  index.attribute("/", "format", format_);
  index.attribute("/", "git", git_hash());
  for (const auto& array : shared_) index.link(array, name_ + "/" + shared_file_ + ".h5", "/" + array);
  for (const auto& time : times_) index.link(time.group, name_ + "/" + time.group + ".h5", "/");
  index.close();
  index_.put_in_place(false);
}

void Series::append_index() {
  const auto add = [&] {
    auto index = Hdf5File::append(index_.spare());
    for (std::size_t n = indexed_; n < times_.size(); ++n) index.link(times_[n].group, name_ + "/" + times_[n].group + ".h5", "/");
    index.close();
  };
  const auto copy = [&] {
    index_.copy();
    indexed_ = times_.size() - 1;
  };
  if (!index_.has_spare()) copy();
  try {
    add();
  } catch (const InputError&) {  // somebody has it open
    copy();
    add();
  }
  index_.put_in_place(true);
  indexed_ = times_.size() - 1;
}

std::string Series::grid_text(const StoredTime& time) const {
  return fmt::format("   <Grid Name=\"{}\" GridType=\"Uniform\">\n    <Time Value=\"{}\"/>\n{}   </Grid>\n", name_, time.time_us,
                     describe_(time, Hdf5File::read(path(time.group))));
}

void Series::rewrite_xdmf() {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
      "  <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
      name_);
  for (const auto& time : times_) text += grid_text(time);
  xdmf_length_ = text.size();
  xdmf_text_.clear();
  TextFile file(xdmf_.spare());
  file.write(text + xdmf_end);
  file.close();
  xdmf_.put_in_place(false);
}

/// The times that the second file lacks over its end, and the end after them.
void Series::append_xdmf() {
  if (!xdmf_.has_spare()) {
    xdmf_.copy();
    xdmf_length_ += xdmf_text_.size();
    xdmf_text_.clear();
  }
  const auto text = grid_text(times_.back()), whole = xdmf_text_ + text + xdmf_end;
  const auto& path = xdmf_.spare();
  std::FILE* file = std::fopen(path.c_str(), "r+");
  const bool written = file && std::fseek(file, static_cast<long>(xdmf_length_), SEEK_SET) == 0 &&
                       std::fwrite(whole.data(), 1, whole.size(), file) == whole.size() && std::fflush(file) == 0;
  const int why = errno;
  if (file) std::fclose(file);
  if (!written) throw ComputationError(fmt::format("{}: writing failed: {}", path, std::strerror(why)));
  xdmf_.put_in_place(true);
  xdmf_length_ += xdmf_text_.size();
  xdmf_text_ = text;
}

std::string xdmf_item(const std::string& file, const std::string& data_set, const Shape& shape, const char* number, int bytes) {
  return fmt::format("<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" Format=\"HDF\">{}:/{}</DataItem>",
                     fmt::join(shape, " "), number, bytes, file, data_set);
}

std::string xdmf_attribute(const std::string& name, int components, const char* center, const std::string& item) {
  return fmt::format("    <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">\n     {}\n    </Attribute>\n", name,
                     components == 3 ? "Vector" : "Scalar", center, item);
}

}  // namespace corpuscle

#endif
