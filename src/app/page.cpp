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

std::string find_script() {
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  // Installed; in a build folder of a checkout, wherever that has been moved; in one elsewhere.
  std::vector<fs::path> places{folder / CORPUSCLE_SHARE, folder.parent_path().parent_path()};
  if (folder == fs::path(CORPUSCLE_BUILD)) places.emplace_back(CORPUSCLE_SOURCE);
  for (auto& place : places) {
    place = (place / "cases/report.py").lexically_normal();
    if (!folder.empty() && fs::exists(place, ignored)) return place.string();
  }
  throw InputError(
      fmt::format("report: {} is not there: it comes with the program (cmake --install), or lies in its source: python3 "
                  "cases/report.py DIR does the same",
                  places[0].string()));
}

}  // namespace

void make_page(const std::string& folder, const std::string& out) {
  const std::string script = find_script();
  std::vector<std::string> words{"python3", script};
  if (!out.empty()) words.push_back("--out=" + out);
  words.insert(words.end(), {"--", folder});
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv[0], argv.data());
  throw InputError(
      fmt::format("report: python3 cannot be started ({}): apt-get install python3 python3-h5py python3-matplotlib, or python3 of "
                  "your own with h5py, numpy and matplotlib on the path",
                  std::strerror(errno)));
}

}  // namespace corpuscle
