#ifdef CORPUSCLE_HDF5

#include "output/cell_writer.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "a series of surfaces of Corpuscle";

}  // namespace

CellWriter::CellWriter(const std::string& folder, const Comm& comm, const std::vector<std::int32_t>& triangles,
                       const std::vector<std::int32_t>& bodies, int vertices, std::optional<double> restart_us, const std::string& name)
    : comm_(comm),
      name_(name),
      vertices_(static_cast<hsize_t>(vertices)),
      triangles_(triangles.size() / 3),
      series_(folder, name, format_name, comm, "mesh", {"triangles", "body"},
              [this](const StoredTime& time, const Hdf5File& file) { return describe(time, file); }) {
  begin(folder, restart_us, [&] { create(triangles, bodies); });
}

CellWriter::CellWriter(const std::string& folder, const Comm& comm, const std::vector<std::int32_t>& triangles,
                       const std::vector<std::int32_t>& bodies, const SurfaceShare& mine, std::optional<double> restart_us)
    : comm_(comm),
      name_("cells"),
      vertices_(mine.vertices),
      triangles_(mine.triangles),
      series_(folder, "cells", format_name, comm, "mesh", {"triangles", "body"},
              [this](const StoredTime& time, const Hdf5File& file) { return describe(time, file); }) {
  begin(folder, restart_us, [&] { create_shared(triangles, bodies, mine); });
}

void CellWriter::begin(const std::string& folder, std::optional<double> restart_us, const std::function<void()>& create) {
  if (restart_us && series_.exists()) {
    on_root(comm_, [&] { require_same_surfaces((std::filesystem::path(folder) / (name_ + ".h5")).string()); });
    series_.resume(*restart_us);
  } else {
    series_.create();
    create();
  }
}

void CellWriter::create_shared(const std::vector<std::int32_t>& triangles, const std::vector<std::int32_t>& bodies,
                               const SurfaceShare& mine) {
  auto file = Hdf5File::create(series_.shared_path(), comm_);
  file.attribute("/", "vertices", static_cast<std::int64_t>(vertices_));
  file.write("triangles", {triangles_, 3}, mine.triangle_rows, triangles.data());
  file.write("body", {triangles_}, mine.triangle_rows, bodies.data());
  file.close();
  series_.finish_shared();
}

void CellWriter::create(const std::vector<std::int32_t>& triangles, const std::vector<std::int32_t>& bodies) {
  on_root(comm_, [&] {
    auto file = Hdf5File::create(series_.shared_path());
    file.attribute("/", "vertices", static_cast<std::int64_t>(vertices_));
    file.write("triangles", {triangles_, 3}, triangles.data());
    file.write("body", {triangles_}, bodies.data());
    file.close();
  });
  series_.finish_shared();
}

void CellWriter::require_same_surfaces(const std::string& path) const {
  stored_times(path, format_name);
  const auto mesh = (std::filesystem::path(path).parent_path() / name_ / "mesh.h5").string();
  const auto file = Hdf5File::read(mesh);
  const auto vertices = static_cast<hsize_t>(file.integer("/", "vertices"));
  if (vertices != vertices_ || file.shape("triangles") != Shape{triangles_, 3})
    throw InputError(
        fmt::format("{}: cannot continue this file, its surfaces have {} vertices and those of this case {}; "
                    "choose another folder with --out",
                    path, vertices, vertices_));
}

void CellWriter::write(double time_us, long step, const double* x, const std::vector<VertexField>& fields) {
  on_root(comm_, [&] {
    auto file = Hdf5File::create(series_.step_path(step));
    file.write("x_um", {vertices_, 3}, x);
    for (const auto& field : fields)
      file.write(field.name, field.components == 1 ? Shape{vertices_} : Shape{vertices_, static_cast<hsize_t>(field.components)},
                 field.values);
    file.attribute("/", "time_us", time_us);
    file.attribute("/", "step", static_cast<std::int64_t>(step));
    file.close();
  });
  series_.finish(step, time_us);
}

void CellWriter::write(double time_us, long step, const SurfaceShare& mine, const double* x, const std::vector<VertexField>& fields,
                       const std::vector<CellTable>& tables) {
  auto file = Hdf5File::create(series_.step_path(step), comm_);
  const auto shape = [](hsize_t rows, int components) {
    return components == 1 ? Shape{rows} : Shape{rows, static_cast<hsize_t>(components)};
  };
  file.write("x_um", {vertices_, 3}, mine.vertex_rows, x);
  for (const auto& field : fields) file.write(field.name, shape(vertices_, field.components), mine.vertex_rows, field.values);
  for (const auto& table : tables) file.write("per_cell/" + table.name, shape(mine.cells, table.components), mine.cell_rows, table.values);
  file.attribute("/", "time_us", time_us);
  file.attribute("/", "step", static_cast<std::int64_t>(step));
  file.close();
  series_.finish(step, time_us);
}

std::string CellWriter::describe(const StoredTime& time, const Hdf5File& file) const {
  const std::string mesh = name_ + "/mesh.h5", own = name_ + "/" + time.group + ".h5";
  auto text = fmt::format("    <Topology TopologyType=\"Triangle\" NumberOfElements=\"{}\">\n     {}\n    </Topology>\n", triangles_,
                          xdmf_item(mesh, "triangles", {triangles_, 3}, "Int", 4));
  text +=
      fmt::format("    <Geometry GeometryType=\"XYZ\">\n     {}\n    </Geometry>\n", xdmf_item(own, "x_um", {vertices_, 3}, "Float", 8));
  for (const auto& name : file.entries("/")) {
    if (name == "x_um" || name == "per_cell") continue;
    const auto shape = file.shape(name);
    text += xdmf_attribute(name, shape.size() == 2 ? 3 : 1, "Node", xdmf_item(own, name, shape, "Float", 8));
  }
  return text + xdmf_attribute("body", 1, "Cell", xdmf_item(mesh, "body", {triangles_}, "Int", 4));
}

}  // namespace corpuscle

#endif
