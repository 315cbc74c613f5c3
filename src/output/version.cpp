#include "output/version.hpp"

#include <HYPRE_config.h>
#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <fstream>
#include <thread>

#include "common/types.hpp"

#ifdef CORPUSCLE_MPI
#include <mpi.h>
#endif
#ifdef CORPUSCLE_HDF5
#include <H5public.h>
#endif

namespace corpuscle {

extern const char source_hash[];  // written by git_hash.cmake

namespace {

std::string mpi_version() {
#ifdef CORPUSCLE_MPI
  char text[MPI_MAX_LIBRARY_VERSION_STRING];
  int length = 0;
  MPI_Get_library_version(text, &length);  // one of the few calls before MPI_Init
  const std::string whole(text, length);
  return whole.substr(0, whole.find_first_of(",\n"));
#else
  return "none";
#endif
}

std::string hdf5_version() {
#ifdef CORPUSCLE_HDF5
  return fmt::format("{}.{}.{}", H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE);
#else
  return "none";
#endif
}

}  // namespace

std::string version_number() { return CORPUSCLE_VERSION; }

std::string git_hash() {
  const std::string hash = source_hash;
  return hash.empty() ? "unknown" : hash;
}

std::string backend_name() { return Exec::name(); }

std::vector<std::pair<std::string, std::string>> libraries() {
  return {{"Kokkos", fmt::format("{}.{}.{}", KOKKOS_VERSION / 10000, KOKKOS_VERSION / 100 % 100, KOKKOS_VERSION % 100)},
          {"hypre", HYPRE_RELEASE_VERSION},
          {"MPI", mpi_version()},
          {"HDF5", hdf5_version()}};
}

std::vector<std::pair<std::string, std::string>> machine() {
  utsname names{};
  uname(&names);
  std::string processor = names.machine;
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);)
    if (line.rfind("model name", 0) == 0) {
      processor = line.substr(std::min(line.size(), line.find(':') + 2));
      break;
    }
  return {{"host", names.nodename},
          {"processor", processor},
          {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"system", fmt::format("{} {}", names.sysname, names.release)}};
}

std::string version_text() {
  std::string text = fmt::format("corpuscle {}\ngit {}\nback end {}", version_number(), git_hash(), backend_name());
  for (const auto& [name, version] : libraries()) text += fmt::format("\n{} {}", name, version);
  return text;
}

}  // namespace corpuscle
