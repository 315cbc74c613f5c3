#ifdef CORPUSCLE_HDF5

#include "output/cell_writer.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"
#include "output/report.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "a series of surfaces of Corpuscle";

}  // namespace

CellWriter::CellWriter(const std::string& folder, const Comm& comm, const std::vector<std::int32_t>& triangles,
                       const std::vector<std::int32_t>& bodies, int vertices, std::optional<double> restart_us)
    : path_((std::filesystem::path(folder) / "cells.h5").string()),
      xdmf_path_((std::filesystem::path(folder) / "cells.xdmf").string()),
      comm_(comm),
      vertices_(static_cast<hsize_t>(vertices)),
      triangles_(triangles.size() / 3) {
  on_root(comm_, [&] {
    if (restart_us && std::filesystem::exists(path_))
      resume(*restart_us);
    else
      create(triangles, bodies);
  });
}

void CellWriter::create(const std::vector<std::int32_t>& triangles, const std::vector<std::int32_t>& bodies) const {
  auto file = Hdf5File::create(path_);
  file.attribute("/", "format", format_name);
  file.attribute("/", "git", git_hash());
  file.attribute("/", "vertices", static_cast<std::int64_t>(vertices_));
  file.write("triangles", {triangles_, 3}, triangles.data());
  file.write("body", {triangles_}, bodies.data());
  file.close();
}

void CellWriter::resume(double restart_us) {
  times_ = stored_times(path_, format_name);
  {
    const auto file = Hdf5File::read(path_);
    const auto vertices = static_cast<hsize_t>(file.integer("/", "vertices"));
    if (vertices != vertices_ || file.shape("triangles") != Shape{triangles_, 3})
      throw InputError(
          fmt::format("{}: cannot continue this file, its surfaces have {} vertices and those of this case {}; "
                      "choose another folder with --out",
                      path_, vertices, vertices_));
  }
  auto file = Hdf5File::extend(path_);
  remove_later(file, times_, restart_us);
  file.close();
}

void CellWriter::write(double time_us, long step, const double* x, const std::vector<VertexField>& fields) {
  on_root(comm_, [&] {
    store(time_us, step, x, fields);
    rewrite_xdmf();
  });
}

void CellWriter::store(double time_us, long step, const double* x, const std::vector<VertexField>& fields) {
  const auto group = step_group(step);
  auto file = Hdf5File::extend(path_);
  remove_step(file, times_, group);
  file.write(group + "/x_um", {vertices_, 3}, x);
  for (const auto& field : fields)
    file.write(group + "/" + field.name,
               field.components == 1 ? Shape{vertices_} : Shape{vertices_, static_cast<hsize_t>(field.components)},
               field.values);
  file.attribute(group, "time_us", time_us);
  file.attribute(group, "step", static_cast<std::int64_t>(step));
  file.close();
  times_.push_back({group, time_us});
}

void CellWriter::rewrite_xdmf() const {
  const auto file = Hdf5File::read(path_);
  const auto topology =
      fmt::format("    <Topology TopologyType=\"Triangle\" NumberOfElements=\"{}\">\n     {}\n    </Topology>\n",
                  triangles_, xdmf_item("cells.h5", "triangles", {triangles_, 3}, "Int", 4));
  const auto body = xdmf_attribute("body", 1, "Cell", xdmf_item("cells.h5", "body", {triangles_}, "Int", 4));
  write_xdmf(xdmf_path_, "cells", times_, [&](const StoredTime& time) {
    auto text = topology + fmt::format("    <Geometry GeometryType=\"XYZ\">\n     {}\n    </Geometry>\n",
                                       xdmf_item("cells.h5", time.group + "/x_um", {vertices_, 3}, "Float", 8));
    for (const auto& name : file.entries(time.group)) {
      if (name == "x_um") continue;
      const auto set = time.group + "/" + name;
      const auto shape = file.shape(set);
      text += xdmf_attribute(name, shape.size() == 2 ? 3 : 1, "Node", xdmf_item("cells.h5", set, shape, "Float", 8));
    }
    return text + body;
  });
}

}  // namespace corpuscle

#endif
