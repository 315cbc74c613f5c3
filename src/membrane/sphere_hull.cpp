#include "membrane/sphere_hull.hpp"

#include <fmt/format.h>

#include <cmath>

#include "common/vec3.hpp"
#include "core/error.hpp"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace corpuscle {

TriangleMesh sphere_hull(int vertices) {
  constexpr double golden_angle = 2.39996322972865332;
  TriangleMesh mesh;
  std::vector<coordT> points;
  for (int i = 0; i < vertices; ++i) {
    const double z = 1 - (2 * i + 1.0) / vertices, r = std::sqrt(1 - z * z);
    mesh.vertices.push_back({r * std::cos(golden_angle * i), r * std::sin(golden_angle * i), z});
    points.insert(points.end(), mesh.vertices.back().begin(), mesh.vertices.back().end());
  }
  qhT state;
  qhT* qh = &state;
  qh_zero(qh, stderr);
  char options[] = "qhull Qt";  // Qt: facets of more than three corners are cut into triangles
  const int failed = qh_new_qhull(qh, 3, vertices, points.data(), False, options, nullptr, nullptr);
  if (!failed) {
    facetT* facet;
    FORALLfacets {
      std::array<int, 3> t{};
      int corner = 0;
      vertexT *vertex, **vertexp;
      FOREACHvertex_(facet->vertices) {
        if (corner < 3) t[corner++] = qh_pointid(qh, vertex->point);
      }
      const auto at = [&](int k) {
        const Triple& p = mesh.vertices[t[k]];
        return Vec3{p[0], p[1], p[2]};
      };
      if (dot(at(0), cross(at(1), at(2))) < 0) std::swap(t[1], t[2]);
      mesh.triangles.push_back(t);
    }
  }
  qh_freeqhull(qh, !qh_ALL);
  int short_memory = 0, total = 0;
  qh_memfreeshort(qh, &short_memory, &total);
  if (failed || int(mesh.triangles.size()) != 2 * vertices - 4) {
    throw ComputationError(fmt::format("convex hull of {} points on the sphere: {} triangles instead of {}", vertices,
                                       mesh.triangles.size(), 2 * vertices - 4));
  }
  return mesh;
}

}  // namespace corpuscle
