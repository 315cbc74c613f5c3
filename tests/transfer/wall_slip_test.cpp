// The slip correction beside a wall, where the kernel is folded back.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "../fluid/fluid_fixture.hpp"
#include "cells/rank_blocks.hpp"
#include "held_surface.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

constexpr int n = 4, high = 8;                       // cells along and across, of 1 um
constexpr int along = 2 * n, count = along * along;  // markers

/// A plate of markers between walls, `gap` from one of them, with its copies beyond the periodic sides. On every rank by itself:
/// the grid is too small to be cut.
struct Plate {
  Plate(double gap, const Vec3& normal_of, const Vec3& force_per_area)
      : boundaries(sides({Type::periodic, Type::periodic, Type::wall, Type::wall, Type::periodic, Type::periodic})),
        grid(Comm::alone(), make_node_source(nodes()), {true, false, true}),
        shifts(period_shifts(grid)),
        vertices(count * static_cast<int>(shifts.size())),
        transfer(grid, boundaries, CouplingSettings::Kernel::three_point, vertices) {
    set.vertices = vertices;
    set.x = Components<double>("corpuscle::test::x", vertices, 3);
    set.normal = Components<double>("corpuscle::test::normal", vertices, 3);
    set.area = Array<double>("corpuscle::test::area", vertices);
    force = Components<double>("corpuscle::test::force", vertices, 3);
    velocity = Components<double>("corpuscle::test::velocity", vertices, 3);
    const auto x = Kokkos::create_mirror_view(set.x), normal = Kokkos::create_mirror_view(set.normal),
               f = Kokkos::create_mirror_view(force);
    for (int v = 0; v < vertices; ++v) {
      store(x, v, Vec3{0.13 + 0.5 * (v % along), gap, 0.07 + 0.5 * (v % count / along)} + shifts[v / count]);
      store(normal, v, normal_of);
      store(f, v, 0.25 * force_per_area);
    }
    Kokkos::deep_copy(set.x, x);
    Kokkos::deep_copy(set.normal, normal);
    Kokkos::deep_copy(set.area, 0.25);
    Kokkos::deep_copy(force, f);
    REQUIRE(transfer.place(set.x) == -1);
  }
  static GridSettings nodes() {
    auto settings = box({n, high, n}, {n, high, n});
    settings.lower_um = {0, 0, 0}, settings.upper_um = {n, high, n};
    return settings;
  }
  Vec3 mean(const Array<double> (&flux)[3], const Components<double>& u, double viscosity, bool slip) {
    const SlipViews correction = transfer.slip(set, force, viscosity);
    transfer.interpolate(flux, u, slip ? &correction : nullptr, velocity);
    const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), velocity);
    Vec3 sum;
    for (int i = 0; i < vertices; ++i) sum += (1.0 / count) * load(v, i);  // each has what is at home of it
    return sum;
  }

  std::vector<BoundarySettings> boundaries;
  Grid grid;
  std::vector<Vec3> shifts;
  int vertices;
  Transfer transfer;
  SurfaceSet set;
  Components<double> force, velocity;
};

/// Mean speed of a plate along a wall, for a force per area of viscosity over spacing.
struct PlateSpeeds {
  double without, with, exact;
};
PlateSpeeds plate_speeds(double gap) {
  FluidSettings settings;
  settings.convection = FluidSettings::Convection::none;
  settings.momentum_tolerance = settings.divergence_tolerance = 1e-10;
  Plate plate(gap, {0, 1, 0}, {settings.kinematic_viscosity_um2_per_us, 0, 0});
  FluidSolver fluid(plate.grid, settings, plate.boundaries);
  fluid.set_face_force(plate.transfer.faces());
  fluid.raise_reference_speed(1);
  plate.transfer.spread(plate.force);
  for (int s = 0; s < 6; ++s) {
    fluid.begin_step(1e4);
    fluid.solve(1e4 * (s + 1), nullptr);
  }
  return {plate.mean(fluid.flux(), fluid.velocity(), fluid.viscosity(), false).x,
          plate.mean(fluid.flux(), fluid.velocity(), fluid.viscosity(), true).x, gap * (high - gap) / high};
}

}  // namespace

TEST_CASE("the slip correction is right beside a wall, down to no gap", "[transfer]") {
  // Without it the plate is too slow by a tenth of a spacing's shear at all gaps, and by half as much again at half a spacing.
  for (double gap : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0, 1.4, 2.0}) {
    const PlateSpeeds speed = plate_speeds(gap);
    if (std::getenv("CORPUSCLE_SHOW"))
      WARN(fmt::format("gap {} h: {:+.3f} h without slip, {:+.3f} h with", gap, speed.without - speed.exact, speed.with - speed.exact));
    INFO("gap " << gap << " h");
    CHECK(std::abs(speed.with - speed.exact) < 0.055);  // of up to 0.15
    if (gap >= 0.5) CHECK(speed.without - speed.exact < -0.07);
  }
}

TEST_CASE("slip carries no membrane through a wall", "[transfer]") {
  // Inclined to the wall, its slip has a part across it.
  for (double gap : {0.2, 0.5, 1.0, 2.5}) {
    Plate plate(gap, {0, std::sqrt(0.5), std::sqrt(0.5)}, {0, -1, 1});
    Array<double> flux[3];
    for (auto& through : flux) through = Array<double>("corpuscle::test::flux", plate.grid.index().size());
    const Components<double> u("corpuscle::test::u", plate.grid.index().size(), 3);
    const Vec3 v = plate.mean(flux, u, 1, true);
    INFO("gap " << gap << " h");
    const double rounding = 1e-12 * norm(v);
    CHECK(v.y < rounding);
    CHECK((v.y > -rounding) == (gap <= 0.5));
    if (gap > 1.5) CHECK(v.y == Approx(-v.z));
  }
}
