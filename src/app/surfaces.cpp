#include "app/surfaces.hpp"

#include "core/log.hpp"
#include "membrane/surface_file.hpp"

#include <set>
#include <tuple>

namespace corpuscle {

namespace {

void print_surface(const std::string& name, const std::string& path, const FileSurface& s, bool cell) {
  std::string shape;
  if (s.disc)
    shape = fmt::format("; a disc of {:.4g} x {:.4g} um with the axis ({:.3g}, {:.3g}, {:.3g})", s.diameter_um, s.thickness_um, s.axis[0],
                        s.axis[1], s.axis[2]);
  else if (cell)
    shape = "; no axis of its own";
  info("{}: {}: {} vertices, {} triangles; extents {:.4g} x {:.4g} x {:.4g} um along the file's axes, area {:.4g} um2, volume {:.4g} um3{}",
       name, path, s.mesh.vertices.size(), s.mesh.triangles.size(), s.extent_um[0], s.extent_um[1], s.extent_um[2], s.area_um2,
       s.volume_um3, shape);
  for (const auto& note : s.notes) info("{}: {}", name, note);
  for (const auto& warning : s.warnings) warn("{}: {}", name, warning);
}

}  // namespace

void print_surfaces(const Case& scene) {
  std::set<std::tuple<std::string, double, bool, bool>> cells, bodies;
  for (std::size_t c = 0; c < scene.cells.size(); ++c) {
    const auto& cell = scene.cells[c];
    if (!cell.mesh.empty() && cells.emplace(cell.mesh, cell.scale, cell.recenter, cell.align).second)
      print_surface(fmt::format("cells.{}", c), cell.mesh, read_cell_surface(cell), true);
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto& body = scene.bodies[b];
    if (!body.file.empty() && bodies.emplace(body.file, body.scale, body.recenter, false).second)
      print_surface(fmt::format("bodies.{}", b), body.file, read_body_surface(body), false);
  }
}

}  // namespace corpuscle
