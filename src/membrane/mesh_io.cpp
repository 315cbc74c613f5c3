#include "membrane/mesh_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numeric>
#include <sstream>
#include <tuple>

#include "common/vec3.hpp"
#include "core/error.hpp"

namespace corpuscle {

namespace {

constexpr std::size_t stl_header = 84, stl_record = 50;  // bytes of a binary STL file

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw InputError(fmt::format("mesh file {}: {}", path, what));
}

std::string slurp(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(path, "cannot be opened; check the path");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Whitespace-separated words of a text file, with comments from # on left out.
class Words {
 public:
  Words(const std::string& path, const std::string& text) : path_(path) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) text_ << line.substr(0, line.find('#')) << '\n';
  }

  std::string word(const char* what) {
    std::string w;
    if (!(text_ >> w)) refuse(path_, fmt::format("truncated: ends where {} should follow", what));
    return w;
  }

  template <class T>
  T number(const char* what) {
    const std::string w = word(what);
    std::istringstream in(w);
    T value;
    if (!(in >> value) || !in.eof()) refuse(path_, fmt::format("'{}' stands where {} should", w, what));
    return value;
  }

  bool end() { return (text_ >> std::ws).eof(); }

  void skip_line() {
    std::string rest;
    std::getline(text_, rest);
  }

 private:
  const std::string& path_;
  std::stringstream text_;
};

TriangleMesh parse_off(const std::string& path, const std::string& text) {
  Words words(path, text);
  words.word("OFF");
  const long vertices = words.number<long>("the number of vertices");
  const long faces = words.number<long>("the number of faces");
  words.number<long>("the number of edges");
  if (vertices < 0 || faces < 0 || vertices > 100000000 || faces > 100000000) {
    refuse(path, fmt::format("claims {} vertices and {} faces", vertices, faces));
  }
  TriangleMesh mesh;
  for (long i = 0; i < vertices; ++i) {
    Triple p;
    for (double& c : p) c = words.number<double>("a coordinate");
    mesh.vertices.push_back(p);
  }
  for (long f = 0; f < faces; ++f) {
    const int corners = words.number<int>("the number of corners of a face");
    if (corners != 3) refuse(path, fmt::format("face {} has {} corners; only triangles are taken", f, corners));
    std::array<int, 3> t;
    for (int& c : t) c = words.number<int>("a vertex number");
    mesh.triangles.push_back(t);
    words.skip_line();  // colours may follow
  }
  if (!words.end()) refuse(path, "goes on after the last face; the counts in its head are wrong");
  return mesh;
}

/// One triangle after another, corners unshared.
using Soup = std::vector<Triple>;

Soup parse_ascii_stl(const std::string& path, const std::string& text) {
  const std::size_t body = text.find('\n');
  Words words(path, body == std::string::npos ? "" : text.substr(body));
  Soup soup;
  for (std::string w = words.word("facet or endsolid"); w != "endsolid"; w = words.word("facet or endsolid")) {
    if (w != "facet") refuse(path, fmt::format("'{}' stands where 'facet' should", w));
    for (int i = 0; i < 4; ++i) words.word("a facet's normal");
    for (int i = 0; i < 2; ++i) words.word("outer loop");
    for (int k = 0; k < 3; ++k) {
      if (const auto v = words.word("vertex"); v != "vertex") {
        refuse(path, fmt::format("'{}' stands where 'vertex' should", v));
      }
      Triple p;
      for (double& c : p) c = words.number<double>("a coordinate");
      soup.push_back(p);
    }
    words.word("endloop");
    words.word("endfacet");
  }
  return soup;
}

Soup parse_binary_stl(const std::string& text) {
  Soup soup;
  for (std::size_t at = stl_header; at < text.size(); at += stl_record) {
    float values[12];
    std::memcpy(values, text.data() + at, sizeof values);
    for (int k = 1; k < 4; ++k) soup.push_back({values[3 * k], values[3 * k + 1], values[3 * k + 2]});
  }
  return soup;
}

/// Give corners that coincide one vertex, numbered in order of first appearance.
TriangleMesh merge(const Soup& soup) {
  const int n = int(soup.size());
  double size = 0;
  for (const Triple& p : soup) {
    for (int d = 0; d < 3; ++d) size = std::max(size, std::abs(p[d] - soup[0][d]));
  }
  const double near = 1e-6 * size;
  std::vector<int> order(n), same(n);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return std::tie(soup[a], a) < std::tie(soup[b], b); });
  for (int k = 0; k < n; ++k) {
    const int i = order[k];
    same[i] = i;
    for (int j = k - 1; j >= 0 && soup[i][0] - soup[order[j]][0] <= near; --j) {
      const Triple& q = soup[order[j]];
      if (std::abs(soup[i][1] - q[1]) <= near && std::abs(soup[i][2] - q[2]) <= near) {
        same[i] = same[order[j]];
        break;
      }
    }
  }
  TriangleMesh mesh;
  std::vector<int> number(n, -1);
  for (int i = 0; i < n; ++i) {
    if (number[same[i]] < 0) {
      number[same[i]] = int(mesh.vertices.size());
      mesh.vertices.push_back(soup[i]);
    }
  }
  for (int i = 0; i + 2 < n; i += 3) {
    mesh.triangles.push_back({number[same[i]], number[same[i + 1]], number[same[i + 2]]});
  }
  return mesh;
}

std::ofstream open_for_writing(const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  if (!file) refuse(path, "cannot be written; check that its folder exists and is writable");
  return file;
}

void finish(std::ofstream& file, const std::string& path) {
  if (!file.flush()) refuse(path, "could not be written whole; check the free space");
}

Vec3 unit_normal(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const auto at = [&](int k) { return Vec3{mesh.vertices[t[k]][0], mesh.vertices[t[k]][1], mesh.vertices[t[k]][2]}; };
  const Vec3 n = cross(at(1) - at(0), at(2) - at(0));
  return n * (1 / std::max(norm(n), 1e-300));
}

}  // namespace

TriangleMesh read_mesh(const std::string& path) {
  const std::string text = slurp(path);
  std::uint32_t claimed = 0;
  if (text.size() >= stl_header) std::memcpy(&claimed, text.data() + stl_header - sizeof claimed, sizeof claimed);
  // The size decides first: many programs begin binary files with the word that marks ASCII ones.
  if (claimed > 0 && text.size() == stl_header + stl_record * claimed) return merge(parse_binary_stl(text));
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  if (start != std::string::npos && text.compare(start, 3, "OFF") == 0) return parse_off(path, text);
  if (start != std::string::npos && text.compare(start, 5, "solid") == 0) return merge(parse_ascii_stl(path, text));
  const bool printable = std::all_of(text.begin(), text.begin() + std::min<std::size_t>(text.size(), 512),
                                     [](unsigned char c) { return c != 0 && (c > 31 || std::isspace(c)); });
  if (!printable && text.size() >= stl_header) {
    refuse(path, fmt::format("neither OFF nor STL, or a truncated binary STL file: its head claims {} triangles, which "
                             "take {} bytes, but it has {}",
                             claimed, stl_header + stl_record * claimed, text.size()));
  }
  refuse(path, "neither an OFF nor an STL file");
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
