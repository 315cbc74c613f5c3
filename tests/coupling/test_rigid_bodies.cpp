// Rigid motion, and what the fluid is told of moving surfaces.
#include <catch2/catch.hpp>

#include "coupling/rigid_bodies.hpp"
#include "immersed/surface_motion.hpp"
#include "immersed/surface_work.hpp"

namespace corpuscle {
namespace {

std::vector<Vec3> rows(const Components<double>& view) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  std::vector<Vec3> all;
  for (int e = 0; e < static_cast<int>(view.extent(0)); ++e) all.push_back(load(host, e));
  return all;
}

/// v = field(x) at every vertex.
template <class Field>
void set_velocity(const SurfaceSet& surface, const Field& field) {
  const auto x = surface.x, v = surface.v;
  Kokkos::parallel_for(
      "corpuscle::test::velocity", Policy(0, surface.vertices), KOKKOS_LAMBDA(int i) { store(v, i, field(load(x, i))); });
}

BodySettings ellipsoid(const Triple& semi_axes, const Triple& centre) {
  BodySettings body;
  body.shape = BodySettings::Shape::ellipsoid;
  body.semi_axes_um = semi_axes;
  body.center_um = centre;
  body.vertices = 300;
  return body;
}

}  // namespace

TEST_CASE("a rigid body keeps its shape and moves at the velocity it tells the fluid", "[coupling]") {
  BodySettings first = ellipsoid({2, 1.2, 0.7}, {0.3, -0.2, 0.1}), second = ellipsoid({0.5, 1.5, 1}, {7, 1, -2});
  first.velocity_um_per_us = {0.2, -0.1, 0.4};
  first.angular_velocity_rad_per_us = {0.3, -0.5, 0.4};
  second.angular_velocity_rad_per_us = {0, 0.9, 0.2};
  const SurfaceSet surface = make_surface_set({make_body_mesh(first, 0.5), make_body_mesh(second, 0.5)});
  RigidBodies bodies({first, second}, surface, 0);
  const auto start = rows(surface.x);
  const double time = 1.7, dt = 1e-3;
  const auto at = [&](double t) {
    bodies.move_to(t);
    return rows(surface.x);
  };
  const auto before = at(time - dt), after = at(time + dt), x = at(time), v = rows(surface.v);
  double fastest = 0;
  for (int i = 0; i < surface.vertices; ++i) {
    // The difference leaves (omega dt)^2 / 6 = 1e-7 of a speed of up to 1.5.
    REQUIRE(norm(v[i] - (0.5 / dt) * (after[i] - before[i])) < 3e-7);
    fastest = std::max(fastest, norm(v[i]));
  }
  for (int i = 1; i < 300; i += 7)
    for (int j = 0; j < i; j += 13) REQUIRE(norm(x[i] - x[j]) == Approx(norm(start[i] - start[j])).epsilon(1e-12));
  CHECK(bodies.centre(0)[2] == Approx(0.1 + 0.4 * time));
  // The bound adds the speed of the centre and that of the farthest vertex.
  CHECK(bodies.largest_speed() >= fastest);
  CHECK(bodies.largest_speed() < 1.6 * fastest);
  bodies.move_to(0);
  for (int i = 0; i < surface.vertices; ++i) REQUIRE(norm(rows(surface.x)[i] - start[i]) < 1e-12);
}

TEST_CASE("a body's growth is the rate of its volume", "[coupling]") {
  const SurfaceSet surface = make_surface_set(
      {make_body_mesh(ellipsoid({2, 1.2, 0.7}, {0.3, -0.2, 0.1}), 0.5), make_body_mesh(ellipsoid({1, 1, 1}, {6, 0, 0}), 0.5)});
  const auto field = KOKKOS_LAMBDA(const Vec3& x) {
    return Vec3{0.3 + 0.4 * x.x + 0.1 * std::sin(x.y), -0.2 * x.y + 0.1 * x.x * x.z, 0.1 * x.z + 0.05 * x.x * x.x};
  };
  set_velocity(surface, field);
  const Array<double> growth("corpuscle::test::growth", 2);
  const Table<double> mean("corpuscle::test::mean", 2, 3);
  body_growth(surface, growth, mean);
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), growth);
  const double dt = 1e-4;
  predict_positions(surface, surface.vertices, dt);
  const double after = enclosed_volume(surface);
  predict_positions(surface, surface.vertices, -2 * dt);
  const double before = enclosed_volume(surface);
  // Volumes are cubic in time: the difference leaves dt^2, and round-off of 1e-15 / dt.
  CHECK(host(0) + host(1) == Approx((after - before) / (2 * dt)).epsilon(1e-7));
  CHECK(host(0) > 0.5);  // each by itself: a divergence of 0.3 times a volume of 7, and of 4
  CHECK(host(1) > 0.5);
  predict_positions(surface, surface.vertices, dt);

  // A velocity that is linear in space: the mean over a surface symmetric about its centre is that at the centre.
  set_velocity(
      surface, KOKKOS_LAMBDA(const Vec3& x) {
        return Vec3{0.3 + 0.4 * x.x, 0.2 * x.z, -1.0};
      });
  body_growth(surface, growth, mean);
  const auto average = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), mean);
  CHECK(average(0, 0) == Approx(0.3 + 0.4 * 0.3).margin(0.01));  // the mesh of 300 vertices is symmetric to a per cent
  CHECK(average(1, 0) == Approx(0.3 + 0.4 * 6).margin(0.01));
  CHECK(average(1, 2) == Approx(-1.0));
}

TEST_CASE("the surface part of the dissipation is exact for flows linear in space", "[coupling][energy]") {
  const SurfaceSet surface = make_surface_set({make_body_mesh(ellipsoid({2, 1.2, 0.7}, {0.3, -0.2, 0.1}), 0.5)});
  // u = A x + c without divergence: by Gauss's theorem the integral of (u . grad) u . n is the trace of A^2 times the
  // volume; of the polyhedron too, whose triangles carry u exactly.
  set_velocity(
      surface, KOKKOS_LAMBDA(const Vec3& x) {
        return Vec3{0.3 * x.x + 0.5 * x.y + 1, 0.7 * x.x + 0.1 * x.y - 0.4 * x.z, 0.6 * x.y - 0.4 * x.z - 2};
      });
  const double trace = 0.3 * 0.3 + 0.1 * 0.1 + 0.4 * 0.4 + 2 * (0.5 * 0.7) - 2 * (0.4 * 0.6);
  CHECK(surface_gradient_work(surface) == Approx(trace * enclosed_volume(surface)).epsilon(1e-11));
}

}  // namespace corpuscle
