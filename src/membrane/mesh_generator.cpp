#include "membrane/mesh_generator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "membrane/mesh_quality.hpp"
#include "membrane/mesh_relaxation.hpp"
#include "membrane/sphere_hull.hpp"
#include "membrane/surface_shape.hpp"

namespace corpuscle {

namespace {

/// The relaxed mesh must be what was asked for; anything else is a fault of the generator, never passed on.
void check(const TriangleMesh& mesh, const SurfaceShape& shape, int vertices) {
  check_closed_surface(mesh, "made by the mesh generator");
  const MeshQuality q = mesh_quality(mesh);
  const double edge2 = q.edge_mean * q.edge_mean;
  // Chords lie inside the surface: the deficit of area and volume is of order edge^2 (4.4 % of the volume for a cell of
  // 200 vertices, where edge^2 is 0.6 % of the area); a folded mesh is off by tens of per cent.
  const double allowed = 0.005 + 12 * edge2 / shape.area();
  const bool good = int(mesh.vertices.size()) == vertices && int(mesh.triangles.size()) == 2 * vertices - 4 &&
                    std::abs(area(mesh) / shape.area() - 1) < allowed && std::abs(volume(mesh) / shape.volume() - 1) < allowed &&
                    q.valence_min >= 4 && q.valence_max <= 8;
  if (!good) {
    throw ComputationError(fmt::format(
        "mesh generator: {} vertices, {} triangles, area {:.4g} of {:.4g} um2, volume {:.4g} of {:.4g} um3, valence {} "
        "to {}; ask for a slightly different number of vertices",
        mesh.vertices.size(), mesh.triangles.size(), area(mesh), shape.area(), volume(mesh), shape.volume(), q.valence_min, q.valence_max));
  }
}

TriangleMesh generate(const SurfaceShape& shape, int vertices) {
  TriangleMesh mesh = sphere_hull(vertices);
  for (Triple& p : mesh.vertices) {
    const Vec3 x = shape.from_sphere({p[0], p[1], p[2]});
    p = {x.x, x.y, x.z};
  }
  relax_mesh(mesh, shape);
  check(mesh, shape, vertices);
  return mesh;
}

}  // namespace

TriangleMesh biconcave_mesh(int vertices) {
  if (vertices < 200 || vertices > 30000) {
    throw InputError(
        fmt::format("vertices = {}: a red blood cell takes 200 to 30000; the dimple is not resolved below, "
                    "a spectrin network has about 27000",
                    vertices));
  }
  return generate(BiconcaveShape(), vertices);
}

TriangleMesh ellipsoid_mesh(const Triple& semi_axes, int vertices) {
  const auto [low, high] = std::minmax_element(semi_axes.begin(), semi_axes.end());
  if (!(*low > 0) || !std::isfinite(*high) || *high > 10 * *low) {
    throw InputError(
        fmt::format("semi_axes_um = [{}, {}, {}]: each must be positive, and the largest at most ten times "
                    "the smallest; give other shapes as an OFF or STL file",
                    semi_axes[0], semi_axes[1], semi_axes[2]));
  }
  if (vertices < 42 || vertices > 100000) {
    throw InputError(fmt::format("vertices = {}: an ellipsoid takes 42 to 100000", vertices));
  }
  return generate(EllipsoidShape(semi_axes), vertices);
}

}  // namespace corpuscle
