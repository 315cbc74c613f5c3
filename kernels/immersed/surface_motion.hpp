// Motion of the surfaces as the fluid needs it: growth of the bodies, velocities inside them, prediction, rigid motion.
#pragma once

#include "common/sums.hpp"
#include "immersed/surface_geometry.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// growth [body] = rate of change of the enclosed volume, um3/us: for flat triangles whose velocity is linear between
/// the corners, the mean corner velocity times the area vector, exactly. mean [body, 3] = mean velocity of the surface.
inline void body_growth(const SurfaceSet& set, const Array<double>& growth, const Table<double>& mean) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const SurfaceSet s = set;
  const auto v = set.v;
  const auto first = set.first_triangle;
  Kokkos::parallel_for(
      "corpuscle::immersed::body_growth", Team(set.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const typename Team::member_type& team) {
        const int body = team.league_rank();
        Sums<5> total;  // growth; area; area times velocity
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first(body), first(body + 1)),
            [&](int t, Sums<5>& sum) {
              const Vec3 velocity = (1.0 / 3) * (load(v, s.triangle(t, 0)) + load(v, s.triangle(t, 1)) + load(v, s.triangle(t, 2)));
              const Vec3 vector = area_vector(s, t);
              const double area = norm(vector);
              sum[0] += dot(velocity, vector);
              sum[1] += area;
              for (int d = 0; d < 3; ++d) sum[2 + d] += area * velocity[d];
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          growth(body) = total[0];
          for (int d = 0; d < 3; ++d) mean(body, d) = total[2 + d] / total[1];
        });
      });
}

/// Velocity at blanked nodes: that of the closest triangle within the search band, the body's mean deeper inside. It serves
/// as history when the surface moves on and the node comes out, and in means over the whole volume.
inline void fill_inside_velocity(const IndexSpace& index, const SurfaceSet& set, const BandViews& band, const NodeViews& nodes,
                                 const Table<double>& mean, const Components<double>& u) {
  const auto kind = nodes.kind;
  const auto body = nodes.body;
  const auto key = band.key;
  const SurfaceSet s = set;
  const auto v = set.v;
  const int triangles = set.triangles;
  for_owned(
      "corpuscle::immersed::inside_velocity", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::inside) return;
        const int b = body(c);
        Vec3 velocity{mean(b, 0), mean(b, 1), mean(b, 2)};
        if (key(c) != no_key) {
          const int t = static_cast<int>(key_item(key(c)) % static_cast<unsigned>(triangles));
          velocity = (1.0 / 3) * (load(v, s.triangle(t, 0)) + load(v, s.triangle(t, 1)) + load(v, s.triangle(t, 2)));
        }
        store(u, c, velocity);
      });
}

/// Rigid motion of vertices first <= i < last: x = centre + R (reference - origin), v = velocity + omega x (x - centre).
struct RigidMotion {
  Vec3 origin, centre, velocity, omega;
  double rotation[3][3];
};

inline void move_rigid_body(const SurfaceSet& set, int first, int last, const Components<double>& reference, const RigidMotion& motion) {
  const auto x = set.x, v = set.v;
  Kokkos::parallel_for(
      "corpuscle::immersed::rigid_motion", Policy(first, last), KOKKOS_LAMBDA(int i) {
        const Vec3 r = load(reference, i) - motion.origin;
        Vec3 arm;
        for (int m = 0; m < 3; ++m) arm[m] = motion.rotation[m][0] * r.x + motion.rotation[m][1] * r.y + motion.rotation[m][2] * r.z;
        store(x, i, motion.centre + arm);
        store(v, i, motion.velocity + cross(motion.omega, arm));
      });
}

/// x += dt v for vertices below `count`.
inline void predict_positions(const SurfaceSet& set, int count, double dt) {
  const auto x = set.x, v = set.v;
  Kokkos::parallel_for(
      "corpuscle::coupling::predict", Policy(0, count), KOKKOS_LAMBDA(int i) { store(x, i, load(x, i) + dt * load(v, i)); });
}

}  // namespace corpuscle
