#include <fmt/format.h>

#include "membrane/mesh_readers.hpp"
#include "membrane/mesh_text.hpp"

namespace corpuscle {

namespace {

constexpr long most = 100000000;  // vertices or faces

/// The word that begins an OFF file, "OFF" with letters before it for what a vertex has beside its coordinates: ST
/// texture coordinates, C a colour, N a normal. @returns whether there are any
bool read_keyword(MeshText& text) {
  const std::string_view word = text.word("OFF");
  const std::string before = std::string(word.substr(0, word.size() - 3));
  if (before.find('4') != std::string::npos || (word[0] == 'n' && word.substr(word.size() - 3) == "OFF"))
    text.fail(fmt::format("'{}' announces vertices that do not have three coordinates", word));
  if (text.peek() == "binary") text.fail("a binary OFF file; save it as text (ASCII)");
  return !before.empty();
}

/// Three coordinates; what follows them on the line of a vertex (`columns` words in all, 0: not known yet) is left out.
Triple read_vertex(MeshText& text, bool by_lines, long number, int& columns) {
  if (by_lines) {
    const int here = text.words_left_in_line();
    if (columns == 0) columns = here;
    if (here < 3 || here != columns) {
      text.word("a coordinate");
      text.fail(fmt::format("vertex {} has {} numbers{}", number, here,
                            here < 3 ? "; it needs three coordinates" : fmt::format(" where the first has {}", columns)));
    }
  }
  Triple p;
  for (double& c : p) c = text.number("a coordinate");
  if (by_lines) text.rest_of_line();
  return p;
}

std::array<int, 3> read_face(MeshText& text, long number, long vertices) {
  const long corners = text.integer("the number of corners of a face");
  if (corners != 3) text.fail(fmt::format("face {} has {} corners; only triangles are taken: triangulate the surface", number, corners));
  std::array<int, 3> t;
  for (int& c : t) {
    const long vertex = text.integer("a vertex number");
    if (vertex < 0 || vertex >= vertices)
      text.fail(fmt::format("face {} names vertex {}, but there are {}, counted from 0", number, vertex, vertices));
    c = int(vertex);
  }
  text.rest_of_line();  // colours may follow
  return t;
}

}  // namespace

MeshFile read_off(const std::string& path, const std::string& content) {
  MeshText text(path, content, '#');
  const bool attributes = read_keyword(text);
  const long vertices = text.integer("the number of vertices"), faces = text.integer("the number of faces");
  if (vertices < 0 || faces < 0 || vertices > most || faces > most)
    text.fail(fmt::format("claims {} vertices and {} faces", vertices, faces));
  // Some programs leave out the number of edges, which nothing needs.
  if (text.same_line() || text.words_left_in_line() == 1) text.integer("the number of edges");

  // One line for each vertex and face is what files look like. It tells what belongs to a vertex beside its coordinates.
  const bool by_lines = !text.same_line() && text.lines_left() == vertices + faces;
  if (attributes && !by_lines)
    text.fail(fmt::format("{} lines follow, but {} vertices and {} faces take {}: truncated, or the counts are wrong", text.lines_left(),
                          vertices, faces, vertices + faces));
  MeshFile file;
  int columns = 0;
  for (long i = 0; i < vertices; ++i) file.mesh.vertices.push_back(read_vertex(text, by_lines, i, columns));
  for (long f = 0; f < faces; ++f) file.mesh.triangles.push_back(read_face(text, f, vertices));
  if (!text.end()) text.word("the end"), text.fail("goes on after the last face; the counts in its head are wrong");
  return file;
}

}  // namespace corpuscle
