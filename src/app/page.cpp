#include "app/page.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "core/error.hpp"

namespace corpuscle {
namespace fs = std::filesystem;

namespace {

/// In an installed tree beside the program; else where the source was.
std::string find_script() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const std::vector<fs::path> places{program.parent_path().parent_path() / "share/corpuscle/cases/report.py",
                                     fs::path(CORPUSCLE_SOURCE) / "cases/report.py"};
  for (const auto& place : places)
    if (fs::exists(place, ignored)) return place.string();
  throw InputError(fmt::format("report: {} is not there, nor {}: install the program with cmake --install, or keep its source",
                               places[0].string(), places[1].string()));
}

}  // namespace

void make_page(const std::string& folder, const std::string& out) {
  const std::string script = find_script();
  std::vector<std::string> words{"python3", script, folder};
  if (!out.empty()) words.insert(words.end(), {"--out", out});
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv[0], argv.data());
  throw InputError(
      fmt::format("report: python3 cannot be started ({}): apt-get install python3 python3-h5py python3-matplotlib, or python3 of "
                  "your own with h5py, numpy and matplotlib on the path",
                  std::strerror(errno)));
}

}  // namespace corpuscle
