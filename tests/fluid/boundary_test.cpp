#include <catch2/catch.hpp>

#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using Profile = BoundarySettings::Profile;

namespace {

/// Flux into the block through side k_min, um3/us, and the area of that side, from filled velocities.
std::array<double, 2> inflow(Grid& grid, const Components<double>& u) {
  const auto v = on_host(u), area = on_host(grid.views().face_area[2]);
  const IndexSpace& index = grid.index();
  double sums[2] = {0, 0};
  if (grid.halo().neighbour(2, 0) < 0)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) {
        const int b = index.cell(i, j, -1), f = index.cell(i, j, 0);
        for (int m = 0; m < 3; ++m) sums[0] += v(b, m) * area(f, m);
        sums[1] += area(f, 2);
      }
  grid.comm().sum(sums, 2);
  return {sums[0], sums[1]};
}

struct Filled {
  Grid grid;
  BoundaryConditions conditions;
  Components<double> u;
  Filled(const GridSettings& shape, const std::vector<BoundarySettings>& sides, const std::array<bool, 3>& periodic)
      : grid(Comm(), make_node_source(shape), periodic), conditions(grid, sides, &shape), u("corpuscle::test::u", grid.index().size(), 3) {}
  void fill(double t) {
    conditions.set_time(t);
    grid.halo().exchange(u);
    conditions.fill(u);
  }
};

constexpr std::array<bool, 3> open{false, false, false};

}  // namespace

TEST_CASE("every inlet profile carries the mean speed that was asked for", "[fluid][ranks]") {
  const Profile profile = GENERATE(Profile::uniform, Profile::parabolic, Profile::table);
  const bool round = GENERATE(true, false);
  auto all = tube_sides(0);
  all[4].profile = profile;
  all[4].radial_table = {{0, 3}, {0.5, 2}, {1, 0}};
  Filled scene(round ? tube(12, 13) : box({12, 10, 13}, {4, 3, 9}), all, open);
  scene.fill(1);
  const auto [flux, area] = inflow(scene.grid, scene.u);
  CHECK(flux / area == Approx(2e-3).epsilon(1e-13));  // round-off
}

TEST_CASE("inlet profiles have their shapes", "[fluid]") {
  auto all = tube_sides(0);
  SECTION("uniform") {
    Filled scene(tube(12, 6), all, open);
    scene.fill(1);
    const auto u = on_host(scene.u);
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i) CHECK(u(scene.grid.index().cell(i, j, -1), 2) == Approx(2e-3).epsilon(1e-13));
    CHECK(scene.conditions.largest_speed() == Approx(2e-3).epsilon(1e-13));
  }
  SECTION("parabolic in a tube") {
    all[4].profile = Profile::parabolic;
    Filled scene(tube(24, 6), all, open);
    scene.fill(1);
    const auto u = on_host(scene.u), x = on_host(scene.grid.views().x);
    double worst = 0;
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 24; ++i) {
        const int c = scene.grid.index().cell(i, j, -1);
        worst = larger(worst, std::abs(u(c, 2) / 4e-3 - (1 - (x(c, 0) * x(c, 0) + x(c, 1) * x(c, 1)) / 25)));
      }
    CHECK(worst < 5e-3);  // rescaled to the mean over a polygon of 96 corners and the mid-point rule
  }
  SECTION("parabolic in a duct is a product of parabolas, constant along a periodic direction") {
    all[4].profile = Profile::parabolic;
    all[0].type = all[1].type = Type::periodic;
    Filled scene(box({6, 10, 6}, {4, 2, 3}), all, {true, false, false});
    scene.fill(1);
    const auto u = on_host(scene.u);
    const IndexSpace& index = scene.grid.index();
    for (int j = 0; j < 10; ++j) {
      const double y = (j + 0.5) / 5 - 1;
      // The mid-point mean of 1 - y^2 over ten cells is 2/3 + 1/300.
      CHECK(u(index.cell(0, j, -1), 2) == Approx(2e-3 * (1 - y * y) / (2.0 / 3 + 1.0 / 300)).epsilon(1e-12));
      CHECK(u(index.cell(5, j, -1), 2) == u(index.cell(0, j, -1), 2));
    }
  }
  SECTION("parabolic in a duct is flat where a side is symmetric") {
    all[4].profile = Profile::parabolic;
    all[0].type = Type::symmetry;
    all[2].type = all[3].type = Type::symmetry;
    Filled scene(box({10, 6, 6}, {2, 4, 3}), all, open);
    scene.fill(1);
    const auto u = on_host(scene.u);
    const IndexSpace& index = scene.grid.index();
    for (int i = 0; i < 10; ++i) {
      const double x = (i + 0.5) / 10;
      // The mid-point mean of 1 - x^2 from 0 to 1 over ten cells is 2/3 + 1/1200.
      CHECK(u(index.cell(i, 0, -1), 2) == Approx(2e-3 * (1 - x * x) / (2.0 / 3 + 1.0 / 1200)).epsilon(1e-12));
      CHECK(u(index.cell(i, 5, -1), 2) == u(index.cell(i, 0, -1), 2));
    }
  }
  SECTION("parabolic beside a side that lets fluid through is refused") {
    all[4].profile = Profile::parabolic;
    all[1].type = Type::outflow;
    CHECK_THROWS_WITH(Filled(box({6, 6, 6}, {2, 4, 3}), all, open), Catch::Contains("boundary.4.profile") && Catch::Contains("uniform"));
  }
  SECTION("parabolic on a grid of another origin is a disc's within round walls, and refused elsewhere") {
    all[4].profile = Profile::parabolic;
    const auto made = [&](const GridSettings& shape) {
      Grid grid(Comm(), make_node_source(shape), open);
      GridSettings file;
      file.generator = GridSettings::Generator::file;
      BoundaryConditions(grid, all, &file);
    };
    CHECK_NOTHROW(made(tube(12, 6)));
    CHECK_THROWS_WITH(made(box({6, 6, 6}, {4, 4, 9})), Catch::Contains("boundary.4.profile") && Catch::Contains("\"table\""));
    all[0].type = Type::symmetry;
    CHECK_THROWS_WITH(made(tube(12, 6)), Catch::Contains("boundary.4.profile"));
  }
  SECTION("a table that carries no flow is refused by its key") {
    all[4].profile = Profile::table;
    all[4].radial_table = {{0, -3}, {1, -1}};
    CHECK_THROWS_WITH(Filled(tube(12, 6), all, open), Catch::Contains("boundary.4.radial_table"));
  }
  SECTION("a table is linear between its entries") {
    all[4].profile = Profile::table;
    all[4].radial_table = {{0, 3}, {0.5, 2}, {1, 0}};
    Filled scene(tube(12, 6), all, open);
    scene.fill(1);
    const auto u = on_host(scene.u), x = on_host(scene.grid.views().x);
    const IndexSpace& index = scene.grid.index();
    const auto ratio = [&](int i, int j) {
      const int c = index.cell(i, j, -1);
      const double r = std::hypot(x(c, 0), x(c, 1)) / 5;
      return u(c, 2) / (r < 0.5 ? 3 - 2 * r : 4 - 4 * r);
    };
    for (int i = 0; i < 12; ++i) CHECK(ratio(i, 4) == Approx(ratio(5, 5)).epsilon(1e-12));
  }
}

TEST_CASE("ramps and tables in time multiply the profile", "[fluid]") {
  auto all = tube_sides(20);
  all[4].time_table = {{0, 1}, {40, 1}, {60, 3}};
  Filled scene(box({4, 4, 5}, {2, 2, 3}), all, open);
  const auto speed = [&](double t) {
    scene.fill(t);
    return on_host(scene.u)(scene.grid.index().cell(1, 1, -1), 2);
  };
  CHECK(speed(0) == 0);
  CHECK(speed(5) == Approx(0.5e-3));
  CHECK(speed(20) == Approx(2e-3));
  CHECK(speed(30) == Approx(2e-3));
  CHECK(speed(50) == Approx(4e-3));
  CHECK(speed(100) == Approx(6e-3));
  CHECK(scene.conditions.largest_speed() == Approx(6e-3));
}

TEST_CASE("each kind of side fills the boundary as it should", "[fluid]") {
  auto all = sides({Type::symmetry, Type::wall, Type::moving_wall, Type::symmetry, Type::velocity_inlet, Type::outflow});
  all[2].velocity = Triple{0.5, 0, -0.25};
  all[4].velocity = Triple{0.1, 0.2, 0.7};
  Filled scene(box({4, 5, 6}, {2, 2, 3}), all, open);
  const IndexSpace index = scene.grid.index();
  const auto u = scene.u;
  Kokkos::parallel_for(
      "corpuscle::test::u", Policy(0, index.size()), KOKKOS_LAMBDA(int c) {
        store(u, c, Vec3{1 + 0.01 * c, 2 - 0.02 * c, 3 + 0.03 * c});
      });
  scene.fill(0);
  const auto v = on_host(u);
  const auto is = [&](int c, const Triple& expected) {
    for (int m = 0; m < 3; ++m)
      if (v(c, m) != Approx(expected[m]).margin(1e-15)) return false;
    return true;
  };
  const auto at = [&](int i, int j, int k) {
    const int c = index.cell(i, j, k);
    return Triple{v(c, 0), v(c, 1), v(c, 2)};
  };
  const Triple inside = at(0, 2, 2), top = at(2, 4, 2), last = at(2, 2, 5);
  CHECK(is(index.cell(-1, 2, 2), {0, inside[1], inside[2]}));
  CHECK(is(index.cell(4, 2, 2), {0, 0, 0}));
  CHECK(is(index.cell(2, -1, 2), {0.5, 0, -0.25}));
  CHECK(is(index.cell(2, 5, 2), {top[0], 0, top[2]}));
  CHECK(is(index.cell(2, 2, -1), {0.1, 0.2, 0.7}));
  CHECK(is(index.cell(2, 2, 6), last));
  // Edges: walls win over the rest, prescribed velocities over symmetry, symmetry over outflow; where two symmetry
  // sides meet only the velocity along the edge is left.
  CHECK(is(index.cell(4, 2, -1), {0, 0, 0}));
  CHECK(is(index.cell(4, 2, 6), {0, 0, 0}));
  CHECK(is(index.cell(2, -1, 6), {0.5, 0, -0.25}));
  CHECK(is(index.cell(-1, 2, -1), {0.1, 0.2, 0.7}));
  const Triple corner = at(0, 2, 5);
  CHECK(is(index.cell(-1, 2, 6), {0, corner[1], corner[2]}));
  CHECK(is(index.cell(-1, 5, 2), {0, 0, at(0, 4, 2)[2]}));
  const std::vector<std::string> bounded{"a symmetry side", "a wall", "a wall", "a symmetry side", "an inlet", ""};
  for (int side = 0; side < 6; ++side) CHECK(scene.conditions.bounded_by(side) == bounded[side]);

  const Components<float> change("corpuscle::test::change", index.size(), 3);
  Kokkos::parallel_for(
      "corpuscle::test::change", Policy(0, index.size()), KOKKOS_LAMBDA(int c) { store(change, c, load(u, c)); });
  scene.conditions.fill_homogeneous(change);
  const auto zero = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), change);
  CHECK(zero(index.cell(2, -1, 2), 0) == 0);
  CHECK(zero(index.cell(2, 2, -1), 2) == 0);
  CHECK(zero(index.cell(2, 2, 6), 2) == static_cast<float>(last[2]));
  scene.conditions.clear_natural(change);
  const auto cleared = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), change);
  CHECK(cleared(index.cell(2, 2, 6), 2) == 0);
  CHECK(cleared(index.cell(-1, 2, 2), 1) == 0);
  CHECK(cleared(index.cell(2, 2, 5), 2) == static_cast<float>(last[2]));
}

TEST_CASE("inlets without an outflow are balanced over their area, and moving walls do not leak", "[fluid][ranks]") {
  auto all = sides({Type::wall, Type::wall, Type::velocity_inlet, Type::moving_wall, Type::velocity_inlet, Type::wall});
  all[2].velocity = Triple{0, 0, 0};
  all[4].velocity = Triple{0, 0, 1};
  Filled scene(box({6, 6, 7}, {2, 3, 4}), all, open);
  scene.fill(0);
  const IndexSpace index = scene.grid.index();
  Array<double> flux[3];
  for (auto& f : flux) f = Array<double>("corpuscle::test::flux", index.size());
  const auto area = scene.grid.views().face_area[2];
  const auto u = scene.u;
  const auto f2 = flux[2];
  if (scene.grid.halo().neighbour(2, 0) < 0)
    for_box(
        "corpuscle::test::flux", {0, 0, 0}, {index.n[0], index.n[1], 1}, KOKKOS_LAMBDA(int i, int j, int k) {
          const int c = index.cell(i, j, k);
          f2(c) = dot(load(area, c), load(u, c - index.stride(2)));
        });
  const auto f1 = flux[1];
  if (scene.grid.halo().neighbour(1, 1) < 0)
    for_box(
        "corpuscle::test::leak", {0, index.n[1], 0}, {index.n[0], index.n[1] + 1, index.n[2]},
        KOKKOS_LAMBDA(int i, int j, int k) { f1(index.cell(i, j, k)) = 0.25; });
  scene.conditions.close_moving_walls(flux);
  // 6 um3/us come in; the body inside shrinks by 1; the sides k_min (6 um2) and j_min (8 um2) share the missing 5, the
  // wall at j_max takes nothing: the fluxes out of the block end up at -1.
  CHECK(scene.conditions.has_inlet());
  CHECK(scene.conditions.balance(flux, -1) == Approx(5.0 / 14).epsilon(1e-13));
  double out[2] = {0, 0};
  for (int d = 1; d < 3; ++d) {
    const auto f = on_host(flux[d]);
    for (int end = 0; end < 2; ++end) {
      if (scene.grid.halo().neighbour(d, end) >= 0) continue;
      visit_owned(index, [&](int, int j, int k, int c) {
        const int at = d == 1 ? j : k;
        if (at != (end == 0 ? 0 : index.n[d] - 1)) return;
        const double flow = end == 0 ? -f(c) : f(c + index.stride(d));
        out[0] += flow;
        if (d == 1 && end == 1) out[1] += std::abs(flow);
      });
    }
  }
  scene.grid.comm().sum(out, 2);
  CHECK(out[0] == Approx(-1).epsilon(1e-13));
  CHECK(out[1] == 0);
}
