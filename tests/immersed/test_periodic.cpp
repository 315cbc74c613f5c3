// Bodies that leave a periodic domain, and nodes that a body leaves behind.
#include <catch2/catch.hpp>

#include "brute_force.hpp"

#include "immersed/wrap.hpp"

namespace {

using namespace corpuscle;
using namespace scene;

/// A copy that later changes do not reach, as a mirror on the host would let them.
template <class View>
auto copy_of(const View& view) {
  auto copy = Kokkos::create_mirror(view);
  Kokkos::deep_copy(copy, view);
  return copy;
}

}  // namespace

TEST_CASE("bodies come back into a periodic domain as a whole, wherever they are, and laps are counted", "[immersed]") {
  // Two periodic directions at an angle: x and y + 0.3 x, periods 6 and 8 um.
  const int cells = 20;
  Block block{{cells, cells, cells}};
  block.periodic = {true, true, false};
  const Mapping at = [](double a, double b, double c) { return Vec3{0.3 * a + 0.12 * b - 1, 0.4 * b + 2, 0.5 * c - 4}; };
  const GridViews grid = make_grid(block, at);
  ImmersedOptions options;
  PeriodicFrame& frame = options.frame;
  frame.periodic[0] = frame.periodic[1] = true;
  frame.origin = at(0, 0, 0);
  frame.period[0] = {6, 0, 0}, frame.period[1] = {2.4, 8, 0};
  frame.dual[0] = {1.0 / 6, -2.4 / 48, 0}, frame.dual[1] = {0, 1.0 / 8, 0};
  for (int d = 0; d < 2; ++d)
    for (int e = 0; e < 2; ++e) REQUIRE(dot(frame.dual[d], frame.period[e]) == Approx(d == e ? 1 : 0).margin(1e-15));
  const Vec3 home{3.1, 6.2, 1}, away = home + 2.0 * frame.period[0] - 3.0 * frame.period[1];
  const SurfaceSet surface = make_surface_set({sphere(2, 1, away), sphere(2, 1, home)});
  const auto start = copy_of(surface.x);
  ImmersedBoundary ib(grid, surface, options);
  ib.wrap(0, 2, true);
  const auto wrapped = copy_of(surface.x);
  const Vec3 shift = away - home;
  const int half = surface.vertices / 2;
  for (int i = 0; i < surface.vertices; ++i)
    for (int m = 0; m < 3; ++m) REQUIRE(wrapped(i, m) == Approx(start(i, m) - (i < half ? shift[m] : 0)).margin(1e-13));
  CHECK(ib.laps_state() == std::vector<double>{2, -3, 0, 0, 0, 0});
  ib.classify();
  CHECK(ib.counts().owned_vertices == surface.vertices);  // both spheres, one upon the other
  // A step further than the domain's end: laps add up for bodies that keep their place, and start anew from_start.
  auto x = on_host(surface.x);
  for (int i = half; i < surface.vertices; ++i) x(i, 0) += 6;
  Kokkos::deep_copy(surface.x, x);
  ib.wrap(1, 2, false);
  CHECK(ib.laps_state() == std::vector<double>{2, -3, 0, 1, 0, 0});
  ib.classify();
  CHECK(ib.counts().owned_vertices == surface.vertices);
  ib.wrap(0, 2, false);
  CHECK(ib.laps_state() == std::vector<double>{2, -3, 0, 1, 0, 0});
}

TEST_CASE("a node that a body leaves at one stroke takes the pressure around it", "[immersed]") {
  const double h = 0.25;
  const GridViews grid = make_grid({{24, 20, 20}}, uniform({-3, -2.5, -2.5}, {h, h, h}));
  const SurfaceSet surface = make_surface_set({sphere(3, 1.2, {-0.6, 0.01, 0.02})});
  ImmersedBoundary ib(grid, surface, ImmersedOptions{});
  ib.classify();
  const auto before = copy_of(ib.nodes().kind);
  const Array<double> p("corpuscle::test::p", grid.index.size());
  auto host = Kokkos::create_mirror_view(p);
  const auto linear = [&](int i) { return 5 + 0.7 * (i + 0.5) * h; };
  for (int c = 0; c < grid.index.size(); ++c) {
    int i[3];
    grid.index.unpack(c, i[0], i[1], i[2]);
    host(c) = before(c) == NodeKind::inside ? -1e6 : linear(i[0]);  // stale: from when the body came
  }
  Kokkos::deep_copy(p, host);
  auto x = on_host(surface.x);
  for (int v = 0; v < surface.vertices; ++v) x(v, 0) += 2.3 * h;
  Kokkos::deep_copy(surface.x, x);
  update_surface_geometry(surface);
  ib.classify();
  REQUIRE(ib.counts().uncovered > 20);
  ib.fill_uncovered(p);
  Kokkos::deep_copy(host, p);
  const auto after = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), ib.nodes().kind);
  int uncovered = 0;
  for (int c = 0; c < grid.index.size(); ++c) {
    int i[3];
    grid.index.unpack(c, i[0], i[1], i[2]);
    if (!grid.index.owns(i[0], i[1], i[2]) || before(c) != NodeKind::inside) continue;
    if (after(c) != NodeKind::fluid) {
      REQUIRE(host(c) == -1e6);
      continue;
    }
    ++uncovered;
    REQUIRE(std::abs(host(c) - linear(i[0])) < 0.7 * 2.5 * h);  // a mean over neighbours at most two nodes away
  }
  CHECK(uncovered == ib.counts().uncovered);
}
