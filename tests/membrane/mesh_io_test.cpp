#include "membrane/mesh_io.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "membrane/mesh_generator.hpp"

using namespace corpuscle;
using Catch::Matchers::Contains;

namespace {

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

}  // namespace

TEST_CASE("OFF keeps every bit") {
  const TriangleMesh mesh = biconcave_mesh(251);
  const TemporaryFile file("cell.off");
  write_off(file.path, mesh);
  const TriangleMesh back = read_mesh(file.path);
  CHECK(back.vertices == mesh.vertices);
  CHECK(back.triangles == mesh.triangles);
}

TEST_CASE("STL keeps the surface") {
  const TriangleMesh mesh = biconcave_mesh(251);
  const TemporaryFile file("cell.stl");
  const StlFormat format = GENERATE(StlFormat::ascii, StlFormat::binary);
  write_stl(file.path, mesh, format);
  const TriangleMesh back = read_mesh(file.path);
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
  const TriangleMesh mesh = read_mesh(file.path);
  CHECK(volume(mesh) == Approx(1.0 / 6));
}

TEST_CASE("truncated and foreign mesh files are refused") {
  const TemporaryFile file("bad");
  const TriangleMesh mesh = ellipsoid_mesh({1, 1, 1}, 42);
  const auto cut = [&](std::size_t bytes) {
    std::filesystem::resize_file(file.path, std::filesystem::file_size(file.path) - bytes);
  };
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
