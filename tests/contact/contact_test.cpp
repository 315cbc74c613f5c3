#include "contact/contact.hpp"

#include <catch2/catch.hpp>

#include "contact/contact_lists.hpp"
#include "core/error.hpp"
#include "immersed/triangle.hpp"
#include "membrane/reference.hpp"
#include "surfaces.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

constexpr double mu = 1.1, dt = 1e-3;  // mPa s; us: so short that the law is nowhere flattened

ContactSettings settings(double range, double aggregation = 0) {
  ContactSettings s;
  s.range_um = range;
  s.aggregation_energy = aggregation;
  s.aggregation_range_um = 2 * range;
  return s;
}

/// Two spheres of radius 2 whose surfaces are `gap` apart along z, turned against each other.
SurfaceSet two_spheres(double gap, double edge) {
  TriangleMesh second = transform(sphere_mesh(2, {0, 0, 0}, edge), {0.3, 0.5, 1}, 20, {0, 0, 4 + gap});
  return cells_of({sphere_mesh(2, {0, 0, 0}, edge), second});
}

struct Totals {
  Vec3 force, torque;
  double size = 0;  // sum of the forces' norms
};
Totals totals(const SurfaceSet& set, const Components<double>& force, int body = -1) {
  const auto x = on_host(set.x), f = on_host(force);
  const auto of = on_host(set.vertex_body);
  Totals t;
  for (int v = 0; v < set.vertices; ++v) {
    if (body >= 0 && of(v) != body) continue;
    t.force += load(f, v);
    t.torque += cross(load(x, v), load(f, v));
    t.size += norm(load(f, v));
  }
  return t;
}

/// A red cell, and one pressed flat to a share of its height: its middle then nearly touches itself through the inside.
SurfaceSet red_cell() {
  CellSettings cell;
  cell.vertices = 500;
  return cells_of({placed_mesh(make_reference(cell), cell)});
}

}  // namespace

TEST_CASE("the law is the derivative of its energy, without bound at no gap and nothing beyond its reach", "[contact]") {
  ContactLaw law;
  law.range = 0.25, law.pressure = 0.02, law.knee = GENERATE(0.0, 0.07);
  law.depth = 1e-3, law.reach = 0.6, law.steepness = 4 / 0.35;
  for (double d : {0.01, 0.0699, 0.0701, 0.12, 0.2499, 0.26, 0.42, 0.43, 0.55, 0.5999}) {
    constexpr double e = 1e-6;
    const double slope = (law.total_energy(d + e, true) - law.total_energy(d - e, true)) / (2 * e);
    CHECK(law.total_pressure(d, true) == Approx(-slope).epsilon(1e-5).margin(1e-8));
  }
  CHECK(law.total_pressure(0.125, false) == Approx(0.02));
  CHECK(law.total_pressure(0.25, false) == 0);
  CHECK(law.total_pressure(0.6, true) == 0);
  CHECK(law.total_pressure(0.3, true) < 0);
  CHECK(law.total_energy(0.25, true) == Approx(-1e-3));
  if (law.knee == 0) CHECK(law.total_pressure(1e-4, false) > 1e4 * law.pressure);
  // Flattened: continuous, with its slope, and as large for what has crossed.
  if (law.knee > 0) CHECK(law.total_pressure(-0.01, false) > law.total_pressure(0.0, false));
}

TEST_CASE("no film is stiffer than a step can follow, with attraction as well", "[contact]") {
  // What opens the gap of two membranes in Stokes flow: 0.15 gap stiffness / mu. Half of the gap's excess in a step is the limit.
  const double range = GENERATE(0.25, 1.5), energy = GENERATE(0.0, 1e-3), step = GENERATE(2.0, 20.0);
  const SurfaceSet set = two_spheres(0.4, 1);
  Contact contact(settings(range, energy), set, Images{}, mu, 0);
  const ContactLaw law = contact.law(step);
  double stiffest = 0;
  for (double d = 0.02 * range; d < range; d += 0.02 * range) {
    constexpr double e = 1e-6;
    const double stiffness = (law.total_pressure(d - e, true) - law.total_pressure(d + e, true)) / (2 * e);
    stiffest = std::max(stiffest, 0.15 * d * stiffness * step / mu);
  }
  CHECK(stiffest < 0.5 * (1 + 1e-4));
  CHECK(stiffest > 0.3);  // and no softer than it must be
}

TEST_CASE("gaps and forces of two spheres are those of spheres", "[contact]") {
  const double gap = 0.1, range = 0.3, radius = 2;
  double error[2];
  for (int fine = 0; fine < 2; ++fine) {
    const double edge = fine ? 0.15 : 0.3, sagitta = edge * edge / (4 * radius);  // edges are up to 1.2 times as long
    const SurfaceSet set = two_spheres(gap, edge);
    Contact contact(settings(range), set, Images{}, mu, 0.8);
    contact.look_at_start(dt);
    const auto gaps = on_host(contact.gaps());
    const auto x = on_host(set.x);
    const auto body = on_host(set.vertex_body);
    int seen = 0;
    for (int v = 0; v < set.vertices; ++v) {
      const double exact = norm(load(x, v) - Vec3{0, 0, body(v) == 0 ? 4 + gap : 0.0}) - radius;
      if (gaps(v) > 1) {
        CHECK(exact > 0.8 - sagitta);
        continue;
      }
      ++seen;  // the triangles lie within the sphere
      CHECK(gaps(v) >= exact - 1e-12);
      CHECK(gaps(v) <= exact + sagitta);
    }
    CHECK(seen > 20);
    // Every vertex of one sphere feels the whole other one, half of the force each way: the integral over one sphere.
    const ContactLaw law = contact.law(dt);
    double exact = 0;
    constexpr int steps = 20000;
    for (int n = 0; n < steps; ++n) {
      const double angle = (n + 0.5) * std::acos(-1.0) / steps, z = radius * std::cos(angle), r = radius * std::sin(angle);
      const double distance = std::hypot(r, 4 + gap - z);
      exact += law.repulsion(distance - radius) * (4 + gap - z) / distance * 2 * std::acos(-1.0) * r * radius * std::acos(-1.0) / steps;
    }
    const Totals lower = totals(set, forces_of(contact, set, dt, false), 0);
    error[fine] = std::abs(-lower.force.z / exact - 1);
    INFO("force " << lower.force.z << " nN, exact " << -exact);
    CHECK(lower.force.z < 0);
    CHECK(std::hypot(lower.force.x, lower.force.y) < 0.05 * exact);  // the meshes are not symmetric
  }
  // The facets' sagitta, 0.0075 and 0.0019 um, over gaps of 0.1 um and more with a pressure that goes with the gap's
  // square.
  CHECK(error[0] < 0.2);
  CHECK(error[1] < 0.05);
}

TEST_CASE("forces add up to no force and no torque, and are the gradient of the energy", "[contact]") {
  const double range = 0.3;
  SurfaceSet set = two_spheres(0.05, 0.25);
  Noise noise;
  move_vertices(set, [&](int, const Vec3& x) { return x + 0.02 * noise.vector(); });
  Contact contact(settings(range, GENERATE(0.0, 2e-3)), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  const auto force = forces_of(contact, set, dt, false);
  const Totals all = totals(set, force);
  CHECK(all.size > 0.01);
  CHECK(norm(all.force) < 1e-13 * all.size);
  CHECK(norm(all.torque) < 1e-12 * all.size);
  const auto f = on_host(force);
  std::vector<Vec3> way;
  double expected = 0;
  for (int v = 0; v < set.vertices; ++v) way.push_back(noise.vector()), expected -= dot(load(f, v), way[v]);
  constexpr double e = 1e-7;  // um: the distance's second derivatives jump where the nearest feature changes
  double energy[2];
  for (int end = 0; end < 2; ++end) {
    const auto x = on_host(set.x);
    for (int v = 0; v < set.vertices; ++v) store(x, v, load(x, v) + (end == 0 ? -e : 2 * e) * way[v]);
    Kokkos::deep_copy(set.x, x);
    contact.look(0, dt);
    energy[end] = contact.energy(dt);
  }
  CHECK((energy[1] - energy[0]) / (2 * e) == Approx(expected).epsilon(1e-5));
  CHECK(contact.report().crossings == 0);
}

TEST_CASE("lists find what looking at every triangle finds", "[contact]") {
  const double range = 0.3, blend = 0.7;
  // Three spheres, one of which is near to its own image and to another beyond a periodic side.
  SurfaceSet set = cells_of({sphere_mesh(2, {0, 0, 0}, 0.4), transform(sphere_mesh(1.6, {0, 0, 0}, 0.3), {1, 2, 3}, 0, {0, 0, 3.7}),
                             transform(sphere_mesh(1.5, {0, 0, 0}, 0.5), {2, 1, 3}, 0, {3.65, 0.2, 0.3})});
  Images images;
  images.count = 3;
  images.shift[1] = {7.6, 0.1, 0}, images.shift[2] = -images.shift[1];
  Contact contact(settings(range), set, images, mu, blend);
  contact.look_at_start(dt);
  Noise noise;
  for (int round = 0; round < 4; ++round) {
    const auto x = on_host(set.x);
    const auto triangle = triangles_on_host(set);
    const auto of_vertex = on_host(set.vertex_body), of_triangle = on_host(set.triangle_body);
    const auto first = on_host(contact.lists().first_group);
    const auto item = on_host(contact.contacts().item);
    const auto gap = on_host(contact.contacts().gap);
    int found = 0, beyond = 0;
    for (int v = 0; v < set.vertices; ++v) {
      std::vector<int> own;
      for (int g = first(v); g < first(v + 1); ++g)
        if (item(g) >= 0) own.push_back(g);
      std::size_t at = 0;
      for (int m = 0; m < images.count; ++m)
        for (int body = 0; body < set.bodies; ++body) {
          if (m == 0 && body == of_vertex(v)) continue;
          const auto square_to = [&](int t) {
            const Vec3 p = load(x, v) + images.shift[m], a = load(x, triangle(t, 0)), b = load(x, triangle(t, 1)),
                       c = load(x, triangle(t, 2));
            const TrianglePoint k = closest_on_triangle(p, a, b, c);
            const Vec3 r = p - (k.weight[0] * a + k.weight[1] * b + k.weight[2] * c);
            return dot(r, r);
          };
          double best = 1e300;
          for (int t = 0; t < set.triangles; ++t)
            if (of_triangle(t) == body) best = std::min(best, square_to(t));
          if (!(best < blend * blend)) continue;
          REQUIRE(at < own.size());
          // Of triangles whose nearest point is on the edge between them rounding takes either: fused operations differ.
          const int nearest = item(own[at]) % set.triangles;
          CHECK(item(own[at]) / set.triangles == m);
          CHECK(of_triangle(nearest) == body);
          CHECK(std::sqrt(square_to(nearest)) == Approx(std::sqrt(best)).margin(1e-12));
          CHECK(std::abs(gap(own[at])) == Approx(std::sqrt(best)).margin(1e-12));
          ++at, ++found, beyond += m > 0 ? 1 : 0;
        }
      CHECK(at == own.size());
    }
    CHECK(found > 100);
    CHECK(beyond > 10);
    // On within the skin, and the last time far beyond it.
    const double step = round == 2 ? 0.2 : 0.02;
    move_vertices(set, [&](int body, const Vec3& p) { return p + step * Vec3{body == 0 ? 0.3 : -0.1, 0.2 * body, -0.05 * body}; });
    contact.look(0, dt);
  }
  CHECK(contact.report().crossings == 0);
}

TEST_CASE("more pairs than an int counts are refused by name", "[contact]") {
  const Array<int> numbers("corpuscle::test::numbers", 3);
  Kokkos::deep_copy(numbers, 1600000000);
  const std::int64_t items = numbers_to_starts("corpuscle::test::starts", numbers, 2);
  CHECK(items == 3200000000);
  CHECK_THROWS_WITH(countable_items(items), Catch::Contains("3.2e+09 pairs") && Catch::Contains("contact.range_um"));
  CHECK(countable_items(2147483647) == 2147483647);
}

TEST_CASE("lists are kept while nothing has come through the skin", "[contact]") {
  SurfaceSet set = two_spheres(0.4, 0.4);
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  for (int n = 0; n < 20; ++n) {  // all together, which changes no gap
    move_vertices(set, [](int, const Vec3& p) { return p + Vec3{0.3, 0, 0}; });
    contact.look(0, dt);
  }
  CHECK(contact.report().lists == 1);
  for (int n = 0; n < 20; ++n) {
    move_vertices(set, [](int body, const Vec3& p) { return p + Vec3{body == 0 ? 0.01 : -0.01, 0, 0}; });
    contact.look(0, dt);
  }
  CHECK(contact.report().lists > 1);
  CHECK(contact.report().lists < 10);
}

TEST_CASE("surfaces that cross are seen, counted and parted", "[contact]") {
  SurfaceSet set = two_spheres(0.1, 0.3);
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  const double overlap = GENERATE(0.03, 0.1);
  move_vertices(set, [&](int body, const Vec3& p) { return p - Vec3{0, 0, body == 1 ? 0.1 + overlap : 0.0}; });
  const auto x = on_host(set.x);
  const auto body = on_host(set.vertex_body);
  int inside = 0;
  for (int v = 0; v < set.vertices; ++v)
    if (norm(load(x, v) - Vec3{0, 0, body(v) == 0 ? 4 - overlap : 0.0}) < 2 - 0.0075) ++inside;
  contact.look(10, dt);
  INFO(inside << " vertices well inside, " << contact.report().crossings << " counted");
  CHECK(contact.report().crossings > 0);
  CHECK(contact.report().crossings >= inside);
  CHECK(contact.report().smallest_gap > 0);
  const long counted = contact.report().crossings;
  contact.look(11, dt);
  CHECK(contact.report().crossings == counted);
  move_vertices(set, [&](int b, const Vec3& p) { return p - Vec3{0, 0, b == 1 ? 1.0 : 0.0}; });
  CHECK_THROWS_WITH(contact.look(12, dt),
                    Catch::Contains("surfaces cross: cells.") && Catch::Contains("um at 12 us") && Catch::Contains("time.step_us"));
  CHECK_THROWS_AS(
      [&] {
        move_vertices(set, [&](int b, const Vec3& p) { return p - Vec3{0, 0, b == 1 ? 0.3 : 0.0}; });
        Contact(settings(0.25), set, Images{}, mu, 0).look_at_start(dt);
      }(),
      InputError);
}

TEST_CASE("what flies through from beyond the range in one step is not laid to contact", "[contact]") {
  SurfaceSet set = two_spheres(0.6, 0.3);
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  const double way = 1;
  const auto v = on_host(set.v);
  const auto body = on_host(set.vertex_body);
  for (int i = 0; i < set.vertices; ++i) v(i, 2) = body(i) == 1 ? -way / dt : 0;
  Kokkos::deep_copy(set.v, v);
  move_vertices(set, [&](int b, const Vec3& p) { return p - Vec3{0, 0, b == 1 ? way : 0.0}; });
  contact.limit_approach(0);
  CHECK_THROWS_WITH(contact.look(5, dt), Catch::Contains("came from beyond contact.range_um = 0.25") && Catch::Contains("time.step_us") &&
                                             !Catch::Contains("contact.pressure_Pa"));
}

TEST_CASE("what goes further in a step than contact can follow is refused, whether or not it has met anything", "[contact]") {
  // Spheres of radius 2 um: a third of that is the most. Lists of all that is within such ways would take in everything.
  SurfaceSet set = two_spheres(0.4, 0.3);
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  const auto moving = [&](int vertex, const Vec3& way) {
    const auto v = on_host(set.v);
    const auto body = on_host(set.vertex_body);
    for (int i = 0; i < set.vertices; ++i)
      for (int d = 0; d < 3; ++d) v(i, d) = vertex < 0 ? (body(i) == 1 ? way[d] / dt : 0.0) : (i == vertex ? way[d] / dt : 0.0);
    Kokkos::deep_copy(set.v, v);
  };
  SECTION("one vertex far from everything") {
    moving(7, {GENERATE(3.0, 1e8), 0, 0});
    CHECK_THROWS_WITH(contact.look(5, dt), Catch::Contains("contact: cells.0, vertex 7 at (") && Catch::Contains("um and 5 us") &&
                                               Catch::Contains("0.66") && Catch::Contains("time.step_us"));
  }
  SECTION("a velocity that is not a number") {
    moving(7, {std::nan(""), 0, 0});
    CHECK_THROWS_AS(contact.look(5, dt), ComputationError);
  }
  SECTION("one vertex that is already away, at rest") {
    const double way = GENERATE(3.0, 1e8);
    const auto x = on_host(set.x);
    x(7, 0) += way;
    Kokkos::deep_copy(set.x, x);
    CHECK_THROWS_AS(contact.look(5, dt), ComputationError);
  }
  SECTION("two bodies, faster than the range, but not through each other") {
    moving(-1, {0, 0, GENERATE(-0.39, 0.39)});  // together and apart
    CHECK_NOTHROW(contact.look(5, dt));
  }
  SECTION("two bodies, through each other, but no further than lists take in") {
    moving(-1, {0, 0, GENERATE(-0.43, 0.43)});
    CHECK_THROWS_WITH(contact.look(5, dt), Catch::Contains("go through each other, by 0.43 um") && Catch::Contains("cells.0") &&
                                               Catch::Contains("cells.1") && Catch::Contains("contact.range_um = 0.25") &&
                                               Catch::Contains("time.step_us"));
  }
  SECTION("past each other") {
    moving(-1, {0.28, 0, 0});
    CHECK_NOTHROW(contact.look(5, dt));
  }
  SECTION("slower") {
    moving(-1, {0, 0, -0.24});
    CHECK_NOTHROW(contact.look(5, dt));
  }
  SECTION("all together") {
    const auto v = on_host(set.v);
    for (int i = 0; i < set.vertices; ++i) v(i, 0) = 5 / dt;
    Kokkos::deep_copy(set.v, v);
    CHECK_NOTHROW(contact.look(5, dt));
  }
}

TEST_CASE("no move takes more than half of a gap away", "[contact]") {
  SurfaceSet set = two_spheres(0.1, 0.3);
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  Noise noise;
  const auto gaps = on_host(contact.gaps());
  const std::vector<double> before(gaps.data(), gaps.data() + gaps.span());
  const double way = GENERATE(0.01, 0.09, 0.2);
  move_vertices(set, [&](int body, const Vec3& p) { return p - Vec3{0, 0, body == 1 ? way : 0.0} + 0.01 * noise.vector(); });
  const auto moved = on_host(set.x);
  contact.limit_approach(0);
  CHECK((contact.report().limited > 0) == (way > 0.02));
  CHECK((contact.report().crossings > 0) == (way > 0.1));
  const long counted = contact.report().crossings;
  const auto kept = on_host(set.x);
  double most = 0;
  Vec3 sum;
  for (int v = 0; v < set.vertices; ++v) most = std::max(most, norm(load(kept, v) - load(moved, v))), sum += load(kept, v) - load(moved, v);
  if (way < 0.02) CHECK(most == 0);
  CHECK(norm(sum) < 1e-12);  // equal and opposite
  contact.look(0, dt);
  CHECK(contact.report().crossings == counted);
  const auto after = on_host(contact.gaps());
  for (int v = 0; v < set.vertices; ++v)
    if (before[v] < 0.2) CHECK(after(v) > 0.35 * before[v]);  // the nearest point moves on, and the correction has passes
}

TEST_CASE("a membrane that buckles at the scale of its mesh does not touch itself", "[contact]") {
  SurfaceSet set = red_cell();
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  std::vector<Vec3> start;
  move_vertices(set, [&](int, const Vec3& p) { return start.push_back(p), p; });
  const Vec3 centre = start[7];
  // Drawn together around one vertex, to and fro: triangles of the second ring, 0.4 um away at rest, come as near as
  // 0.2 um.
  for (double height : {0.06, -0.06, 0.06}) {
    std::size_t v = 0;
    move_vertices(set, [&](int, const Vec3&) {
      const Vec3 p = start[v];
      const double sign = ++v % 2 == 0 ? 1 : -1, away = norm(p - centre);
      return away < 0.9 && away > 0 ? centre + 0.4 * (p - centre) + sign * height * Vec3{0, 0, 1} : p;
    });
    contact.look(0, dt);
    CHECK(contact.report().crossings == 0);
    CHECK(contact.energy(dt) == 0);
  }
}

TEST_CASE("a cell does not touch itself as it is, is pushed apart where it is pinched, and does not go through itself", "[contact]") {
  SurfaceSet set = red_cell();
  Contact contact(settings(0.25), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  CHECK(contact.energy(dt) == 0);
  CHECK(contact.report().smallest() == 1e30);
  move_vertices(set, [](int, const Vec3& p) {  // in the middle, as thin as a tenth
    const double r = std::hypot(p.x, p.y), t = std::min(1.0, r / 2.5);
    return Vec3{p.x, p.y, p.z * (0.1 + 0.9 * t * t)};
  });
  contact.look(0, dt);
  CHECK(contact.report().smallest_own_gap < 0.12);  // a tenth of 1 um
  CHECK(contact.report().smallest() == contact.report().smallest_own_gap);
  CHECK(contact.report().crossings == 0);
  CHECK(contact.energy(dt) > 0);
  const auto force = forces_of(contact, set, dt, false);
  const Totals all = totals(set, force);
  CHECK(norm(all.force) < 1e-13 * all.size);
  CHECK(norm(all.torque) < 1e-12 * all.size);
  const auto f = on_host(force), x = on_host(set.x);
  int pushed = 0;
  for (int v = 0; v < set.vertices; ++v)
    if (norm(load(f, v)) > 1e-6) {
      ++pushed;
      CHECK(f(v, 2) * x(v, 2) > 0);
    }
  CHECK(pushed > 20);
  // Through each other by as much: their places exchanged.
  move_vertices(set, [](int, const Vec3& p) { return std::hypot(p.x, p.y) < 0.6 ? Vec3{p.x, p.y, -p.z} : p; });
  contact.look(1, dt);
  CHECK(contact.report().crossings > 0);
  const long counted = contact.report().crossings;
  contact.look(2, dt);
  CHECK(contact.report().crossings == counted);
  const auto after = on_host(set.x);
  for (int v = 0; v < set.vertices; ++v)
    if (std::hypot(x(v, 0), x(v, 1)) < 0.3) CHECK(after(v, 2) * x(v, 2) > 0);
}

TEST_CASE("on which side of a sharp fold a point is does not depend on which of its triangles is asked", "[contact]") {
  TriangleMesh blade;
  blade.vertices = {{2, 0, 0}, {0, 2, 0}, {-2, 0, 0}, {0, -2, 0}, {0, 0, 0.2}, {0, 0, -0.2}};
  for (int k = 0; k < 4; ++k) {
    blade.triangles.push_back({k, (k + 1) % 4, 4});
    blade.triangles.push_back({(k + 1) % 4, k, 5});
  }
  const SurfaceSet set = cells_of({blade});
  const ContactViews contact{.weight = Table<double>("corpuscle::test::weight", 8 * 200, 3)};
  // Around the middle of the rim and around one of its corners, outside: of all triangles whose nearest point is as near as any.
  int asked = 0, by_features = 0, by_triangles = 0;
  const auto ask = [&](int counted, int& total) {
    Kokkos::parallel_reduce(
        "corpuscle::test::sides", Policy(0, 200),
        KOKKOS_LAMBDA(int n, int& sum) {
          const double angle = 0.0314159 * n, across = 0.3 * std::sin(angle), out = 0.02 + 0.1 * std::fabs(std::cos(angle));
          const Vec3 p = n % 2 == 0 ? Vec3{1 + out, 1 + out, across} : Vec3{2 + out, 0, across};
          double least = 1e300;
          for (int t = 0; t < 8; ++t) {
            const Corners k = corners(set, t, {});
            const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
            const double distance = norm(p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c));
            least = distance < least ? distance : least;
          }
          for (int t = 0; t < 8; ++t) {
            const Corners k = corners(set, t, {});
            const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
            const Vec3 away = p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c);
            if (norm(away) > least + 1e-12) continue;
            for (int d = 0; d < 3; ++d) contact.weight(8 * n + t, d) = at.weight[d];
            const Vec3 outward = counted == 2 ? unit_normal(set, t) : outward_of(set, contact, 8 * n + t, t);
            sum += counted == 0 || dot(away, outward) < 0 ? 1 : 0;
          }
        },
        total);
  };
  ask(0, asked), ask(1, by_features), ask(2, by_triangles);
  CHECK(asked > 300);
  CHECK(by_features == 0);
  CHECK(by_triangles > 50);  // what it is there for
}

TEST_CASE("a triangle that is squeezed flat, or turned over, does not say which side of a membrane a point is on", "[contact]") {
  // A corner of a sphere is moved over the opposite edge of one of its triangles, by so much of its height.
  const double over = GENERATE(0.9, 1.0, 1.1, 1.6);
  SurfaceSet set = cells_of({sphere_mesh(1, {}, 0.3)});
  const auto triangle = triangles_on_host(set);
  const auto x = on_host(set.x);
  const int squeezed = 40;
  const Vec3 foot = 0.5 * (load(x, triangle(squeezed, 1)) + load(x, triangle(squeezed, 2))), corner = load(x, triangle(squeezed, 0));
  store(x, triangle(squeezed, 0), corner + over * (foot - corner));
  Kokkos::deep_copy(set.x, x);
  const Vec3 along = load(x, triangle(squeezed, 2)) - load(x, triangle(squeezed, 1));
  const Vec3 outward = (1 / norm(foot)) * foot, ahead = foot - corner;
  constexpr int points = 800;
  const ContactViews contact{Array<int>("corpuscle::test::item", points), Array<double>("corpuscle::test::gap", points),
                             Table<double>("corpuscle::test::weight", points, 3), Table<double>("corpuscle::test::normal", points, 3)};
  int wrong = 0, by_triangles = 0;
  // Above and below the triangle and what lies beside it; turned over far it may hide that a point is inside, never that one is outside.
  const auto ask = [&](bool by_normals, int& total) {
    Kokkos::parallel_reduce(
        "corpuscle::test::sides", Policy(0, points),
        KOKKOS_LAMBDA(int n, int& sum) {
          const bool outside = n % 2 == 0;
          if (!outside && over > 1.2) return;
          const Vec3 p = foot + (0.008 * (n / 2 % 100 - 50)) * along + (0.25 * (n / 200)) * ahead + (outside ? 0.08 : -0.08) * outward;
          Nearest best;
          for (int t = 0; t < set.triangles; ++t) {
            const Corners k = corners(set, t, {});
            const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
            const Vec3 r = p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c);
            if (dot(r, r) < best.square) best = {dot(r, r), t, at};
          }
          if (winding_around(set, 0, p) > 0.5 == outside) ++sum;
          if (by_normals) {
            const Corners k = corners(set, best.item, {});
            const Vec3 away = p - (best.at.weight[0] * k.a + best.at.weight[1] * k.b + best.at.weight[2] * k.c);
            sum += (dot(away, FaceNormal(set, best.item).unit) > 0) != outside ? 1 : 0;
          } else {
            store_contact(set, p, false, best, contact, n);
            sum += (contact.gap(n) > 0) != outside ? 1 : 0;
          }
        },
        total);
  };
  ask(false, wrong), ask(true, by_triangles);
  INFO("over by " << over);
  CHECK(wrong == 0);
  if (over > 1) CHECK(by_triangles > 0);  // what it is there for
}

namespace {

/// A sphere of so many triangles that those next to each other are more than 16 bits apart: one half of every quadrangle comes first.
TriangleMesh large_sphere(double radius, int around, int along) {
  TriangleMesh mesh;
  const double pi = std::acos(-1.0);
  mesh.vertices = {{0, 0, radius}, {0, 0, -radius}};
  for (int i = 1; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const double theta = pi * i / along, phi = 2 * pi * j / around;
      mesh.vertices.push_back(
          {radius * std::sin(theta) * std::cos(phi), radius * std::sin(theta) * std::sin(phi), radius * std::cos(theta)});
    }
  const auto number = [&](int i, int j) { return 2 + (i - 1) * around + j % around; };
  for (int half = 0; half < 2; ++half)
    for (int i = 1; i < along - 1; ++i)
      for (int j = 0; j < around; ++j) {
        const int a = number(i, j), b = number(i + 1, j), c = number(i + 1, j + 1), d = number(i, j + 1);
        mesh.triangles.push_back(half == 0 ? std::array<int, 3>{a, b, c} : std::array<int, 3>{a, c, d});
      }
  for (int j = 0; j < around; ++j) {
    mesh.triangles.push_back({0, number(1, j), number(1, j + 1)});
    mesh.triangles.push_back({1, number(along - 1, j + 1), number(along - 1, j)});
  }
  return mesh;
}

}  // namespace

TEST_CASE("of a body with more triangles than 16 bits count a vertex has one nearest point", "[contact]") {
  const double radius = 4, range = 0.3, gap = 0.1;
  const TriangleMesh large = large_sphere(radius, 360, 190);
  REQUIRE(large.triangles.size() > 2 * 65536);
  SurfaceSet set = make_surface_set({sphere_mesh(2, {radius + 2 + gap, 0, 0}, 0.4), large}, 1);
  Contact contact(settings(range), set, Images{}, mu, 0);
  contact.look_at_start(dt);
  const auto first = on_host(contact.lists().first_group), first_item = on_host(contact.lists().first_item);
  const auto item = on_host(contact.contacts().item);
  const auto of = on_host(contact.contacts().gap);
  const auto x = on_host(set.x);
  int near = 0;
  bool cut = false;
  for (int v = 0; v < set.own_vertices; ++v) {
    const double away = norm(load(x, v)) - radius;
    int found = 0;
    for (int g = first(v); g < first(v + 1); ++g) {
      cut = cut || (g > first(v) && first_item(g) - first_item(g - 1) > 65535);
      if (item(g) < 0) continue;
      ++found;
      CHECK(std::abs(of(g) - away) < 5e-4);  // triangles of 0.07 um are so far from the sphere
    }
    if (away < range - 1e-3) CHECK(found == 1);
    near += found;
  }
  CHECK(cut);
  CHECK(near > 3);
}
