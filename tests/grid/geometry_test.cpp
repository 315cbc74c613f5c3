#include <catch2/catch.hpp>
#include <limits>

#include "core/error.hpp"
#include "fluid/integrals.hpp"
#include "grid/metrics.hpp"
#include "grid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::grid_test;
using Map = GridSettings::CrossSection;

namespace {

/// Largest norm of the sum of a cell's six outward area vectors.
double worst_closure(const GridViews& grid) {
  const IndexSpace index = grid.index;
  const auto s0 = grid.face_area[0], s1 = grid.face_area[1], s2 = grid.face_area[2];
  double worst = 0;
  reduce_owned(
      "corpuscle::test::closure", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int c = index.cell(i, j, k);
        const Vec3 sum = load(s0, c + index.stride(0)) - load(s0, c) + load(s1, c + index.stride(1)) - load(s1, c) +
                         load(s2, c + index.stride(2)) - load(s2, c);
        most = larger(most, norm(sum));
      },
      Largest(worst));
  return worst;
}

/// Largest error of gradient . area on any face for a field that is linear in space, over the area.
double worst_linear_flux(const GridViews& grid) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const Vec3 slope{1.3, -0.4, 2.2};
  double worst = 0;
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    double here = 0;
    reduce_owned(
        "corpuscle::test::linear_flux", index,
        KOKKOS_LAMBDA(int i, int j, int k, double& most) {
          for (int side = 0; side < 2; ++side) {
            const int c = index.cell(i, j, k) + side * index.stride(d), low = c - index.stride(d);
            const Vec3 s = load(area, c), g = face_coefficients(x, s, index, d, c);
            double flux = g[d] * dot(slope, load(x, c) - load(x, low));
            for (int e = 0; e < 3; ++e)
              if (e != d) flux += g[e] * 0.5 * dot(slope, central_offset(x, c, index.stride(e)) + central_offset(x, low, index.stride(e)));
            const double error = std::abs(flux - dot(slope, s)) / norm(s);
            most = larger(most, error);
          }
        },
        Largest(here));
    worst = larger(worst, here);
  }
  return worst;
}

NodeSource with_bump(const NodeSource& source, int i0, int j0, int k0, const Triple& shift) {
  return {source.cells, [=](int i, int j, int k) {
            Triple x = source.node(i, j, k);
            if (i == i0 && j == j0 && k == k0)
              for (int m = 0; m < 3; ++m) x[m] += shift[m];
            return x;
          }};
}

}  // namespace

TEST_CASE("area vectors close on every cell and volumes add up", "[grid]") {
  const Comm comm;
  const Grid grid(comm, crumpled_box({7, 6, 8}), {false, false, false});
  CHECK(worst_closure(grid.views()) < 1e-16);              // areas of 0.02: round-off
  CHECK(grid.total_volume() == Approx(1).epsilon(1e-14));  // flat outer sides: the unit box, to round-off
  CHECK(grid.mean_spacing() == Approx(std::cbrt(1.0 / (7 * 6 * 8))).epsilon(1e-14));
}

TEST_CASE("face gradients are exact for linear fields, boundaries included", "[grid]") {
  const Comm comm;
  const Grid grid(comm, crumpled_box({7, 6, 8}), {false, false, false});
  CHECK(worst_linear_flux(grid.views()) < 1e-13);  // slopes of 2.6: round-off
  const Grid bent(comm, make_node_source(tube_settings(9, 5, Map::elliptical)), {false, false, false});
  CHECK(worst_linear_flux(bent.views()) < 1e-12);  // flat corner cells lose a digit
}

TEST_CASE("periodic sides continue the grid beyond themselves", "[grid]") {
  const Comm comm;
  const Grid grid(comm, sheared_box(6, 0.3), {true, true, true});
  CHECK(worst_linear_flux(grid.views()) < 1e-13);
  const Triple expected{0.3, 1, 0};
  for (int m = 0; m < 3; ++m) CHECK(grid.period(1)[m] == Approx(expected[m]).margin(1e-15));
}

TEST_CASE("skewness tells orthogonal grids from others", "[grid]") {
  const Comm comm;
  const std::array<bool, 3> open{false, false, false};
  const Grid box(comm, sheared_box(6, 0), open);
  CHECK(box.skewness() < 1e-13);
  CHECK(box.orthogonal());
  const Grid sheared(comm, sheared_box(6, 0.2), open);
  CHECK(sheared.skewness() == Approx(0.2 / 1.04).epsilon(0.1));  // face i: tan over the metric's diagonal
  CHECK_FALSE(sheared.orthogonal());
  // Leaving out cross terms of this size everywhere would cost an error that no refinement removes.
  const Grid slightly(comm, sheared_box(6, 0.02), open);
  CHECK_FALSE(slightly.orthogonal());
  for (int n : {20, 30}) {
    const Grid conformal(comm, make_node_source(tube_settings(n, 8, Map::conformal)), open);
    INFO(n << " cells: skewness " << conformal.skewness());
    CHECK(conformal.orthogonal());
    const Grid elliptical(comm, make_node_source(tube_settings(n, 8, Map::elliptical)), open);
    CHECK(elliptical.skewness() > 0.2);
    CHECK_FALSE(elliptical.orthogonal());
  }
}

TEST_CASE("a folded or left-handed grid is refused, and the cell named", "[grid]") {
  const Comm comm;
  const std::array<bool, 3> open{false, false, false};
  const auto box = sheared_box(4, 0);
  CHECK_THROWS_AS(Grid(comm, with_bump(box, 3, 2, 3, {-1.3, 0, 0}), open), InputError);
  CHECK_THROWS_WITH(Grid(comm, with_bump(box, 3, 2, 3, {-1.3, 0, 0}), open),
                    Catch::Contains("cell (2, ") && Catch::Contains("folded or left-handed"));
  const NodeSource mirrored{{4, 4, 4}, [](int i, int j, int k) { return Triple{-0.25 * i, 0.25 * j, 0.25 * k}; }};
  CHECK_THROWS_WITH(Grid(comm, mirrored, open), Catch::Contains("right-handed"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(Grid(comm, with_bump(box, 1, 1, 1, {nan, 0, 0}), open), Catch::Contains("cell (0, 0, 0)"));
}

TEST_CASE("sides that are not translates cannot be periodic", "[grid]") {
  const Comm comm;
  const auto box = sheared_box(4, 0);
  const std::array<bool, 3> along_i{true, false, false};
  CHECK_NOTHROW(Grid(comm, box, along_i));
  // A corner out of place, and a node in the middle of the side.
  CHECK_THROWS_WITH(Grid(comm, with_bump(box, 4, 4, 4, {0.05, 0, 0}), along_i), Catch::Contains("i sides"));
  CHECK_THROWS_WITH(Grid(comm, with_bump(box, 4, 2, 1, {0.05, 0, 0}), along_i), Catch::Contains("i sides"));
}
