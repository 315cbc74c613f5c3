#include "grid/node_file.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "grid_fixture.hpp"

#ifdef CORPUSCLE_HDF5
#include <hdf5.h>
#endif

using namespace corpuscle;
using namespace corpuscle::grid_test;

#ifdef CORPUSCLE_HDF5

namespace {

/// A path in the temporary folder, gone at the end of the test.
struct TemporaryFile {
  std::string path;
  explicit TemporaryFile(const std::string& name)
      : path((std::filesystem::temp_directory_path() / ("corpuscle_nodes_" + std::to_string(static_cast<long>(::getpid())) + "_" + name))
                 .string()) {}
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

void write_nodes(const std::string& path, const char* name, const std::vector<hsize_t>& shape, const std::vector<double>& values) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const hid_t set = H5Dcreate2(file, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(set);
  H5Sclose(space);
  H5Fclose(file);
}

std::vector<double> all_nodes(const NodeSource& source) {
  std::vector<double> values;
  for (int k = 0; k <= source.cells[2]; ++k)
    for (int j = 0; j <= source.cells[1]; ++j)
      for (int i = 0; i <= source.cells[0]; ++i)
        for (double x : source.node(i, j, k)) values.push_back(x);
  return values;
}

}  // namespace

TEST_CASE("a node file gives back the nodes that were written", "[grid]") {
  const TemporaryFile file("good.h5");
  const NodeSource source = crumpled_box({5, 4, 6});
  write_nodes(file.path, "nodes", {7, 5, 6, 3}, all_nodes(source));
  GridSettings s;
  s.generator = GridSettings::Generator::file;
  s.file = file.path;
  const NodeSource read = make_node_source(s);
  CHECK(read.cells == source.cells);
  CHECK(all_nodes(read) == all_nodes(source));
}

TEST_CASE("unusable node files are named with the reason", "[grid]") {
  const NodeSource source = crumpled_box({5, 4, 6});
  CHECK_THROWS_AS(read_node_file("/nonexistent/nodes.h5"), InputError);
  CHECK_THROWS_WITH(read_node_file("/nonexistent/nodes.h5"),
                    Catch::Contains("/nonexistent/nodes.h5") && Catch::Contains("cannot be opened"));
  const TemporaryFile text("text.h5");
  std::ofstream(text.path) << "not HDF5\n";
  CHECK_THROWS_WITH(read_node_file(text.path), Catch::Contains("cannot be opened as an HDF5 file"));
  const TemporaryFile other("other.h5");
  write_nodes(other.path, "points", {7, 5, 6, 3}, all_nodes(source));
  CHECK_THROWS_WITH(read_node_file(other.path), Catch::Contains("no data set \"nodes\""));
  const TemporaryFile flat("flat.h5");
  write_nodes(flat.path, "nodes", {210, 3}, all_nodes(source));
  CHECK_THROWS_WITH(read_node_file(flat.path), Catch::Contains("[nk, nj, ni, 3]"));
  const TemporaryFile thin("thin.h5");
  write_nodes(thin.path, "nodes", {7, 10, 3, 3}, all_nodes(source));
  CHECK_THROWS_WITH(read_node_file(thin.path), Catch::Contains("at least 4 nodes"));
  const TemporaryFile cut("cut.h5");
  write_nodes(cut.path, "nodes", {7, 5, 6, 3}, all_nodes(source));
  std::filesystem::resize_file(cut.path, std::filesystem::file_size(cut.path) / 2);
  CHECK_THROWS_AS(read_node_file(cut.path), InputError);
}

#else

TEST_CASE("without HDF5 a node file is refused", "[grid]") {
  CHECK_THROWS_WITH(read_node_file("nodes.h5"), Catch::Contains("has no HDF5"));
}

#endif
