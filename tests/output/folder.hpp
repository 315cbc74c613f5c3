// A folder for what one test writes, and small helpers to look at it.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "parallel/comm.hpp"

namespace test {

/// Empty, made by rank 0, named for the number of ranks so that runs on several do not meet.
inline std::filesystem::path fresh_folder(const std::string& name) {
  const corpuscle::Comm comm;
  const auto folder = std::filesystem::temp_directory_path() / ("corpuscle_output_" + std::to_string(comm.size()) + "_" + name);
  comm.barrier();
  if (comm.root()) {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  comm.barrier();
  return folder;
}

inline std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Message of the Error that `work` throws, "" if it throws none; other exceptions pass.
template <class Error, class Work>
std::string message_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace test
