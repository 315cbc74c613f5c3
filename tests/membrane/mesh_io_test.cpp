#include "membrane/mesh_io.hpp"

#include <catch2/catch.hpp>
#include <cstring>

#include "core/error.hpp"
#include "membrane/mesh_generator.hpp"
#include "temporary_file.hpp"

using namespace corpuscle;
using Catch::Matchers::Contains;

TEST_CASE("OFF keeps every bit") {
  const TriangleMesh mesh = biconcave_mesh(251);
  const TemporaryFile file("cell.off");
  write_off(file.path, mesh);
  const TriangleMesh back = read_mesh(file.path).mesh;
  CHECK(back.vertices == mesh.vertices);
  CHECK(back.triangles == mesh.triangles);
}

TEST_CASE("STL keeps the surface") {
  const TriangleMesh mesh = biconcave_mesh(251);
  const TemporaryFile file("cell.stl");
  const StlFormat format = GENERATE(StlFormat::ascii, StlFormat::binary);
  write_stl(file.path, mesh, format);
  const TriangleMesh back = read_mesh(file.path).mesh;
  CHECK(back.vertices.size() == mesh.vertices.size());
  CHECK(back.triangles.size() == mesh.triangles.size());
  CHECK_NOTHROW(check_closed_surface(back, "stl"));
  // Binary STL rounds to single precision, 6e-8 relative.
  CHECK(volume(back) == Approx(volume(mesh)).epsilon(1e-6));
  CHECK(area(back) == Approx(area(mesh)).epsilon(1e-6));
}

TEST_CASE("OFF with comments and on one line") {
  const TemporaryFile file("t.off");
  file.fill("OFF # made by hand\n4 4 6\n0 0 0\n1 0 0 # x\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const TriangleMesh mesh = read_mesh(file.path).mesh;
  CHECK(volume(mesh) == Approx(1.0 / 6));
}

namespace {

// A tetrahedron, each format's plainest form.
const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n", faces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string facet(const std::string& a, const std::string& b, const std::string& c) {
  return "facet normal 0 0 0\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c + "\nendloop\nendfacet\n";
}
const std::string facet_0 = facet("0 0 0", "0 1 0", "1 0 0"), facet_1 = facet("0 0 0", "1 0 0", "0 0 1"),
                  facet_2 = facet("0 0 0", "0 0 1", "0 1 0"), facet_3 = facet("1 0 0", "0 1 0", "0 0 1");
const std::string all_facets = facet_0 + facet_1 + facet_2 + facet_3;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, from.size(), to);
  return text;
}

std::string upper_case(std::string text) {
  for (char& c : text) c = char(std::toupper(c));
  return text;
}

/// The text must read as the tetrahedron. @returns what the reader has to say about it
std::vector<std::string> read_tetrahedron(const std::string& text) {
  const TemporaryFile file("t.dat");
  file.fill(text);
  const MeshFile read = read_mesh(file.path);
  CHECK(read.mesh.vertices.size() == 4);
  CHECK(read.mesh.triangles.size() == 4);
  CHECK_NOTHROW(check_closed_surface(read.mesh, "t"));
  CHECK(volume(read.mesh) == Approx(1.0 / 6));
  return read.notes;
}

std::string refusal(const std::string& text) {
  const TemporaryFile file("t.dat");
  file.fill(text);
  try {
    read_mesh(file.path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("dialects of OFF are read") {
  const std::string coloured = replaced(vertices, "\n", " 255 0 0 255\n");
  for (const std::string& text : {
           "OFF\n4 4 6\n" + vertices + faces,
           "# made by hand\n\n# twice\nOFF\n4 4 6\n" + vertices + faces,    // comments first
           "OFF 4 4 6\n" + vertices + faces,                                // counts beside the keyword
           "OFF\n4 4\n" + vertices + faces,                                 // no edges
           "OFF\n4\n4\n6\n" + vertices + faces,                             // each count on its line
           "off\n4 4 6\n" + vertices + faces,                               // lower case
           "COFF\n4 4 6\n" + coloured + faces,                              // colours of vertices
           "NOFF\n4 4 6\n" + replaced(vertices, "\n", " 0 0 1\n") + faces,  // normals
           "CNOFF\n4 4 6\n" + replaced(vertices, "\n", " 0 0 1 0.5 0.5 0.5 1\n") + faces,
           "STOFF\n4 4 6\n" + replaced(vertices, "\n", " 0.5 0.5\n") + faces,  // texture coordinates
           "OFF\n4 4 6\n" + coloured + faces,                                  // attributes that are not announced
           "OFF\n4 4 6\n" + vertices + replaced(faces, "\n", " 10 20 30\n"),   // colours of faces
           "\xEF\xBB\xBFOFF\n4 4 6\n" + vertices + faces,                      // byte order mark
           replaced("OFF\n4 4 6\n" + vertices + faces, "\n", "\r\n"),          // line ends of other systems
           replaced("OFF\n4 4 6\n" + vertices + faces, "\n", "\r"),
           "OFF\n4 4 6\n0 0 0 1 0 0\n0 1 0\n0 0 1\n" + faces,  // not a line each
           "OFF\n4 4 6\n" + replaced(vertices, "1", "+1.0e0") + faces,
       }) {
    INFO(text);
    CHECK(read_tetrahedron(text).empty());
  }
}

TEST_CASE("corners that triangles do not share are merged, and what is of no use left out, with a word") {
  std::string corners, triangles;
  int next = 0;
  const char* point[] = {"0 0 0\n", "1 0 0\n", "0 1 0\n", "0 0 1\n"};
  for (const auto& t : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    for (int i : t) corners += point[i];
    triangles += "3 " + std::to_string(next) + " " + std::to_string(next + 1) + " " + std::to_string(next + 2) + "\n";
    next += 3;
  }
  const auto merged = read_tetrahedron("OFF\n12 4 6\n" + corners + triangles);
  REQUIRE(merged.size() == 1);
  CHECK_THAT(merged[0], Contains("of 12 vertices 8 coincided"));
  const auto unused = read_tetrahedron("OFF\n5 4 6\n" + vertices + "7 7 7\n" + faces);
  REQUIRE(unused.size() == 1);
  CHECK_THAT(unused[0], Contains("1 vertices that no triangle uses"));
  const auto collapsed = read_tetrahedron("solid t\n" + all_facets + facet("0 0 0", "0 0 0", "1 0 0") + "endsolid t\n");
  REQUIRE(collapsed.size() == 1);
  CHECK_THAT(collapsed[0], Contains("1 triangles with two corners in one place"));
  // Closed as it stands: two vertices in one place may be two sheets that touch there.
  const TemporaryFile file("touching.off");
  TriangleMesh touching = ellipsoid_mesh({1, 1, 1}, 42);
  touching.vertices[7] = touching.vertices[6];
  write_off(file.path, touching);
  CHECK(read_mesh(file.path).mesh.vertices.size() == 42);
}

TEST_CASE("dialects of STL are read") {
  const std::string plain = "solid t\n" + all_facets + "endsolid t\n";
  for (const std::string& text : {
           plain,
           upper_case(plain),
           replaced(plain, "\n", "\r\n"),
           "solid\n" + all_facets + "endsolid\n",
           "solid a name of facets # and signs\n" + all_facets + "endsolid\n",
           replaced(plain, "end", "end "),  // "end solid", "end facet", "end loop"
           plain + "\n\n  \n",
           replaced(plain, "facet normal 0 0 0\n", "facet\n"),
           "solid top\n" + facet_0 + facet_1 + "endsolid top\nsolid bottom\n" + facet_2 + facet_3 + "endsolid bottom\n",
       }) {
    INFO(text);
    CHECK(read_tetrahedron(text).empty());
  }
}

TEST_CASE("the solids of an STL file are told apart") {
  const TemporaryFile file("t.stl");
  file.fill("solid top\n" + facet_0 + "endsolid\nsolid\n" + facet_1 + facet_2 + facet_3 + "endsolid\n");
  const MeshFile read = read_mesh(file.path);
  CHECK(read.parts == std::vector<std::string>{"'top'", "number 2"});
  CHECK(read.part == std::vector<int>{0, 1, 1, 1});
}

TEST_CASE("binary STL: what stands before and after the triangles does not matter") {
  const TemporaryFile file("cell.stl");
  const TriangleMesh mesh = ellipsoid_mesh({2, 2, 1}, 42);
  write_stl(file.path, mesh, StlFormat::binary);
  std::string content;
  {
    std::ifstream in(file.path, std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(in), {});
  }
  SECTION("a head like that of ASCII files") { content.replace(0, 11, "solid facet"); }
  SECTION("bytes at the end") { content += "of a CAD program"; }
  SECTION("both") {
    content.replace(0, 11, "solid facet");
    content += "xyz";
  }
  SECTION("a coordinate that is not finite") {
    const float nan = NAN;
    std::memcpy(content.data() + 84 + 2 * 50 + 12, &nan, sizeof nan);
    CHECK_THAT(refusal(content), Contains("triangle 2 (at byte 196) is not finite"));
    return;
  }
  file.fill(content);
  const MeshFile read = read_mesh(file.path);
  CHECK(read.mesh.vertices.size() == 42);
  CHECK(volume(read.mesh) == Approx(volume(mesh)).epsilon(1e-6));
  CHECK(read.notes.size() == (content.size() > 84 + 80 * 50 ? 1 : 0));
}

TEST_CASE("damaged mesh files: what is wrong, and in which line") {
  const std::string off = "OFF\n4 4 6\n" + vertices + faces, stl = "solid t\n" + all_facets + "endsolid t\n";
  struct Row {
    std::string text;
    std::vector<std::string> parts;
  };
  for (const Row& row : std::vector<Row>{
           {replaced(off, "0 1 0\n", "0 1\n"), {"line 5", "vertex 2 has 2 numbers"}},
           {replaced(off, "0 1 0\n", "0 1 0 9\n"), {"line 5", "vertex 2 has 4 numbers where the first has 3"}},
           {replaced(off, "0 1 0\n", "0 1,5 0\n"), {"line 5", "'1,5' stands where a coordinate should"}},
           {replaced(off, "0 1 0\n", "0 nan 0\n"), {"line 5", "'nan' stands where a coordinate should"}},
           {replaced(off, "3 0 3 2", "3 0 3 9"), {"line 9", "face 2 names vertex 9, but there are 4"}},
           {replaced(off, "3 0 3 2", "3 0 3 -1"), {"line 9", "face 2 names vertex -1"}},
           {replaced(off, "3 0 3 2", "4 0 3 2 1"), {"line 9", "face 2 has 4 corners", "triangulate"}},
           {replaced(off, "3 0 3 2\n", ""), {"truncated", "line 9"}},
           {off + "3 0 1 2\n", {"line 11", "goes on after the last face"}},
           {"C" + replaced(off, "3 1 2 3\n", ""), {"line 2", "7 lines follow", "4 vertices and 4 faces take 8"}},
           {"OFF BINARY\n4 4 6\n", {"line 1", "binary OFF file", "text"}},
           {"4OFF\n4 4 6\n", {"line 1", "'4OFF'", "three coordinates"}},
           {"OFF\n-4 4 6\n", {"line 2", "claims -4 vertices"}},
           {replaced(stl, "vertex 0 1 0", "vertex 0 1 O"), {"line 5", "'O' stands where a coordinate should"}},
           {replaced(stl, "vertex 0 1 0", "vertx 0 1 0"), {"line 5", "'vertx' stands where 'vertex' should"}},
           {replaced(stl, "endloop", "vertex 1 1 1\nendloop"), {"line 7", "more than three corners", "triangulate"}},
           {replaced(stl, "endsolid t\n", ""), {"truncated", "'facet' or 'endsolid'"}},
           {stl + "v 1 2 3\n", {"line 31", "'v' stands where 'solid' should"}},
       }) {
    INFO(row.text);
    const std::string found = refusal(row.text);
    INFO(found);
    for (const auto& part : row.parts) CHECK_THAT(found, Contains(part));
  }
}

TEST_CASE("truncated and foreign mesh files are refused") {
  const TemporaryFile file("bad");
  const TriangleMesh mesh = ellipsoid_mesh({1, 1, 1}, 42);
  const auto cut = [&](std::size_t bytes) { std::filesystem::resize_file(file.path, std::filesystem::file_size(file.path) - bytes); };
  SECTION("OFF cut short") {
    write_off(file.path, mesh);
    cut(200);
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("truncated"));
  }
  SECTION("ASCII STL cut short") {
    write_stl(file.path, mesh, StlFormat::ascii);
    cut(200);
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("truncated"));
  }
  SECTION("binary STL cut short") {
    write_stl(file.path, mesh, StlFormat::binary);
    cut(20);
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("truncated") && Contains("claims 80 triangles"));
  }
  SECTION("words for numbers") {
    file.fill("OFF\n4 four 6\n");
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("'four' stands where the number of faces should"));
  }
  SECTION("quadrilaterals") {
    file.fill("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("only triangles"));
  }
  SECTION("more than announced") {
    file.fill("OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n3 0 2 1\n");
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("goes on after the last face"));
  }
  SECTION("another format") {
    file.fill("ply\nformat ascii 1.0\n");
    CHECK_THROWS_WITH(read_mesh(file.path), Contains("neither an OFF nor an STL file"));
  }
  SECTION("no file") { CHECK_THROWS_AS(read_mesh(file.path), InputError); }
  SECTION("a folder that does not exist") {
    CHECK_THROWS_WITH(write_off((file.folder / "no" / "cell.off").string(), mesh), Contains("cannot be written"));
  }
}
