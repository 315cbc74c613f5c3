#include "membrane/mesh_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <iterator>

#include "common/vec3.hpp"
#include "membrane/mesh_readers.hpp"
#include "membrane/mesh_repair.hpp"
#include "membrane/mesh_text.hpp"

namespace corpuscle {

namespace {

std::string slurp(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse_mesh_file(path, "cannot be opened; check the path");
  return {std::istreambuf_iterator<char>(file), {}};
}

bool is_text(const std::string& content) {
  constexpr std::size_t looked_at = 4096;
  return std::all_of(content.begin(), content.begin() + std::min(content.size(), looked_at),
                     [](unsigned char c) { return c > 31 || std::isspace(c); });
}

/// The first word outside comments, in lower case.
std::string first_word(const std::string& path, const std::string& content) { return MeshText(path, content.substr(0, 65536), '#').peek(); }

/// "off", with letters before it for what its vertices have beside coordinates.
bool is_off_keyword(const std::string& word) {
  return word.size() >= 3 && word.substr(word.size() - 3) == "off" &&
         word.substr(0, word.size() - 3).find_first_not_of("stcn4") == std::string::npos;
}

MeshFile parse(const std::string& path) {
  const std::string content = slurp(path);
  const std::size_t claimed = claimed_triangles(content);
  // The size decides first: many programs begin binary files with the word that marks ASCII ones.
  const bool fits = claimed > 0 && content.size() == stl_header + stl_record * claimed;
  if (!fits && is_text(content)) {
    const std::string word = first_word(path, content);
    if (word == "solid") return read_ascii_stl(path, content);
    if (is_off_keyword(word)) return read_off(path, content);
    refuse_mesh_file(path, "neither an OFF nor an STL file");
  }
  if (is_off_keyword(first_word(path, content))) return read_off(path, content);
  if (content.size() < stl_header) refuse_mesh_file(path, "neither an OFF nor an STL file");
  return read_binary_stl(path, content);
}

std::ofstream open_for_writing(const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  if (!file) refuse_mesh_file(path, "cannot be written; check that its folder exists and is writable");
  return file;
}

void finish(std::ofstream& file, const std::string& path) {
  if (!file.flush()) refuse_mesh_file(path, "could not be written whole; check the free space");
}

Vec3 unit_normal(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const auto at = [&](int k) { return Vec3{mesh.vertices[t[k]][0], mesh.vertices[t[k]][1], mesh.vertices[t[k]][2]}; };
  const Vec3 n = cross(at(1) - at(0), at(2) - at(0));
  return n * (1 / std::max(norm(n), 1e-300));
}

}  // namespace

MeshFile read_mesh(const std::string& path) {
  MeshFile file = parse(path);
  const std::size_t before = file.mesh.vertices.size();
  const bool stl = !file.part.empty();
  if (stl || is_open(file.mesh)) merge_coincident(file.mesh);
  const std::size_t after = file.mesh.vertices.size();
  if (!stl && after < before)
    file.notes.push_back(
        fmt::format("its triangles do not share their corners: of {} vertices {} coincided with others and "
                    "were merged with them",
                    before, before - after));
  drop_collapsed(file);
  return file;
}

void write_off(const std::string& path, const TriangleMesh& mesh) {
  auto file = open_for_writing(path);
  file << fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  for (const auto& p : mesh.vertices) file << fmt::format("{:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
  for (const auto& t : mesh.triangles) file << fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  finish(file, path);
}

void write_stl(const std::string& path, const TriangleMesh& mesh, StlFormat format) {
  auto file = open_for_writing(path);
  if (format == StlFormat::ascii) {
    file << "solid corpuscle\n";
    for (const auto& t : mesh.triangles) {
      const Vec3 n = unit_normal(mesh, t);
      file << fmt::format("facet normal {:.9g} {:.9g} {:.9g}\nouter loop\n", n.x, n.y, n.z);
      for (int i : t) {
        const auto& p = mesh.vertices[i];
        file << fmt::format("vertex {:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
      }
      file << "endloop\nendfacet\n";
    }
    file << "endsolid corpuscle\n";
  } else {
    const std::uint32_t count = std::uint32_t(mesh.triangles.size());
    file << std::string(stl_header - sizeof count, ' ');
    file.write(reinterpret_cast<const char*>(&count), sizeof count);
    for (const auto& t : mesh.triangles) {
      const Vec3 n = unit_normal(mesh, t);
      float values[12] = {float(n.x), float(n.y), float(n.z)};
      for (int k = 0; k < 9; ++k) values[3 + k] = float(mesh.vertices[t[k / 3]][k % 3]);
      file.write(reinterpret_cast<const char*>(values), sizeof values);
      file.write("\0", 2);  // attribute, unused: the literal's own end is the second byte
    }
  }
  finish(file, path);
}

}  // namespace corpuscle
