#include "membrane/surface_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "membrane/inertia.hpp"
#include "membrane/mesh_io.hpp"
#include "membrane/mesh_repair.hpp"
#include "membrane/self_crossing.hpp"
#include "membrane/shape_measures.hpp"

namespace corpuscle {

namespace {

constexpr double least_cell_um = 1, most_cell_um = 100, usual_cell_um = 8;

std::string text(const Triple& a) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", a[0], a[1], a[2]); }

[[noreturn]] void refuse(const std::string& path, const std::string& what) { throw InputError(fmt::format("surface {}: {}", path, what)); }

/// @throws InputError  for a file with more than one surface, naming the solids or the triangles of the first two
void check_one_piece(const std::string& path, const MeshFile& file) {
  const auto piece = connected_pieces(file.mesh);
  const auto other = std::find(piece.begin(), piece.end(), 1);
  if (other == piece.end()) return;
  const int count = *std::max_element(piece.begin(), piece.end()) + 1;
  const std::size_t t = other - piece.begin();
  std::string what = fmt::format("triangle 0 and triangle {} belong to different ones", t);
  if (file.parts.size() > 1)
    what = fmt::format("solid {} and solid {} are not connected", file.parts[file.part[0]], file.parts[file.part[t]]);
  refuse(path, fmt::format("more than one component: it holds {} separate surfaces ({}); give each a file, and a [[bodies]] "
                           "or [[cells]] entry, of its own",
                           count, what));
}

/// The file's one closed surface, outward and without crossings, in the file's unit.
TriangleMesh read_closed_surface(const std::string& path, FileSurface& result) {
  MeshFile file = read_mesh(path);
  if (file.mesh.triangles.empty()) refuse(path, "it holds no triangles");
  if (!is_open(file.mesh)) check_one_piece(path, file);
  result.notes = file.notes;
  if (file.parts.size() > 1) result.notes.push_back(fmt::format("its {} solids form one surface", file.parts.size()));
  const std::size_t turned = orient_outward(file.mesh);
  if (turned == file.mesh.triangles.size())
    result.notes.emplace_back("its triangles faced inward: all are turned");
  else if (turned > 0)
    result.notes.push_back(fmt::format("{} of its {} triangles faced inward and are turned", turned, file.mesh.triangles.size()));
  check_closed_surface(file.mesh, path);
  if (const auto crossing = find_self_crossing(file.mesh)) {
    const auto &a = file.mesh.triangles[crossing->first], &b = file.mesh.triangles[crossing->second];
    refuse(path, fmt::format("passes through itself: triangles {} (vertices {}, {}, {}) and {} (vertices {}, {}, {}) cross at {} "
                             "in the file's unit; repair the surface there",
                             crossing->first, a[0], a[1], a[2], crossing->second, b[0], b[1], b[2], text(crossing->at)));
  }
  return file.mesh;
}

FileSurface read_scaled(const std::string& path, double scale) {
  FileSurface result;
  result.mesh = read_closed_surface(path, result);
  for (Triple& p : result.mesh.vertices)
    for (double& c : p) c *= scale;
  result.extent_um = extents(result.mesh);
  result.area_um2 = area(result.mesh);
  result.volume_um3 = volume(result.mesh);
  const PrincipalAxes axes = principal_axes(result.mesh);
  result.centroid_um = axes.centroid;
  if (const auto axis = disc_axis(axes)) {
    result.disc = true;
    result.axis = *axis;
    const auto measures = parachute_measures(result.mesh, axes.centroid, *axis);
    result.diameter_um = measures.diameter_um;
    result.thickness_um = measures.length_um;
  }
  return result;
}

void move_to_origin(FileSurface& surface) {
  for (Triple& p : surface.mesh.vertices)
    for (int d = 0; d < 3; ++d) p[d] -= surface.centroid_um[d];
}

/// Whether the centroid lies away from the file's origin by more than an uneven mesh accounts for.
bool off_centre(const FileSurface& s) {
  constexpr double uneven = 0.02;
  return std::hypot(s.centroid_um[0], s.centroid_um[1], s.centroid_um[2]) >
         uneven * *std::max_element(s.extent_um.begin(), s.extent_um.end());
}

void check_cell_size(const CellSettings& cell, const FileSurface& s) {
  const double largest = *std::max_element(s.extent_um.begin(), s.extent_um.end());
  if (largest >= least_cell_um && largest <= most_cell_um) return;
  const double factor = nearest_scale(largest, usual_cell_um), scale = factor * cell.scale;
  const std::string key = constant_key(cell, "scale");
  refuse(cell.mesh, fmt::format("its largest extent is {:.3g} um{}, and a cell's is between {} and {} um; set {} = {:g}{} "
                                "to make it {:.3g} um",
                                largest, cell.scale == 1 ? "" : fmt::format(" with {} = {:g}", key, cell.scale), least_cell_um,
                                most_cell_um, key, scale, unit_of_scale(scale), factor * largest));
}

}  // namespace

double nearest_scale(double extent, double wanted) { return std::pow(10, std::round(std::log10(wanted / extent))); }

const char* unit_of_scale(double scale) {
  struct Unit {
    double um;
    const char* text;
  };
  static constexpr Unit units[] = {{1e6, " (a file in m)"}, {1e4, " (a file in cm)"}, {1e3, " (a file in mm)"}, {1e-3, " (a file in nm)"}};
  for (const Unit& unit : units)
    if (std::abs(scale / unit.um - 1) < 1e-9) return unit.text;
  return "";
}

/// @throws InputError  for a surface with handles, which is no cell's
void check_cell_topology(const CellSettings& cell, FileSurface& s) {
  constexpr int few = 100;
  const int vertices = static_cast<int>(s.mesh.vertices.size()), triangles = static_cast<int>(s.mesh.triangles.size());
  const int handles = (2 - vertices + triangles / 2) / 2;  // Euler: V - E + F = 2 - 2 handles, with three edges for two triangles
  if (handles != 0)
    refuse(cell.mesh, fmt::format("it has {} handle{}, like a ring, and a cell's membrane is a sphere pressed flat, without holes; give "
                                  "a surface without",
                                  handles, handles == 1 ? "" : "s"));
  if (vertices < few)
    s.warnings.push_back(fmt::format("{} vertices are too few for the shape of a cell: the built-in one has 200 at least", vertices));
}

FileSurface read_cell_surface(const CellSettings& cell) {
  FileSurface s = read_scaled(cell.mesh, cell.scale);
  check_cell_size(cell, s);
  check_cell_topology(cell, s);
  const double angle = std::acos(std::clamp(s.axis[2], -1.0, 1.0)) / units::degree;
  constexpr double upright = 1;  // degrees: an uneven mesh's axis is not truer
  if (cell.recenter) {
    move_to_origin(s);
    if (off_centre(s))
      s.notes.push_back(
          fmt::format("the centre of its volume, {} um in the file, goes to center_um ({} = false: the "
                      "file's origin does)",
                      text(s.centroid_um), constant_key(cell, "recenter")));
  } else if (off_centre(s)) {
    s.warnings.push_back(
        fmt::format("center_um is where the file's origin goes, and the centre of its volume lies {} um from it", text(s.centroid_um)));
  }
  if (!s.disc) {
    s.notes.emplace_back("it is not flat in one direction: the file's z is taken as the axis of the cell");
  } else if (angle > upright && cell.align) {
    s.mesh = turn_to_z(s.mesh, s.axis, {});
    s.warnings.push_back(
        fmt::format("it is a disc whose axis {} is {:.0f} degrees from the file's z: turned about the origin so "
                    "that cells.axis is the axis of the disc ({} = false: of the file's z)",
                    text(s.axis), angle, constant_key(cell, "align")));
  } else if (angle > upright) {
    s.warnings.push_back(
        fmt::format("cells.axis is where the file's z goes, and the axis of the disc, {}, is {:.0f} degrees from it", text(s.axis), angle));
  }
  return s;
}

FileSurface read_body_surface(const BodySettings& body) {
  FileSurface s = read_scaled(body.file, body.scale);
  if (body.recenter)
    move_to_origin(s);
  else if (off_centre(s))
    s.notes.push_back(
        fmt::format("the centre of its volume lies {} um from the file's origin, which goes to center_um and which it "
                    "turns about (bodies.recenter = true: the centre of its volume)",
                    text(s.centroid_um)));
  return s;
}

}  // namespace corpuscle
