// Values at immersed nodes.
#include <catch2/catch.hpp>

#include "brute_force.hpp"

using namespace corpuscle;
using namespace scene;

namespace {

const VectorField linear_velocity = [](const Vec3& x) {
  return Vec3{0.3 + 0.2 * x.x - 0.1 * x.y + 0.4 * x.z, -0.1 + 0.5 * x.y + 0.3 * x.z, 0.2 * x.x - 0.7 * x.z};
};
const ScalarField linear_pressure = [](const Vec3& x) { return 1.3 - 0.4 * x.x + 0.25 * x.y + 0.6 * x.z; };

struct Errors {
  double u_max = 0, u_rms = 0, p_max = 0, p_rms = 0;
};

/// Sample the fields on fluid (and, for the velocity, boundary) nodes only, reconstruct, and compare.
Errors reconstruct(const GridViews& grid, ImmersedBoundary& ib, const SurfaceSet& surface, const VectorField& u_exact,
                   const ScalarField& p_exact) {
  set_velocity(surface, u_exact);
  ib.classify();
  ib.build_stencils();
  const auto kind = on_host(ib.nodes().kind);
  const auto u = sample(grid.x, u_exact, [&](int c) { return kind(c) == NodeKind::fluid || kind(c) == NodeKind::boundary; });
  const auto p = sample(grid.x, p_exact, [&](int c) { return kind(c) == NodeKind::fluid; });
  ib.reconstruct_velocity(u);
  ib.extend_pressure(p);
  const auto x = on_host(grid.x), u_host = on_host(u);
  const auto p_host = on_host(p);
  const auto node = on_host(ib.velocity_stencils().node);
  Errors e;
  for (int k = 0; k < ib.counts().immersed; ++k) {
    const Vec3 at = load(x, node(k));
    const double du = norm(load(u_host, node(k)) - u_exact(at)), dp = std::fabs(p_host(node(k)) - p_exact(at));
    REQUIRE(std::isfinite(du));
    REQUIRE(std::isfinite(dp));
    e.u_max = larger(e.u_max, du);
    e.p_max = larger(e.p_max, dp);
    e.u_rms += du * du / ib.counts().immersed;
    e.p_rms += dp * dp / ib.counts().immersed;
  }
  e.u_rms = std::sqrt(e.u_rms);
  e.p_rms = std::sqrt(e.p_rms);
  return e;
}

}  // namespace

TEST_CASE("linear fields are reconstructed exactly") {
  const Vec3 h{0.31, 0.31, 0.9};
  // A trilinear lattice is not linear on a wavy grid, but its map and its fields are interpolated alike.
  const Mapping mappings[] = {skewed({-6.0, -4.3, -8.0}, h), wavy({-5.0, -5.0, -7.2}, h)};
  for (const Mapping& mapping : mappings) {
    const GridViews grid = make_grid({{32, 32, 16}}, mapping);
    const SurfaceSet surface = make_surface_set({biconcave(3, {0.02, 0.01, -0.03}, 0.4)});
    ImmersedBoundary ib(grid, surface, {});
    const Errors e = reconstruct(grid, ib, surface, linear_velocity, linear_pressure);
    const auto& rows = ib.counts().velocity_rows;
    // Rows with a slope along the normal only, or the surface's value, are not exact; this scene needs none.
    REQUIRE(rows[int(RowKind::normal_only)] + rows[int(RowKind::surface_only)] == 0);
    REQUIRE(ib.counts().pressure_rows[int(RowKind::normal_only)] == 0);
    // Field values of order five, weights of order one; Newton inverts the lattice map to 1e-9 nodes squared.
    CHECK(e.u_max < 1e-11);
    CHECK(e.p_max < 1e-11);
  }
}

TEST_CASE("errors of smooth fields fall with the square of the spacing") {
  const double k = 0.9;
  const VectorField u = [=](const Vec3& x) {
    return Vec3{std::sin(k * x.y) * std::cos(k * x.z), std::sin(k * x.z + 0.3), std::cos(k * x.x) * std::sin(k * x.y)};
  };
  const ScalarField p = [=](const Vec3& x) { return std::sin(k * x.x + 0.2) * std::cos(k * x.z); };
  const int levels = 3;
  Errors e[levels];
  for (int level = 0; level < levels; ++level) {
    const int n = 16 << level;
    const double h = 5.0 / n;
    const GridViews grid = make_grid({{n, n, n}}, uniform({-2.5, -2.5, -2.5}, {h, h, h}));
    // Fine enough that interpolation of its velocity between vertices does not enter.
    const SurfaceSet surface = make_surface_set({sphere(5, 1.2, {0.013, 0.021, -0.017})});
    ImmersedBoundary ib(grid, surface, {});
    e[level] = reconstruct(grid, ib, surface, u, p);
  }
  // Second order is the aim (measured 1.85 to 2.4); the pressure is extrapolated.
  CHECK(std::log2(e[1].u_rms / e[2].u_rms) > 1.8);
  CHECK(std::log2(e[1].p_rms / e[2].p_rms) > 1.8);
  CHECK(std::log2(e[0].u_rms / e[1].u_rms) > 1.7);
  // k h = 0.07 on the finest grid: errors of a few times (k h)^2 / 8.
  CHECK(e[2].u_max < 5e-3);
  CHECK(e[2].p_max < 1e-2);
}

TEST_CASE("velocities quadratic along the normal of a flat plate are exact with two probes") {
  // A flat box: away from its edges every normal is z, and the profile is a parabola in z.
  TriangleMesh plate;
  for (int corner = 0; corner < 8; ++corner) {
    plate.vertices.push_back({corner & 1 ? 2.0 : -2.0, corner & 2 ? 2.0 : -2.0, corner & 4 ? 0.13 : -0.9});
  }
  plate.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const GridViews grid = make_grid({{20, 20, 20}}, uniform({-3, -3, -3}, {0.3, 0.3, 0.3}));
  const SurfaceSet surface = make_surface_set({plate});
  const VectorField parabola = [](const Vec3& x) { return Vec3{(x.z - 0.13) * (2.7 - x.z), 0, 0}; };
  ImmersedBoundary ib(grid, surface, {});
  ib.classify();
  ib.build_stencils();
  const auto kind = on_host(ib.nodes().kind);
  const auto u = sample(grid.x, parabola, [&](int c) { return kind(c) != NodeKind::immersed; });
  ib.reconstruct_velocity(u);
  const auto u_host = on_host(u), x = on_host(grid.x);
  const auto node = on_host(ib.velocity_stencils().node);
  int compared = 0;
  for (int k = 0; k < ib.counts().immersed; ++k) {
    const Vec3 at = load(x, node(k));
    if (at.z < 0.13 || std::fabs(at.x) > 1.2 || std::fabs(at.y) > 1.2) continue;
    ++compared;
    REQUIRE(norm(load(u_host, node(k)) - parabola(at)) < 1e-12);  // round-off: values of order one
  }
  CHECK(compared > 40);
}

TEST_CASE("stencils keep to their own side of a thin film") {
  // Opposite constant velocities above and below the dimple, where a single grid link spans both faces.
  const GridViews grid = make_grid({{30, 30, 14}}, uniform({-4.65, -4.65, -6.3}, {0.31, 0.31, 0.9}));
  const SurfaceSet surface = make_surface_set({biconcave(3, {0.02, 0.01, 0.0})});
  const VectorField sided = [](const Vec3& x) { return Vec3{0, 0, x.z > 0 ? 1.0 : -1.0}; };
  ImmersedBoundary ib(grid, surface, {});
  set_velocity(surface, sided);
  ib.classify();
  ib.build_stencils();
  const auto kind = on_host(ib.nodes().kind);
  const auto u = sample(grid.x, sided, [&](int c) { return kind(c) == NodeKind::fluid || kind(c) == NodeKind::boundary; });
  const auto p =
      sample(grid.x, ScalarField([](const Vec3& x) { return x.z > 0 ? 1.0 : -1.0; }), [&](int c) { return kind(c) == NodeKind::fluid; });
  ib.reconstruct_velocity(u);
  ib.extend_pressure(p);
  const auto u_host = on_host(u), x = on_host(grid.x);
  const auto p_host = on_host(p);
  const auto node = on_host(ib.velocity_stencils().node);
  int compared = 0;
  for (int k = 0; k < ib.counts().immersed; ++k) {
    const Vec3 at = load(x, node(k));
    if (std::hypot(at.x, at.y) > 3.0) continue;  // near the rim both sides meet
    ++compared;
    const double side = at.z > 0 ? 1 : -1;
    REQUIRE(u_host(node(k), 2) == Approx(side).epsilon(1e-12));
    REQUIRE(p_host(node(k)) == Approx(side).epsilon(1e-12));
  }
  CHECK(compared > 200);
}

TEST_CASE("a gap too narrow for any stencil falls back and says so") {
  // Two spheres half a node apart: some nodes between them have no fluid on their side.
  const GridViews grid = make_grid({{28, 20, 20}}, uniform({-4.2, -3, -3}, {0.3, 0.3, 0.3}));
  const SurfaceSet surface = make_surface_set({sphere(3, 1.5, {-1.575, 0, 0}), sphere(3, 1.5, {1.575, 0, 0})});
  ImmersedBoundary ib(grid, surface, {});
  const VectorField constant = [](const Vec3&) { return Vec3{1, 2, 3}; };
  const Errors e = reconstruct(grid, ib, surface, constant, [](const Vec3&) { return 0.5; });
  const auto& rows = ib.counts().velocity_rows;
  int total = 0;
  for (int k = 0; k < row_kinds; ++k) total += rows[k];
  CHECK(total == ib.counts().immersed);
  CHECK(rows[int(RowKind::quadratic)] < total);
  CHECK(e.u_max < 1e-12);  // every kind of row keeps a constant, to round-off
}

TEST_CASE("the same scene gives the same bits twice") {
  const GridViews grid = make_grid({{30, 30, 14}}, wavy({-4.65, -4.65, -6.3}, {0.31, 0.31, 0.9}));
  const SurfaceSet surface = make_surface_set({biconcave(3, {0.02, 0.01, 0.0}, 0.3)});
  ImmersedBoundary first(grid, surface, {}), second(grid, surface, {});
  const VectorField u = [](const Vec3& x) { return Vec3{std::sin(x.x), std::cos(x.y * x.z), x.z * x.x}; };
  const Errors a = reconstruct(grid, first, surface, u, linear_pressure);
  const Errors b = reconstruct(grid, second, surface, u, linear_pressure);
  second.classify();
  second.build_stencils();
  CHECK(a.u_rms == b.u_rms);
  CHECK(a.p_rms == b.p_rms);
  const auto c1 = on_host(first.velocity_stencils().column), c2 = on_host(second.velocity_stencils().column);
  const auto w1 = on_host(first.velocity_stencils().weight), w2 = on_host(second.velocity_stencils().weight);
  const auto f1 = on_host(first.faces().cell), f2 = on_host(second.faces().cell);
  REQUIRE(first.counts().immersed == second.counts().immersed);
  for (int n = 0; n < first.counts().immersed; ++n) {
    for (int k = 0; k < stencil_width; ++k) {
      REQUIRE(c1(n, k) == c2(n, k));
      REQUIRE(w1(n, k) == w2(n, k));
    }
  }
  for (int n = 0; n < first.counts().faces; ++n) REQUIRE(f1(n) == f2(n));
}
