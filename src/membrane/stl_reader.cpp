#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "membrane/mesh_readers.hpp"
#include "membrane/mesh_text.hpp"

namespace corpuscle {

namespace {

void add_facet(MeshFile& file, const std::array<Triple, 3>& corners, int part) {
  const int first = int(file.mesh.vertices.size());
  file.mesh.vertices.insert(file.mesh.vertices.end(), corners.begin(), corners.end());
  file.mesh.triangles.push_back({first, first + 1, first + 2});
  file.part.push_back(part);
}

void take(MeshText& text, const char* wanted) {
  const auto word = text.word(wanted);
  if (lower_case(word) != wanted) text.fail(fmt::format("'{}' stands where '{}' should", word, wanted));
}

/// "endsolid" or "end solid", and so on. @returns whether it was there
bool take_end(MeshText& text, const std::string& of) {
  if (text.peek() == "end" + of) {
    text.word("the end");
    return true;
  }
  if (text.peek() != "end") return false;
  text.word("the end");
  take(text, of.c_str());
  return true;
}

std::array<Triple, 3> read_facet(MeshText& text) {
  take(text, "facet");
  if (text.peek() == "normal") {
    text.word("normal");
    for (int i = 0; i < 3; ++i) text.word("a facet's normal");
  }
  take(text, "outer");
  take(text, "loop");
  std::array<Triple, 3> corners;
  for (Triple& p : corners) {
    take(text, "vertex");
    for (double& c : p) c = text.number("a coordinate");
  }
  if (text.peek() == "vertex") {
    text.word("vertex");
    text.fail("a facet with more than three corners; only triangles are taken: triangulate the surface");
  }
  for (const char* of : {"loop", "facet"})
    if (!take_end(text, of)) take(text, (std::string("end") + of).c_str());
  return corners;
}

}  // namespace

MeshFile read_ascii_stl(const std::string& path, const std::string& content) {
  MeshText text(path, content, 0);
  MeshFile file;
  while (!text.end()) {
    const int part = int(file.parts.size());
    take(text, "solid");
    const std::string name = text.rest_of_line();
    file.parts.push_back(name.empty() ? fmt::format("number {}", part + 1) : "'" + name + "'");
    while (!take_end(text, "solid")) {
      if (text.end()) text.word("'facet' or 'endsolid'");
      add_facet(file, read_facet(text), part);
    }
    text.rest_of_line();
  }
  return file;
}

std::uint32_t claimed_triangles(const std::string& content) {
  std::uint32_t claimed = 0;
  if (content.size() >= stl_header) std::memcpy(&claimed, content.data() + stl_header - sizeof claimed, sizeof claimed);
  return claimed;
}

MeshFile read_binary_stl(const std::string& path, const std::string& content) {
  const std::size_t claimed = claimed_triangles(content), bytes = stl_header + stl_record * claimed;
  if (content.size() < bytes || claimed == 0)
    refuse_mesh_file(path, fmt::format("neither OFF nor STL, or a truncated binary STL file: its head claims {} triangles, "
                                       "which take {} bytes, but it has {}",
                                       claimed, bytes, content.size()));
  MeshFile file;
  for (std::size_t t = 0; t < claimed; ++t) {
    const std::size_t at = stl_header + t * stl_record;
    float values[12];
    std::memcpy(values, content.data() + at, sizeof values);
    std::array<Triple, 3> corners;
    for (int k = 0; k < 9; ++k) {
      corners[k / 3][k % 3] = values[3 + k];
      if (!std::isfinite(values[3 + k]))
        refuse_mesh_file(path,
                         fmt::format("damaged: a coordinate of triangle {} (at byte {}) is not finite", t, at + sizeof(float) * (3 + k)));
    }
    add_facet(file, corners, 0);
  }
  if (content.size() > bytes)
    file.notes.push_back(fmt::format("{} bytes after the last of its {} triangles are left out", content.size() - bytes, claimed));
  return file;
}

}  // namespace corpuscle
