// What is stored at nodes inside bodies.
#include <catch2/catch.hpp>

#include "brute_force.hpp"
#include "immersed/surface_motion.hpp"

using namespace corpuscle;
using namespace scene;

TEST_CASE("nodes inside a body move with the surface beside them, deeper ones with its mean") {
  const double h = 0.3;
  const GridViews grid = make_grid({{20, 20, 20}}, uniform({-3, -3, -3}, {h, h, h}));
  const SurfaceSet surface = make_surface_set({sphere(3, 1.7, {0.02, 0.03, 0.01})});
  const Vec3 velocity{0.3, -0.2, 0.5}, spin{0.4, 0.1, -0.7};
  const VectorField rigid = [=](const Vec3& x) { return velocity + cross(spin, x - Vec3{0.02, 0.03, 0.01}); };
  set_velocity(surface, rigid);
  ImmersedBoundary ib(grid, surface, {});
  ib.classify();
  const Array<double> growth("corpuscle::test::growth", 1);
  const Table<double> mean("corpuscle::test::mean", 1, 3);
  body_growth(surface, growth, mean);
  const Components<double> u("corpuscle::test::u", grid.index.size(), 3);
  Kokkos::deep_copy(u, -99.0);
  fill_inside_velocity(grid.index, surface, ib.band(), ib.nodes(), mean, u);
  const auto found = on_host(u), foot = on_host(ib.band().foot);
  const auto kind = on_host(ib.nodes().kind);
  const auto key = on_host(ib.band().key);
  int beside = 0, deep = 0, others = 0;
  for (int c = 0; c < grid.index.size(); ++c) {
    int i[3];
    grid.index.unpack(c, i[0], i[1], i[2]);
    if (!grid.index.owns(i[0], i[1], i[2])) continue;
    if (kind(c) != NodeKind::inside) {
      others += found(c, 0) != -99;
    } else if (key(c) != no_key) {
      ++beside;
      // The mean over the closest triangle, whose edges are up to 0.3 um long: 0.8 / us times two thirds of that.
      REQUIRE(norm(load(found, c) - rigid(load(foot, c))) < 0.16);
    } else {
      ++deep;
      REQUIRE(norm(load(found, c) - velocity) < 0.02);  // the mesh is symmetric about its centre to a hundredth
    }
  }
  CHECK(beside > 50);
  CHECK(deep > 50);
  CHECK(others == 0);
}

TEST_CASE("a body that jumps leaves no trace where it was") {
  const GridViews grid = make_grid({{24, 20, 20}}, uniform({-3.6, -3, -3}, {0.3, 0.3, 0.3}));
  const SurfaceSet moving = make_surface_set({sphere(2, 1.1, {-2, 0.03, 0.01})});
  ImmersedBoundary ib(grid, moving, {}), fresh(grid, moving, {});
  ib.classify();
  move(moving, {3.8, 0.2, -0.3});
  ib.classify();
  fresh.classify();
  const auto kind = on_host(ib.nodes().kind), expected = on_host(fresh.nodes().kind);
  const auto key = on_host(ib.band().key), expected_key = on_host(fresh.band().key);
  for (int c = 0; c < grid.index.size(); ++c) {
    REQUIRE(kind(c) == expected(c));
    REQUIRE(key(c) == expected_key(c));
  }
}
