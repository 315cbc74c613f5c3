// A file that a test writes and that goes away with it.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

/// A file in a folder of its own that goes away with it.
struct TemporaryFile {
  explicit TemporaryFile(const std::string& name) {
    std::string pattern = (std::filesystem::temp_directory_path() / "corpuscle_mesh_XXXXXX").string();
    folder = mkdtemp(pattern.data());
    path = (folder / name).string();
  }
  ~TemporaryFile() { std::filesystem::remove_all(folder); }
  void fill(const std::string& text) const { std::ofstream(path, std::ios::binary) << text; }

  std::filesystem::path folder;
  std::string path;
};
