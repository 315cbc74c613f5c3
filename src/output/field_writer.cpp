#ifdef CORPUSCLE_HDF5

#include "output/field_writer.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "a series of fields of Corpuscle";

// HDF5's order: slowest index first.
Shape reversed(const int (&n)[3], int more) {
  return {static_cast<hsize_t>(n[2] + more), static_cast<hsize_t>(n[1] + more), static_cast<hsize_t>(n[0] + more)};
}

Shape with(Shape shape, hsize_t components) {
  shape.push_back(components);
  return shape;
}

}  // namespace

FieldWriter::FieldWriter(const std::string& folder, const Comm& comm, const IndexSpace& index, const double* nodes,
                         std::optional<double> restart_us)
    : comm_(comm),
      index_(index),
      series_(folder, "fields", format_name, comm, "grid", {"nodes_um"},
              [this](const StoredTime& time, const Hdf5File& file) { return describe(time, file); }) {
  if (restart_us && series_.exists()) {
    on_root(comm_, [&] { require_same_grid((std::filesystem::path(folder) / "fields.h5").string()); });
    series_.resume(*restart_us);
  } else {
    series_.create();
    create(nodes);
  }
}

Shape FieldWriter::global_cells() const { return reversed(index_.global, 0); }

void FieldWriter::create(const double* nodes) {
  auto file = Hdf5File::create(series_.shared_path(), comm_);
  // A node shared by two blocks is written by the one that it begins.
  Slab mine{with(reversed(index_.first, 0), 0), with(reversed(index_.n, 0), 3)};
  for (int d = 0; d < 3; ++d)
    if (index_.first[d] + index_.n[d] == index_.global[d]) mine.count[2 - d] += 1;
  file.write("nodes_um", with(reversed(index_.global, 1), 3), mine, nodes, with(reversed(index_.n, 1), 3));
  file.close();
  series_.finish_shared();
}

void FieldWriter::require_same_grid(const std::string& path) const {
  stored_times(path, format_name);
  const auto expected = with(reversed(index_.global, 1), 3);
  const auto found = Hdf5File::read(path).shape("nodes_um");
  if (found != expected)
    throw InputError(
        fmt::format("{}: cannot continue this file, its grid has {} nodes and this case {}; choose another "
                    "folder with --out",
                    path, fmt::join(found, " x "), fmt::join(expected, " x ")));
}

void FieldWriter::write(double time_us, long step, const std::vector<CellField>& fields, const std::vector<CellLabels>& labels) {
  const Slab mine{reversed(index_.first, 0), reversed(index_.n, 0)};
  auto file = Hdf5File::create(series_.step_path(step), comm_);
  for (const auto& field : fields) {
    if (field.components == 1) {
      file.write(field.name, global_cells(), mine, field.values);
    } else {
      const hsize_t c = static_cast<hsize_t>(field.components);
      file.write(field.name, with(global_cells(), c), Slab{with(mine.offset, 0), with(mine.count, c)}, field.values);
    }
  }
  for (const auto& label : labels) file.write(label.name, global_cells(), mine, label.values);
  file.attribute("/", "time_us", time_us);
  file.attribute("/", "step", static_cast<std::int64_t>(step));
  file.close();
  series_.finish(step, time_us);
}

std::string FieldWriter::describe(const StoredTime& time, const Hdf5File& file) const {
  const auto nodes = reversed(index_.global, 1);
  auto text = fmt::format(
      "    <Topology TopologyType=\"3DSMesh\" Dimensions=\"{}\"/>\n    <Geometry GeometryType=\"XYZ\">\n     {}\n"
      "    </Geometry>\n",
      fmt::join(nodes, " "), xdmf_item("fields/grid.h5", "nodes_um", with(nodes, 3), "Float", 8));
  for (const auto& name : file.entries("/")) {
    const auto shape = file.shape(name);
    const bool label = file.is_integer(name);
    text += xdmf_attribute(name, shape.size() == 4 ? 3 : 1, "Cell",
                           xdmf_item("fields/" + time.group + ".h5", name, shape, label ? "Char" : "Float", label ? 1 : 8));
  }
  return text;
}

}  // namespace corpuscle

#endif
