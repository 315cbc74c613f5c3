// Surfaces that touch, and their arrays on the host.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "contact/contact.hpp"
#include "coupling/rigid_bodies.hpp"
#include "immersed/surface.hpp"
#include "immersed/surface_geometry.hpp"

namespace corpuscle::testing {

inline TriangleMesh sphere_mesh(double radius, const Triple& center, double edge) {
  BodySettings body;
  body.radius_um = radius;
  body.center_um = center;
  return make_body_mesh(body, edge);
}

/// All of the bodies can move.
inline SurfaceSet cells_of(const std::vector<TriangleMesh>& meshes) {
  SurfaceSet set = make_surface_set(meshes);
  set.cells = set.bodies;
  return set;
}

/// A copy that later changes do not reach, as a mirror on the host would let them.
template <class View>
auto on_host(const View& view) {
  auto copy = Kokkos::create_mirror(view);
  Kokkos::deep_copy(copy, view);
  return copy;
}

/// x = move(body, x) at every vertex.
inline void move_vertices(const SurfaceSet& set, const std::function<Vec3(int, const Vec3&)>& move) {
  const auto x = on_host(set.x);
  const auto body = on_host(set.vertex_body);
  for (int v = 0; v < set.vertices; ++v) store(x, v, move(body(v), load(x, v)));
  Kokkos::deep_copy(set.x, x);
  update_surface_geometry(set);
}

class Noise {
 public:
  /// Uniform in [-1, 1], the same on every platform.
  double operator()() { return 2 * (double(engine_()) / 4294967295.0) - 1; }
  Vec3 vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }

 private:
  std::mt19937 engine_{20260101};
};

inline Components<double> forces_of(Contact& contact, const SurfaceSet& set, double dt, bool ahead) {
  const Components<double> force("corpuscle::test::force", set.vertices, 3);
  contact.add_forces(dt, ahead, force);
  return force;
}

}  // namespace corpuscle::testing
