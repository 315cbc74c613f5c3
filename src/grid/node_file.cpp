#include "grid/node_file.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#ifdef CORPUSCLE_HDF5
#include <hdf5.h>
#endif

namespace corpuscle {

#ifdef CORPUSCLE_HDF5

namespace {

constexpr hsize_t most_nodes = 100000;  // a direction, as for grid.nodes

/// Closes an HDF5 handle when it goes out of scope.
struct Handle {
  hid_t id;
  herr_t (*close)(hid_t);
  ~Handle() {
    if (id >= 0) close(id);
  }
};

/// The data set "nodes" of a file.
struct NodeSet {
  Handle file, set;
  int ni = 0, nj = 0, nk = 0;
  explicit NodeSet(const std::string& path);
};

NodeSet::NodeSet(const std::string& path)
    : file{H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose},
      set{file.id < 0 ? -1 : H5Dopen2(file.id, "nodes", H5P_DEFAULT), H5Dclose} {
  if (file.id < 0) throw InputError(fmt::format("grid.file = \"{}\": cannot be opened as an HDF5 file", path));
  if (set.id < 0) throw InputError(fmt::format("grid.file = \"{}\": has no data set \"nodes\", [nk, nj, ni, 3], x, y, z in um", path));
  const Handle space{H5Dget_space(set.id), H5Sclose};
  hsize_t n[4] = {0, 0, 0, 0};
  if (H5Sget_simple_extent_ndims(space.id) != 4 || H5Sget_simple_extent_dims(space.id, n, nullptr) != 4 || n[3] != 3 || n[0] < 4 ||
      n[1] < 4 || n[2] < 4)
    throw InputError(
        fmt::format("grid.file = \"{}\": data set \"nodes\" must have the shape [nk, nj, ni, 3] with at least 4 nodes a direction", path));
  if (std::max({n[0], n[1], n[2]}) > most_nodes)
    throw InputError(
        fmt::format("grid.file = \"{}\": {} x {} x {} nodes; at most {} a direction are allowed", path, n[2], n[1], n[0], most_nodes));
  ni = static_cast<int>(n[2]), nj = static_cast<int>(n[1]), nk = static_cast<int>(n[0]);
}

}  // namespace

std::array<int, 3> cells_of_node_file(const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const NodeSet found(path);
  return {found.ni - 1, found.nj - 1, found.nk - 1};
}

NodeSource read_node_file(const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const NodeSet found(path);
  const int ni = found.ni, nj = found.nj, nk = found.nk;
  const auto& set = found.set;
  auto nodes = std::make_shared<std::vector<double>>(3 * static_cast<std::size_t>(ni) * nj * nk);
  if (H5Dread(set.id, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, nodes->data()) < 0)
    throw InputError(fmt::format("grid.file = \"{}\": data set \"nodes\" cannot be read; is the file complete?", path));
  return {{ni - 1, nj - 1, nk - 1}, [nodes, ni, nj](int i, int j, int k) {
            const double* x = nodes->data() + 3 * (i + static_cast<std::size_t>(ni) * (j + static_cast<std::size_t>(nj) * k));
            return Triple{x[0], x[1], x[2]};
          }};
}

#else

NodeSource read_node_file(const std::string& path) {
  throw InputError(fmt::format("grid.file = \"{}\": this build has no HDF5; configure with -DCORPUSCLE_HDF5=ON", path));
}

std::array<int, 3> cells_of_node_file(const std::string& path) { return read_node_file(path).cells; }

#endif

}  // namespace corpuscle
