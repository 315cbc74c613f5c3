// Starting the program as a user does, and looking at what it says and writes.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "common/types.hpp"

#ifdef CORPUSCLE_HDF5
#include <hdf5.h>
#endif

namespace app {

namespace fs = std::filesystem;

/// Whether the program has threads on the host, as builds for a device may not.
#ifdef KOKKOS_ENABLE_OPENMP
constexpr bool host_threads = true;
#else
constexpr bool host_threads = false;
#endif

/// Whether all that the program takes is memory of its process. A device's is not, and what its driver takes is no figure of ours.
inline bool host_memory() {
  constexpr bool yes = std::is_same_v<corpuscle::Memory, Kokkos::HostSpace>;
  if (!yes) WARN("skipped: memory is not this process's alone");
  return yes;
}

/// Path of a case file.
inline std::string scene(const std::string& name) { return CORPUSCLE_SOURCE_DIR "/cases/" + name + ".toml"; }

/// What this process writes; goes when it ends.
struct TemporaryFolder {
  fs::path path = fs::temp_directory_path() / ("corpuscle_app_" + std::to_string(::getpid()));
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

/// Empty, and of this process alone.
inline fs::path fresh_folder(const std::string& name) {
  static const TemporaryFolder all;
  const auto folder = all.path / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

inline std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::string quoted(const std::string& text) {
  std::string safe = "'";
  for (const char c : text) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return safe + "'";
}

/// Variables with which MPI tells a process that it is one of several: this process has started MPI, and a child that
/// inherits them takes itself for a part of it.
inline std::string without_mpi_environment() {
  std::string options;
  for (char** entry = environ; *entry; ++entry) {
    const std::string name = std::string(*entry).substr(0, std::string(*entry).find('='));
    const bool keep = name.rfind("OMPI_ALLOW_RUN_AS_ROOT", 0) == 0;
    for (const char* prefix : {"OMPI_", "PMIX_", "PMI_", "ORTE_", "OPAL_"})
      if (!keep && name.rfind(prefix, 0) == 0) options += " -u " + quoted(name);
  }
  return options;
}

using Words = std::vector<std::string>;

struct Launch {
  int threads = 1, ranks = 1;
  std::string waiting = "OMP_WAIT_POLICY=passive";  // options and variables for env
  bool overwrite = true;                            // results that an earlier run of the test has left in the folder of --out
  std::string before = {};                          // shell commands of each rank before it starts, such as a limit on the size of files
};

struct Outcome {
  int code = -1;       // exit code; 124 after two minutes
  std::string output;  // what went to the screen
};

/// The command line that runs the program in `folder`, its screen in screen.txt there. Unless told otherwise
/// its threads yield while they wait: on a machine with other work, or with one core, they would spend most of their time in each other's
/// way.
/// @param limit  what stops it after a time, such as "timeout 120", or nothing
inline std::string command_line(const fs::path& folder, const Words& words, const Launch& launch, const std::string& limit) {
  const auto has = [&](const char* word) { return std::find(words.begin(), words.end(), word) != words.end(); };
  std::string command = "cd " + quoted(folder.string()) + " && exec " + limit + " env" + without_mpi_environment() + " " + launch.waiting +
                        " OMP_NUM_THREADS=" + std::to_string(launch.threads) + " ";
  if (launch.ranks > 1) command += "mpirun -n " + std::to_string(launch.ranks) + " --oversubscribe --allow-run-as-root ";
  std::string program = quoted(CORPUSCLE_PROGRAM);
  for (const auto& word : words) program += " " + quoted(word);
  if (launch.overwrite && has("run") && has("--out") && !has("--restart")) program += " --overwrite";
  if (!launch.before.empty()) program = "sh -c " + quoted(launch.before + "; exec " + program);
  return command + program + " > screen.txt 2>&1 < /dev/null";
}

/// Run the program in `folder` and wait for it.
inline Outcome start(const fs::path& folder, const Words& words, const Launch& launch = {}) {
  const int status = std::system(command_line(folder, words, launch, "timeout 120").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder / "screen.txt")};
}

/// `words`, and "--set" before each of `overrides`.
inline Words with(Words words, const Words& overrides) {
  for (const auto& setting : overrides) words.insert(words.end(), {"--set", setting});
  return words;
}

/// The straight tube with a cell on the coarsest grid that resolves it, 0.6 um: 0.05 s a step.
inline Words coarse_tube(const std::string& out, const Words& overrides = {}) {
  Words settings{"grid.nodes=[17,17,25]", "time.step_us=1", "output.history_every_us=1"};
  settings.insert(settings.end(), overrides.begin(), overrides.end());
  return with({"run", scene("straight_tube"), "--out", out}, settings);
}

/// A run that must succeed.
inline Outcome succeed(const fs::path& folder, const Words& words, const Launch& launch = {}) {
  const auto outcome = start(folder, words, launch);
  INFO(outcome.output);
  REQUIRE(outcome.code == 0);
  return outcome;
}

/// A run that must end with `code` and say all of `parts`.
inline Outcome fail(const fs::path& folder, const Words& words, int code, const Words& parts, const Launch& launch = {}) {
  const auto outcome = start(folder, words, launch);
  INFO(outcome.output);
  CHECK(outcome.code == code);
  for (const auto& part : parts) CHECK_THAT(outcome.output, Catch::Contains(part));
  return outcome;
}

inline nlohmann::json report(const fs::path& folder) {
  INFO("report in " << folder);
  REQUIRE(fs::exists(folder / "report.json"));
  return nlohmann::json::parse(contents(folder / "report.json"));
}

/// A history.csv: names of the columns and the text of every field.
struct History {
  Words names;
  std::vector<Words> lines;

  double number(std::size_t line, const std::string& name) const {
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    INFO("line " << line << ", column " << name);
    REQUIRE(at < static_cast<long>(names.size()));
    return std::stod(lines.at(line).at(at));
  }
};

inline Words split(const std::string& line) {
  Words fields;
  std::istringstream in(line + ",");
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

inline History history(const fs::path& folder) {
  INFO("history in " << folder);
  REQUIRE(fs::exists(folder / "history.csv"));
  std::ifstream in(folder / "history.csv");
  History result;
  std::string line;
  std::getline(in, line);
  result.names = split(line);
  while (std::getline(in, line)) {
    result.lines.push_back(split(line));
    REQUIRE(result.lines.back().size() == result.names.size());
  }
  return result;
}

#ifdef CORPUSCLE_HDF5
/// The numbers of one data set of a file, as doubles.
inline std::vector<double> data_set(const fs::path& path, const std::string& name) {
  INFO(path << ": " << name);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  const hid_t set = H5Dopen(file, name.c_str(), H5P_DEFAULT);
  REQUIRE(set >= 0);
  const hid_t space = H5Dget_space(set);
  std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  REQUIRE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
  return values;
}
#endif

}  // namespace app
