#include "app/surfaces.hpp"

#include "core/log.hpp"
#include "membrane/surface_file.hpp"

#include <algorithm>
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

std::string shape_text(const CellSettings& c) {
  if (!c.mesh.empty()) return c.mesh;
  switch (c.shape) {
    case CellSettings::Shape::sphere:
      return fmt::format("{} vertices, a sphere of radius {:g} um{}", c.vertices, c.radius_um,
                         c.inflation > 0 ? fmt::format(" inflated by {:g} %", 100 * c.inflation) : "");
    case CellSettings::Shape::ellipsoid:
      return fmt::format("{} vertices, an ellipsoid of semi-axes {:g} x {:g} x {:g} um", c.vertices, c.semi_axes_um[0], c.semi_axes_um[1],
                         c.semi_axes_um[2]);
    default:
      return fmt::format("{} vertices, biconcave, {:g} um wide", c.vertices, c.diameter_um);
  }
}

std::string law_text(const CellSettings& c) {
  switch (c.law) {
    case CellSettings::Law::neo_hookean:
      return "neo-hookean";
    case CellSettings::Law::skalak:
      return fmt::format("skalak, C = {:g}", c.skalak_c);
    default:
      return "wlc-pow";
  }
}

std::string cells_text(long count) { return count == 1 ? "1 cell" : fmt::format("{} cells", count); }

}  // namespace

void print_cell_types(const Case& scene) {
  const auto count = [&](int type) {
    return std::count_if(scene.cells.begin(), scene.cells.end(), [&](const CellSettings& c) { return c.type == type; });
  };
  const auto packed = [&](int type) {
    return std::any_of(scene.populations.begin(), scene.populations.end(), [&](const auto& p) { return p.type == type; });
  };
  for (std::size_t k = 0; k < scene.cell_types.size(); ++k) {
    const auto& [name, cell] = scene.cell_types[k];
    info("cell type \"{}\": {}; {}, shear modulus {:g} uN/m; {}", name, shape_text(cell), law_text(cell), cell.shear_modulus_uN_per_m,
         !packed(int(k))      ? cells_text(count(int(k)))
         : count(int(k)) == 0 ? std::string("cells of populations")
                              : cells_text(count(int(k))) + " beside those of its populations");
  }
  if (!scene.cell_types.empty() && count(-1) > 0) info("cells with keys of their own: {}", count(-1));
}

void print_surfaces(const Case& scene) {
  std::set<std::tuple<std::string, double, bool, bool>> cells, bodies;
  for (std::size_t c = 0; c < scene.cells.size(); ++c) {
    const auto& cell = scene.cells[c];
    if (!cell.mesh.empty() && cells.emplace(cell.mesh, cell.scale, cell.recenter, cell.align).second)
      print_surface(cell.type < 0 ? fmt::format("cells.{}", c) : fmt::format("cell_types.{}", cell.type), cell.mesh,
                    read_cell_surface(cell), true);
  }
  for (const auto& population : scene.populations) {
    const auto& cell = scene.cell_types[population.type].cell;
    if (!cell.mesh.empty() && cells.emplace(cell.mesh, cell.scale, cell.recenter, cell.align).second)
      print_surface(fmt::format("cell_types.{}", cell.type), cell.mesh, read_cell_surface(cell), true);
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const auto& body = scene.bodies[b];
    if (!body.file.empty() && bodies.emplace(body.file, body.scale, body.recenter, false).second)
      print_surface(fmt::format("bodies.{}", b), body.file, read_body_surface(body), false);
  }
}

}  // namespace corpuscle
