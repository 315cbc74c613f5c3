// Stencils and tractions where little fluid is left between two bodies.
#include <catch2/catch.hpp>

#include "brute_force.hpp"

using namespace corpuscle;
using namespace scene;

namespace {

/// Two spheres of radius 1.5 um, side by side along x, so many spacings apart, on a grid moved by a share of a spacing.
struct Gap {
  GridViews grid;
  SurfaceSet surface;
  ImmersedBoundary ib;
  Components<double> u;
  Array<double> p;

  Gap(double h, double spacings, double moved, const VectorField& velocity, double pressure)
      : grid(make_grid({{28, 20, 20}}, uniform({(moved - 14) * h, -10 * h, -10 * h}, {h, h, h}))),
        surface(make_surface_set(
            {sphere(3, 1.5, {-1.5 - spacings * h / 2, 0.01, 0.02}), sphere(3, 1.5, {1.5 + spacings * h / 2, 0.01, 0.02})})),
        ib(grid, surface, {}) {
    set_velocity(surface, velocity);
    ib.classify();
    ib.build_stencils();
    const auto kind = on_host(ib.nodes().kind);
    u = sample(grid.x, velocity, [&](int c) { return kind(c) == NodeKind::fluid || kind(c) == NodeKind::boundary; });
    p = sample(grid.x, ScalarField([=](const Vec3&) { return pressure; }), [&](int c) { return kind(c) == NodeKind::fluid; });
    ib.reconstruct_velocity(u);
    ib.extend_pressure(p);
  }
};

// Sheared along the line of centres.
const VectorField shear = [](const Vec3& x) { return Vec3{0, 0.7 * x.x, 0}; };

}  // namespace

TEST_CASE("a slope along the normal alone is that of the flow") {
  // At the poles, a fifth of a spacing apart, all that is left of the fluid lies on the line of centres.
  Gap gap(0.5, 0.2, 0, shear, 2.5);
  TractionInput in;
  in.u = gap.u, in.p = gap.p;
  in.viscosity = 1.3;
  const auto stress = on_host(gap.ib.find_stress(in).values);
  const auto normal = on_host(gap.surface.normal);
  const auto how = gap.ib.traction_fallbacks();
  REQUIRE(how[traction_normal] > 0);
  REQUIRE(how[traction_nothing] == 0);
  // Their pressure is none of the nodes': it comes from the vertices around.
  REQUIRE(how[pressure_nothing] > 0);
  const SurfaceStress whole = make_surface_stress("corpuscle::test::stress", gap.surface.vertices);
  CHECK(complete_stress(gap.surface, gap.ib.found_stress(), whole,
                        Components<double>("corpuscle::test::traction", gap.surface.vertices, 3)) == no_vertex);
  const auto pressure = on_host(whole.values);
  for (int v = 0; v < gap.surface.vertices; ++v) {
    const Vec3 n = load(normal, v);
    INFO("vertex " << v);
    // Round-off: on the line of centres even the slope alone is exact for a linear flow.
    REQUIRE(norm(Vec3{stress(v, 1), stress(v, 2), stress(v, 3)} - 1.3 * 0.7 * Vec3{n.y, n.x, 0}) < 1e-9);
    REQUIRE(pressure(v, 0) == Approx(2.5).epsilon(1e-12));
  }
}

TEST_CASE("a surface that moves is resisted, wherever the nodes around it lie") {
  // Two cells in a row, their rims a spacing of a grid apart that is coarser along the row, as cells in a tube are: in the film the
  // nodes lie in one plane, and a fit of second order through them and a few farther ones leans to either side.
  const double h = 0.58, along = 1.875;
  for (const auto& [tilt, moved] : {std::pair{0.0, 0.1}, std::pair{0.6, 0.0}, std::pair{0.6, 0.8}}) {
    const GridViews grid = make_grid({{20, 20, 16}}, uniform({-9.5 * h, -9.5 * h, (moved - 9.5) * along}, {h, h, along}));
    const SurfaceSet surface = make_surface_set({biconcave(3, {}, tilt), biconcave(3, {0, 0, -4.4}, tilt)});
    ImmersedBoundary ib(grid, surface, {});
    ib.classify();
    ib.build_stencils();
    const auto normal = on_host(surface.normal);
    Kokkos::deep_copy(surface.v, surface.normal);
    TractionInput in;
    in.u = sample(
        grid.x, [](const Vec3&) { return Vec3{}; }, [](int) { return true; });
    in.p = sample(grid.x, ScalarField([](const Vec3&) { return 0.0; }), [](int) { return true; });
    in.viscosity = 1;
    const auto stress = on_host(ib.find_stress(in).values);
    for (int i = 0; i < surface.vertices; ++i) {
      const Vec3 n = load(normal, i);
      INFO("tilt " << tilt << ", moved by " << moved << " spacings, vertex " << i << ", normal (" << n.x << ", " << n.y << ", " << n.z
                   << ")");
      // The least: a line from the surface to a point 2.5 spacings away, along the normal.
      const double spacing = 1 / std::max({std::abs(n.x) / h, std::abs(n.y) / h, std::abs(n.z) / along});
      CHECK(dot(Vec3{stress(i, 1), stress(i, 2), stress(i, 3)}, n) < -2 / (2.5 * spacing) * (1 - 1e-9));
    }
  }
}

TEST_CASE("velocities from a slope along the normal alone lean to the right side") {
  Gap gap(0.3, 0.5, 0.3, shear, 1);
  REQUIRE(gap.ib.counts().velocity_rows[int(RowKind::normal_only)] > 0);
  REQUIRE(gap.ib.counts().pressure_rows[int(RowKind::normal_only)] > 0);
  const auto& rows = gap.ib.velocity_stencils();
  const auto node = on_host(rows.node);
  const auto kind = on_host(rows.kind);
  const auto u = on_host(gap.u), x = on_host(gap.grid.x), foot = on_host(gap.ib.band().foot);
  const auto p = on_host(gap.p);
  for (int r = 0; r < gap.ib.counts().immersed; ++r) {
    const int c = node(r);
    REQUIRE(p(c) == Approx(1).epsilon(1e-12));
    if (kind(r) != RowKind::normal_only) continue;
    const Vec3 at_surface = shear(load(foot, c)), exact = shear(load(x, c)) - at_surface;
    if (norm(exact) < 1e-3) continue;
    INFO("node at " << x(c, 0) << ", " << x(c, 1) << ", " << x(c, 2) << ": " << (load(u, c) - at_surface).y << " of " << exact.y);
    CHECK(dot(load(u, c) - at_surface, exact) > 0);
  }
}
