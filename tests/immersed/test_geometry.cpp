// Lattice location, triangles and small systems.
#include <catch2/catch.hpp>

#include "brute_force.hpp"

using namespace corpuscle;
using namespace scene;

namespace {

/// Largest error of locating points whose index coordinates are known: the lattice maps them, locate() inverts.
double worst_location(const GridViews& grid, double& worst_position) {
  const Lattice lattice = make_lattice(grid);
  const IndexSpace index = grid.index;
  double worst = 0, position = 0;
  Kokkos::parallel_reduce(
      "corpuscle::test::locate", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& error, double& gap) {
        LatticePoint there;
        there.base[0] = e % index.n[0] - 1;
        there.base[1] = (e / index.n[0]) % index.n[1] - 1;
        there.base[2] = e / (index.n[0] * index.n[1]) - 1;
        for (int d = 0; d < 3; ++d) there.f[d] = 0.1 + 0.8 * ((e * (7 + 2 * d)) % 11) / 11.0;
        Vec3 p, again, tangent[3];
        lattice.map(there, p, tangent);
        LatticePoint q;
        lattice.coarse_start(p, q);
        if (lattice.locate(p, q) != Located::inside) {
          error = 1e300;
          return;
        }
        lattice.polish(p, q);
        lattice.map(q, again, tangent);
        for (int d = 0; d < 3; ++d) {
          const double here = std::fabs(q.xi(d) - there.xi(d));
          error = larger(error, here);
        }
        gap = larger(gap, norm(again - p));
      },
      Largest(worst), Largest(position));
  worst_position = position;
  return worst;
}

}  // namespace

TEST_CASE("points are located exactly on straight, skewed and wavy lattices") {
  const Vec3 h{0.31, 0.31, 0.9};
  const Mapping mappings[] = {uniform({-3, -3, -6}, h), skewed({-3, -3, -6}, h), wavy({-3, -3, -6}, h)};
  for (const Mapping& mapping : mappings) {
    double position = 0;
    const double index_error = worst_location(make_grid({{14, 12, 10}}, mapping), position);
    // Newton stops at a step of 1e-13 nodes, and round-off in coordinates of up to 10 um over 0.31 um is 1e-14.
    CHECK(index_error < 1e-11);
    CHECK(position < 1e-12);
  }
}

TEST_CASE("closest point of a triangle beats a fine sampling of it and names its feature") {
  const Vec3 a{0.1, 0.2, -0.3}, b{1.3, 0.1, 0.2}, c{0.4, 1.1, 0.5};
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> coordinate(-1.5, 2.5);
  std::array<int, 7> seen{};
  for (int trial = 0; trial < 400; ++trial) {
    const Vec3 p{coordinate(generator), coordinate(generator), coordinate(generator)};
    const TrianglePoint q = closest_on_triangle(p, a, b, c);
    const double distance = norm(p - (q.weight[0] * a + q.weight[1] * b + q.weight[2] * c));
    ++seen[q.feature];
    double sampled = 1e300;
    const int n = 60;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        sampled = std::min(sampled, norm(p - (double(i) / n * a + double(j) / n * b + double(n - i - j) / n * c)));
      }
    }
    REQUIRE(distance <= sampled + 1e-14);   // round-off of distances of order one
    REQUIRE(distance > sampled - 1.5 / n);  // a sample lies within an edge length over n of every point
    REQUIRE(q.weight[0] + q.weight[1] + q.weight[2] == Approx(1).epsilon(1e-14));
    for (int k = 0; k < 3; ++k) REQUIRE((q.feature == 0 || q.feature > 3 || q.weight[q.feature - 1] == 0));
  }
  for (int feature = 0; feature < 7; ++feature) CHECK(seen[feature] > 0);
}

TEST_CASE("a segment through a shared edge is never missed") {
  const Vec3 a{0, 0, 0}, b{1, 0.2, 0.1}, c{0.3, 0.9, 0}, d{0.8, 1.2, -0.2};
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    const double s = unit(generator);
    const Vec3 on_edge = b + s * (c - b), along{unit(generator) - 0.5, unit(generator) - 0.5, 1};
    const Vec3 p = on_edge - 0.7 * along, q = on_edge + 0.4 * along;
    const bool first = segment_meets_triangle(p, q, a, b, c, cross(b - a, c - a));
    const bool second = segment_meets_triangle(p, q, b, d, c, cross(d - b, c - b));
    REQUIRE((first || second));
    REQUIRE_FALSE(segment_meets_triangle(p, p + 0.9 * (on_edge - p), a, b, c, cross(b - a, c - a)));
  }
}

TEST_CASE("small normal systems are solved, and deficient ones refused") {
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> value(-1, 1);
  NormalMatrix<4> full, flat;
  double right[4] = {}, rebuilt[4] = {};
  const double exact[4] = {0.3, -1.2, 2.5, 0.7};
  for (int point = 0; point < 12; ++point) {
    double phi[4];
    for (double& p : phi) p = value(generator);
    full.add(phi, 1 + point);
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l < 4; ++l) right[k] += (1 + point) * phi[k] * phi[l] * exact[l];
    }
    phi[3] = phi[0] - 2 * phi[1];
    flat.add(phi, 1);
  }
  std::copy(right, right + 4, rebuilt);
  REQUIRE(full.factorise(1e-3));
  full.solve(rebuilt);
  for (int k = 0; k < 4; ++k) CHECK(rebuilt[k] == Approx(exact[k]).epsilon(1e-11));  // condition number below 1e3
  CHECK_FALSE(flat.factorise(1e-10));
}
