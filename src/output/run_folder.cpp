#include "output/run_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "core/error.hpp"
#include "core/log.hpp"
#include "output/on_root.hpp"
#include "output/text_file.hpp"

namespace corpuscle {
namespace fs = std::filesystem;

namespace {

constexpr const char* lock_name = ".corpuscle.lock";
constexpr const char* run_name = ".corpuscle.run";
const std::vector<std::string> result_files = {"report.json",      "history.csv",   "fields.h5",   "fields.xdmf",   "cells.h5",
                                               "cells.xdmf",       "checkpoint.h5", "blood.csv",   "blood.h5",      "cell_series.h5",
                                               "cell_series.xdmf", "bodies.h5",     "bodies.xdmf", "resolved.toml", "report.html"};

std::string first_result(const fs::path& folder) {
  for (const auto& name : result_files)
    if (fs::exists(folder / name)) return name;
  return "";
}

std::string new_run() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}", random(), random(), random());
}

/// What lies in a folder: the name of its run, and where that one began, if at a checkpoint of another.
struct RunLabel {
  std::string run, from;
  long step = -1;
  explicit RunLabel(const fs::path& folder) { std::ifstream(folder / run_name) >> run >> from >> step; }
};

std::string label_text(const std::string& run, const Continued& from) { return fmt::format("{}\n{} {}\n", run, from.run, from.step); }

std::string this_host() {
  char name[256] = "";
  ::gethostname(name, sizeof name - 1);
  return name;
}

}  // namespace

void remove_results(const std::string& folder) {
  std::error_code ignored;
  for (const auto& name : result_files) {
    fs::remove(fs::path(folder) / name, ignored);
    for (const char* unfinished : {".part", ".old"}) fs::remove(fs::path(folder) / (name + unfinished), ignored);
  }
  fs::remove(fs::path(folder) / run_name, ignored);
  for (const char* series : {"fields", "cells", "cell_series", "bodies"}) {
    const auto inner = fs::path(folder) / series;
    if (!fs::is_directory(inner, ignored)) continue;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(inner)) {
      const auto name = entry.path().filename().string();
      if (name.rfind("step_", 0) == 0 || name.rfind("grid.h5", 0) == 0 || name.rfind("mesh.h5", 0) == 0 || name.rfind("numbers.h5", 0) == 0)
        files.push_back(entry.path());
    }
    for (const auto& file : files) fs::remove(file, ignored);
    fs::remove(inner, ignored);  // only if nothing else is in it
  }
  std::vector<fs::path> coarser;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.is_directory() && entry.path().filename().string().rfind("coarser_", 0) == 0) coarser.push_back(entry.path());
  for (const auto& inner : coarser) {
    remove_results(inner.string());
    fs::remove(inner, ignored);
  }
}

RunFolder::RunFolder(const Comm& comm, const std::string& named, const std::string& case_name, EarlierResults earlier,
                     const std::optional<Continued>& continued)
    : comm_(comm), earlier_(earlier) {
  on_root(comm_, [&] { claim(named, case_name, continued); });
  comm_.broadcast(path_);
  comm_.broadcast(run_);
}

RunFolder::~RunFolder() {
  if (comm_.root()) give_back();
}

void RunFolder::give_back() {
  std::error_code ignored;
  const bool unmake = !begun_ && !first_made_.empty();
  if (unmake) fs::remove(fs::path(path_) / lock_name, ignored);
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
  if (!unmake) return;
  for (fs::path folder = path_; fs::remove(folder, ignored) && folder != first_made_;) folder = folder.parent_path();
}

void RunFolder::claim(const std::string& named, const std::string& case_name, const std::optional<Continued>& continued) {
  try {
    if (named.empty())
      make_numbered(case_name);
    else
      make(named);
    lock();
    const auto result = first_result(path_);
    if (!result.empty() && earlier_ == EarlierResults::refuse)
      throw InputError(
          fmt::format("--out {}: holds the results of an earlier run ({}): choose another folder, write over them with "
                      "--overwrite, or go on from them with --restart {}/checkpoint.h5",
                      path_, result, path_));
    run_ = new_run();
    label_ = run_ + "\n";
    if (continued) settle_run(*continued);
  } catch (const InputError&) {
    give_back();
    throw;
  }
}

/// A restart goes on in a folder without results, or in that of the checkpoint's run: the two names are the same, or the
/// folder's run began at this very checkpoint. Without a name, as in a copy, the checkpoint must lie in the folder.
void RunFolder::settle_run(const Continued& continued) {
  label_ = label_text(run_, continued);
  std::error_code ignored;
  const auto result = first_result(path_);
  const bool here = fs::equivalent(path_, fs::absolute(continued.checkpoint, ignored).parent_path(), ignored);
  if (earlier_ == EarlierResults::overwrite && here)
    throw InputError(
        fmt::format("--overwrite would remove {} before the run goes on from it: leave out --overwrite, or choose "
                    "another folder with --out",
                    continued.checkpoint));
  if (result.empty() || earlier_ == EarlierResults::overwrite) return;
  const RunLabel label(path_);
  const bool began_here = label.from == continued.run && label.step == continued.step;
  if (label.run.empty() ? !here : label.run != continued.run && !began_here)
    throw InputError(
        fmt::format("--out {}: holds the results of another run ({}) than {} is of: choose another folder, go on "
                    "from its own {}/checkpoint.h5, or write over them with --overwrite",
                    path_, result, continued.checkpoint, path_));
  run_ = label.run.empty() ? continued.run : label.run;
  label_ = label.run.empty() ? label_text(run_, continued) : "";
}

void RunFolder::make(const std::string& path) {
  std::error_code ignored;
  fs::path folder = fs::path(path).lexically_normal();
  if (folder.filename().empty() && folder.has_parent_path() && folder != folder.root_path()) folder = folder.parent_path();
  for (fs::path above = folder; !above.empty() && !fs::exists(above, ignored); above = above.parent_path()) first_made_ = above.string();
  prepare_folder(path);
  path_ = folder.string();
}

/// Whoever makes a folder owns its number, however many runs start at once.
void RunFolder::make_numbered(const std::string& case_name) {
  std::error_code ignored;
  if (!fs::exists("runs", ignored)) first_made_ = "runs";
  prepare_folder("runs");
  const std::string start = case_name + "-";
  int number = 0;
  for (const auto& entry : fs::directory_iterator("runs", ignored)) {
    const auto name = entry.path().filename().string();
    if (name.rfind(start, 0) != 0) continue;
    const auto digits = name.substr(start.size());
    if (!digits.empty() && digits.size() < 9 && digits.find_first_not_of("0123456789") == std::string::npos)
      number = std::max(number, std::stoi(digits));
  }
  for (;;) {
    const auto path = fmt::format("runs/{}{:03d}", start, ++number);
    if (::mkdir(path.c_str(), 0777) == 0) {
      path_ = path;
      if (first_made_.empty()) first_made_ = path;
      numbered_ = true;
      return;
    }
    if (errno != EEXIST) throw InputError(fmt::format("{}: cannot create this folder: {}", path, std::strerror(errno)));
  }
}

/// @param why  errno of the lock
void RunFolder::refuse_shared(const std::string& path, int why) {
  if (why != EWOULDBLOCK)
    return warn("{}: this file system has no locks ({}): see to it that no other run uses the folder", path_, std::strerror(why));
  std::string holder;
  std::ifstream(path) >> holder;
  first_made_.clear();  // it is the other run's
  throw InputError(fmt::format("--out {}: another run is writing there{}: choose another folder, or wait until it has ended", path_,
                               holder.empty() ? "" : " (process " + holder + ")"));
}

/// The system gives the lock back when the process ends, however it ends.
void RunFolder::lock() {
  const auto path = (fs::path(path_) / lock_name).string();
  struct stat opened {
  }, named{};
  do {  // another run may have removed the file, with the folder, between these two calls
    if (lock_ >= 0) ::close(lock_);
    lock_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0) throw InputError(fmt::format("--out {}: cannot write in this folder: {}", path_, std::strerror(errno)));
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) return refuse_shared(path, errno);
  } while (::fstat(lock_, &opened) == 0 && (::stat(path.c_str(), &named) != 0 || opened.st_ino != named.st_ino));
  const auto holder = fmt::format("{}@{}\n", ::getpid(), this_host());
  if (::ftruncate(lock_, 0) != 0 || ::write(lock_, holder.data(), holder.size()) < 0) return;  // only for messages
}

void RunFolder::point_latest() const {
  std::error_code error;
  const fs::path link = "runs/latest", temporary = fmt::format("runs/.latest-{}", ::getpid());
  if (fs::exists(fs::symlink_status(link, error)) && !fs::is_symlink(link, error)) return;  // the user's own
  fs::create_directory_symlink(fs::path(path_).filename(), temporary, error);
  if (!error) fs::rename(temporary, link, error);
}

void RunFolder::begin() {
  on_root(comm_, [&] {
    if (earlier_ == EarlierResults::overwrite) remove_results(path_);
    if (!label_.empty()) replace_text_file((fs::path(path_) / run_name).string(), label_);
    if (numbered_) point_latest();
  });
  begun_ = true;
}

}  // namespace corpuscle
