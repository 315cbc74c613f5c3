// Lists in flows that carry all surfaces along: what they do together brings nothing nearer than it shears.
#include <catch2/catch.hpp>

#include "contact/contact.hpp"
#include "contact/fit_motion.hpp"
#include "membrane/reference.hpp"
#include "surfaces.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

constexpr double dt = 1e-3, blend = 0.7;  // us, um

/// Spheres of radius 2, one behind the other.
SurfaceSet row_of_spheres(int spheres, const Vec3& apart) {
  std::vector<TriangleMesh> meshes;
  for (int n = 0; n < spheres; ++n)
    meshes.push_back(transform(sphere_mesh(2, {0, 0, 0}, 0.5), {0.3, 0.5, 1}, 17.0 * n, {n * apart.x, n * apart.y, n * apart.z}));
  return cells_of(meshes);
}

template <class Flow>
void set_velocities(const SurfaceSet& set, const Flow& flow) {
  const auto x = on_host(set.x), v = on_host(set.v);
  for (int n = 0; n < set.vertices; ++n) store(v, n, flow(load(x, n)));
  Kokkos::deep_copy(set.v, v);
}

Contact contact_of(const SurfaceSet& set) {
  ContactSettings settings;
  settings.range_um = 0.25;
  return Contact(settings, set, Images{}, 1.1, blend);
}

SpaceBounds bounds_of(const SurfaceSet& set) {
  SpaceBounds bounds{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  const auto x = on_host(set.x);
  for (int n = 0; n < set.vertices; ++n)
    for (int d = 0; d < 3; ++d) {
      bounds.lower[d] = std::min(bounds.lower[d], x(n, d));
      bounds.upper[d] = std::max(bounds.upper[d], x(n, d));
    }
  return bounds;
}

}  // namespace

TEST_CASE("what surfaces do together is found, and how steep it is", "[contact]") {
  const SurfaceSet set = row_of_spheres(6, {1, 4.3, 0});
  const auto flow = [](const Vec3& x) {
    return Vec3{3 + 0.4 * x.y - 0.02 * x.y * x.y + 0.1 * x.x * x.z, 0.3 * x.z - 0.05 * x.x * x.y, 0.2 * x.x + 0.01 * x.z * x.z - 7};
  };
  set_velocities(set, flow);
  const SpaceBounds bounds = bounds_of(set);
  const SmoothMotion motion = fit_motion(set, bounds);
  const double most = steepest_gradient(motion, bounds);
  const auto x = on_host(set.x);
  double steepest = 0;
  constexpr double e = 1e-4;
  for (int n = 0; n < set.vertices; ++n) {
    const Vec3 p = load(x, n);
    CHECK(norm(motion(p) - flow(p)) < 1e-6 * norm(flow(p)));
    for (const Vec3& way : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{0.6, 0.8, 0}})
      steepest = std::max(steepest, norm(flow(p + e * way) - flow(p - e * way)) / (2 * e));
  }
  CHECK(most >= steepest);
  CHECK(most < 2.5 * steepest);  // of corners, and of all directions together
}

TEST_CASE("surfaces that are no number, or one point, move by themselves", "[contact]") {
  const SurfaceSet set = row_of_spheres(2, {0, 4.3, 0});
  set_velocities(set, [](const Vec3&) { return Vec3{1, 0, 0}; });
  const SpaceBounds bounds = bounds_of(set), point{bounds.lower, bounds.lower};
  CHECK(fit_motion(set, bounds).share[0].x == Approx(1));
  CHECK(norm(fit_motion(set, point)({1, 2, 3})) == 0);
  const auto v = on_host(set.v);
  v(7, 1) = std::nan("");
  Kokkos::deep_copy(set.v, v);
  CHECK(norm(fit_motion(set, bounds)({1, 2, 3})) == 0);
}

TEST_CASE("lists outlast a flow that carries all along with it", "[contact]") {
  const bool tube = GENERATE(false, true);
  const SurfaceSet set = row_of_spheres(10, {0, 4.3, 0});
  // 0.08 um a step between the first and the last, or the middle: a mean for all would see their lists end every other step.
  const auto flow = [&](const Vec3& x) { return Vec3{(tube ? 8e-3 * x.y * (1 - x.y / 39) : 2e-3 * x.y) / dt, 0, 0}; };
  set_velocities(set, flow);
  Contact contact = contact_of(set);
  contact.look_at_start(dt);
  for (int step = 0; step < 20; ++step) {
    move_vertices(set, [&](int, const Vec3& p) { return p + dt * flow(p); });
    contact.look(0, dt);
  }
  CHECK(contact.report().lists <= (tube ? 4 : 1));
}

TEST_CASE("lists see what a flow brings near", "[contact]") {
  const bool even = GENERATE(false, true);
  const SurfaceSet set = row_of_spheres(4, {6, 0, 0});
  const auto flow = [&](const Vec3& x) { return (0.02 / dt) * Vec3{-x.x * (even ? 1 : 0.7 + 0.03 * x.x), 0.5 * x.y, 0.5 * x.z}; };
  set_velocities(set, flow);
  Contact contact = contact_of(set);
  contact.look_at_start(dt);
  const auto near = [&](const Contact& one) {
    const auto gaps = on_host(one.gaps());
    int found = 0;
    for (int n = 0; n < set.vertices; ++n) found += gaps(n) < 1 ? 1 : 0;
    return found;
  };
  const int before = near(contact);
  int most = 0;
  for (int step = 0; step < 60; ++step) {
    move_vertices(set, [&](int, const Vec3& p) { return p + dt * flow(p); });
    contact.look(0, dt);
    if (step % 3 != 0) continue;
    Contact fresh = contact_of(set);
    fresh.look_at_start(dt);
    const auto gaps = on_host(contact.gaps()), expected = on_host(fresh.gaps());
    int different = 0;
    for (int n = 0; n < set.vertices; ++n) different += gaps(n) != expected(n) ? 1 : 0;
    CHECK(different == 0);
    most = std::max(most, near(contact));
  }
  CHECK(before == 0);
  CHECK(most > 20);
  CHECK(contact.report().lists > 5);
}

TEST_CASE("gaps of copies are found wherever they are asked for, however fast copies come there", "[contact]") {
  // A row of spheres flies through a window; the first is this rank's own, the others are copies.
  SurfaceSet set = row_of_spheres(4, {4.3, 0.3, 0});
  set.own_cells = 1;
  set.own_vertices = on_host(set.first_vertex)(1);
  const GapsWanted window{{8, -3, -3}, {12, 3, 3}};
  const ContactPeers peers{Comm(), [] {}, std::make_shared<Workspace>(), window};
  ContactSettings settings;
  settings.range_um = 0.25;
  Contact contact(settings, set, Images{}, 1.1, blend, &peers);
  contact.take_up(set, set);
  double speed = GENERATE(0.05, 0.4, 3.0);  // um a step, at first
  const auto flow = [&](const Vec3&) { return Vec3{speed / dt, 0, 0}; };
  set_velocities(set, flow);
  contact.look_at_start(dt);
  int compared = 0;
  for (int step = 0; step < 40; ++step) {
    speed *= 1.02;
    set_velocities(set, flow);
    move_vertices(set, [&](int, const Vec3& p) { return p + dt * flow(p); });
    contact.look(0, dt);
    Contact fresh = contact_of(set);
    fresh.look_at_start(dt);
    const auto gaps = on_host(contact.gaps()), expected = on_host(fresh.gaps());
    const auto x = on_host(set.x);
    int different = 0;
    for (int n = 0; n < set.vertices; ++n) {
      if (n >= set.own_vertices && !window.at(load(x, n))) continue;
      different += gaps(n) != expected(n) ? 1 : 0;
      compared += n >= set.own_vertices && expected(n) < 1 ? 1 : 0;
    }
    CHECK(different == 0);
  }
  CHECK(compared > 10);
  CHECK(contact.report().lists < 30);
}

TEST_CASE("lists under images see what a period brings near", "[contact]") {
  const SurfaceSet set = row_of_spheres(3, {0, 4.3, 0});
  const auto flow = [](const Vec3& x) { return Vec3{3e-3 * x.y / dt, 0, 0}; };
  set_velocities(set, flow);
  Images images;
  images.count = 3;
  images.shift[1] = {-9, 13.2, 0}, images.shift[2] = -images.shift[1];
  ContactSettings settings;
  settings.range_um = 0.25;
  Contact contact(settings, set, images, 1.1, blend);
  contact.look_at_start(dt);
  int near = 0;
  for (int step = 0; step < 300; ++step) {
    move_vertices(set, [&](int, const Vec3& p) { return p + dt * flow(p); });
    contact.look(0, dt);
    if (step % 10 != 0) continue;
    Contact fresh(settings, set, images, 1.1, blend);
    fresh.look_at_start(dt);
    const auto gaps = on_host(contact.gaps()), expected = on_host(fresh.gaps());
    int different = 0;
    for (int n = 0; n < set.vertices; ++n) {
      different += gaps(n) != expected(n) ? 1 : 0;
      near += expected(n) < 0.6 ? 1 : 0;
    }
    CHECK(different == 0);
  }
  CHECK(near > 10);
}
