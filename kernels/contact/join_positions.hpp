// Positions of membranes and of rigid bodies, side by side for contact.
#pragma once

#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Rigid bodies of a joined set: which they are, and by how much they are shifted.
struct RigidImages {
  Array<int> body;       // [rigid body of the joined set]
  Table<double> shift;   // [same, 3] um
  Table<int> laps;       // [rigid body, 3] periods by which each has been moved back
  Table<int> laps_then;  // when the set was made: since then a body goes on here without a jump
  Vec3 period[3];        // um; zero along directions that are not periodic
};

/// Positions and velocities of `joined`: first those of the cells, then those of the rigid bodies under their images.
inline void join_positions(const SurfaceSet& cells, const SurfaceSet& rigid, const RigidImages& rigid_images, const SurfaceSet& joined) {
  const SurfaceSet from = cells, of_rigid = rigid, to = joined;
  const RigidImages images = rigid_images;
  Kokkos::parallel_for(
      "corpuscle::contact::join_positions", Policy(0, joined.vertices), KOKKOS_LAMBDA(int v) {
        if (v < from.vertices) {
          store(to.x, v, load(from.x, v));
          store(to.v, v, load(from.v, v));
          return;
        }
        const int body = to.vertex_body(v), image = body - to.cells;
        const int rigid_body = images.body(image), source = of_rigid.first_vertex(rigid_body) + v - to.first_vertex(body);
        Vec3 x = load(of_rigid.x, source);
        for (int d = 0; d < 3; ++d) x[d] += images.shift(image, d);
        for (int d = 0; d < 3; ++d) {
          const int turns = images.laps(rigid_body, d) - images.laps_then(rigid_body, d);
          x += static_cast<double>(turns) * images.period[d];
        }
        store(to.x, v, x);
        store(to.v, v, load(of_rigid.v, source));
      });
}

}  // namespace corpuscle
