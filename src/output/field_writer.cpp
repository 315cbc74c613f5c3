#ifdef CORPUSCLE_HDF5

#include "output/field_writer.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"
#include "output/report.hpp"

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
    : path_((std::filesystem::path(folder) / "fields.h5").string()),
      xdmf_path_((std::filesystem::path(folder) / "fields.xdmf").string()),
      comm_(comm),
      index_(index) {
  if (restart_us && std::filesystem::exists(path_)) {
    resume(*restart_us);
  } else {
    comm_.barrier();  // every rank has looked before the file appears
    create(nodes);
  }
}

Shape FieldWriter::global_cells() const { return reversed(index_.global, 0); }

void FieldWriter::create(const double* nodes) {
  auto file = Hdf5File::create(path_, comm_);
  file.attribute("/", "format", format_name);
  file.attribute("/", "git", git_hash());
  // A node shared by two blocks is written by the one that it begins.
  Slab mine{with(reversed(index_.first, 0), 0), with(reversed(index_.n, 0), 3)};
  for (int d = 0; d < 3; ++d)
    if (index_.first[d] + index_.n[d] == index_.global[d]) mine.count[2 - d] += 1;
  file.write("nodes_um", with(reversed(index_.global, 1), 3), mine, nodes, with(reversed(index_.n, 1), 3));
  file.close();
}

void FieldWriter::resume(double restart_us) {
  times_ = stored_times(path_, format_name);
  const auto expected = with(reversed(index_.global, 1), 3);
  const auto found = Hdf5File::read(path_).shape("nodes_um");
  if (found != expected)
    throw InputError(
        fmt::format("{}: cannot continue this file, its grid has {} nodes and this case {}; choose another "
                    "folder with --out",
                    path_, fmt::join(found, " x "), fmt::join(expected, " x ")));
  comm_.barrier();  // every rank has read the old times before any is removed
  auto file = Hdf5File::extend(path_, comm_);
  remove_later(file, times_, restart_us);
  file.close();
}

void FieldWriter::write(double time_us, long step, const std::vector<CellField>& fields,
                        const std::vector<CellLabels>& labels) {
  const auto group = step_group(step);
  const Slab mine{reversed(index_.first, 0), reversed(index_.n, 0)};
  auto file = Hdf5File::extend(path_, comm_);
  remove_step(file, times_, group);
  for (const auto& field : fields) {
    const auto name = group + "/" + field.name;
    if (field.components == 1) {
      file.write(name, global_cells(), mine, field.values);
    } else {
      const hsize_t c = static_cast<hsize_t>(field.components);
      file.write(name, with(global_cells(), c), Slab{with(mine.offset, 0), with(mine.count, c)}, field.values);
    }
  }
  for (const auto& label : labels) file.write(group + "/" + label.name, global_cells(), mine, label.values);
  file.attribute(group, "time_us", time_us);
  file.attribute(group, "step", static_cast<std::int64_t>(step));
  file.close();
  times_.push_back({group, time_us});
  on_root(comm_, [&] { rewrite_xdmf(); });
}

void FieldWriter::rewrite_xdmf() const {
  const auto file = Hdf5File::read(path_);
  const auto nodes = reversed(index_.global, 1);
  const auto geometry = fmt::format(
      "    <Topology TopologyType=\"3DSMesh\" Dimensions=\"{}\"/>\n    <Geometry GeometryType=\"XYZ\">\n     {}\n"
      "    </Geometry>\n",
      fmt::join(nodes, " "), xdmf_item("fields.h5", "nodes_um", with(nodes, 3), "Float", 8));
  write_xdmf(xdmf_path_, "fields", times_, [&](const StoredTime& time) {
    auto text = geometry;
    for (const auto& name : file.entries(time.group)) {
      const auto set = time.group + "/" + name;
      const auto shape = file.shape(set);
      const bool label = file.is_integer(set);
      text += xdmf_attribute(name, shape.size() == 4 ? 3 : 1, "Cell",
                             xdmf_item("fields.h5", set, shape, label ? "Char" : "Float", label ? 1 : 8));
    }
    return text;
  });
}

}  // namespace corpuscle

#endif
