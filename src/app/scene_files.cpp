#include "app/scene_files.hpp"

#include "core/fingerprint.hpp"
#include "grid/node_file.hpp"
#include "membrane/mesh_io.hpp"
#include "output/on_root.hpp"

#include <fmt/format.h>

#include <map>

namespace corpuscle {

namespace {

std::uint64_t surface_content(const std::string& path) {
  const auto mesh = read_mesh(path).mesh;
  Fingerprint print;
  for (const auto& vertex : mesh.vertices) print.add(vertex.data(), sizeof vertex);
  for (const auto& triangle : mesh.triangles) print.add(triangle.data(), sizeof triangle);
  return print.value();
}

std::uint64_t grid_content(const std::string& path) {
  const auto nodes = read_node_file(path);
  Fingerprint print;
  print.add(nodes.cells.data(), sizeof nodes.cells);
  for (int k = 0; k <= nodes.cells[2]; ++k)
    for (int j = 0; j <= nodes.cells[1]; ++j)
      for (int i = 0; i <= nodes.cells[0]; ++i) {
        const Triple at = nodes.node(i, j, k);
        print.add(at.data(), sizeof at);
      }
  return print.value();
}

}  // namespace

std::string fingerprint_files(const Comm& comm, const Case& scene) {
  std::string lines;
  on_root(comm, [&] {
    std::map<std::string, std::uint64_t> surfaces;  // many cells may share a file
    const auto list = [&](const std::string& key, const std::string& path, std::uint64_t content) {
      lines += fmt::format("{} = {:016x} \"{}\"\n", key, content, path);
    };
    const auto surface = [&](const std::string& key, const std::string& path) {
      if (path.empty()) return;
      if (!surfaces.count(path)) surfaces[path] = surface_content(path);
      list(key, path, surfaces[path]);
    };
    for (std::size_t c = 0; c < scene.cells.size(); ++c) surface(fmt::format("cells.{}.mesh", c), scene.cells[c].mesh);
    for (std::size_t p = 0; p < scene.populations.size(); ++p)
      surface(fmt::format("populations.{}.mesh", p), scene.cell_types[scene.populations[p].type].cell.mesh);
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) surface(fmt::format("bodies.{}.file", b), scene.bodies[b].file);
    if (scene.grid && !scene.grid->file.empty()) list("grid.file", scene.grid->file, grid_content(scene.grid->file));
  });
  comm.broadcast(lines);
  return lines;
}

}  // namespace corpuscle
