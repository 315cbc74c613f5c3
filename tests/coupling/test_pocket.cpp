// A body whose folds close in fluid, on the grid, that has no way out.
#include <catch2/catch.hpp>

#include "scenes.hpp"

#include <fmt/format.h>

namespace corpuscle {
namespace {

using Profile = std::vector<std::array<double, 2>>;  // corners (r, z), from the axis around to the axis

/// A profile turned about z.
TriangleMesh turned(const Profile& corner) {
  constexpr int around = 48;
  Profile profile{corner[0]};
  for (std::size_t n = 1; n < corner.size(); ++n) {
    const auto &a = corner[n - 1], &b = corner[n];
    const int pieces = std::max(1, static_cast<int>(std::ceil(std::hypot(b[0] - a[0], b[1] - a[1]))));
    for (int i = 1; i <= pieces; ++i) profile.push_back({a[0] + (b[0] - a[0]) * i / pieces, a[1] + (b[1] - a[1]) * i / pieces});
  }
  TriangleMesh mesh;
  std::vector<std::array<int, around>> rings;
  for (const auto& [r, z] : profile) {
    auto& ring = rings.emplace_back();
    for (int k = 0; k < around; ++k) {
      const double turn = 2 * std::acos(-1.0) * k / around;
      if (r > 0 || k == 0) mesh.vertices.push_back({r * std::cos(turn), r * std::sin(turn), z});
      ring[k] = static_cast<int>(mesh.vertices.size()) - 1;
    }
  }
  for (std::size_t n = 0; n + 1 < rings.size(); ++n)
    for (int k = 0; k < around; ++k) {
      const auto &a = rings[n], &b = rings[n + 1];
      const int l = (k + 1) % around;
      if (a[k] != a[l]) mesh.triangles.push_back({a[l], a[k], b[k]});
      if (b[k] != b[l]) mesh.triangles.push_back({b[l], a[l], b[k]});
    }
  return mesh;
}

/// A thick cone with a cavity that a channel narrower than the grid's spacing joins to the outside; one with a channel of two
/// nodes across that is closed at its end, all of it within the band beside the surface.
const Profile bottle{{0, -13.55}, {5, -13.55}, {5, -11.45}, {0.6, -11.45}, {0.6, 1.3}, {2, 1.8}, {14, -14}, {0, -18}};
const Profile cup{{0, -13.55}, {1.6, -13.55}, {1.6, 9.3}, {3, 9.8}, {14, -14}, {0, -18}};

}  // namespace

TEST_CASE("fluid that a body closes in is found on any number of ranks, and its pressure counts nowhere", "[coupling][ranks]") {
  GridSettings box = scenes::cube(40, 40);
  box.nodes[2] = 65, box.lower_um[2] = -32, box.upper_um[2] = 32;
  Grid grid(Comm(), make_node_source(box), {false, false, false});
  auto sides = scenes::sides(BoundarySettings::Type::wall);
  sides[4].type = BoundarySettings::Type::velocity_inlet, sides[4].speed = 2e-3;
  sides[5].type = BoundarySettings::Type::outflow;
  FluidSolver fluid(grid, FluidSettings{}, sides);
  Timers timers;
  {  // A rank that holds the bottom of the cup does not know that it is open.
    const SurfaceSet surfaces = make_surface_set({turned(cup)});
    ImmersedFlow flow(fluid, surfaces, {}, timers);
    flow.update_geometry(0.5);
    CHECK(grid.comm().sum(static_cast<long>(flow.boundary().counts().isolated)) == 0);
  }
  const SurfaceSet surfaces = make_surface_set({turned(bottle)});
  ImmersedFlow flow(fluid, surfaces, {}, timers);
  flow.update_geometry(0.5);
  // As on one rank: 52 nodes of the cavity and of the channel.
  auto& boundary = flow.boundary();
  CHECK(grid.comm().sum(static_cast<long>(boundary.counts().isolated)) == 52);
  fluid.check_connected();

  // A pressure of one in the fluid, and of anything at the nodes that no fluid node informs.
  TractionInput in;
  in.u = Components<double>("corpuscle::test::u", grid.index().size(), 3);
  in.p = Array<double>("corpuscle::test::p", grid.index().size());
  in.viscosity = 1;
  const auto kind = fluid.kind();
  const auto p = in.p;
  Kokkos::parallel_for(
      "corpuscle::test::fill", Policy(0, grid.index().size()), KOKKOS_LAMBDA(int c) { p(c) = kind(c) == NodeKind::fluid ? 1 : -7; });
  boundary.extend_pressure(in.p);
  grid.halo().exchange(in.p);
  const auto stress = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), boundary.find_stress(in).values);
  long without = 0;
  double largest = 0;
  for (int v = 0; v < surfaces.vertices; ++v) {
    if (!has_pressure(stress(v, 0)))
      ++without;
    else if (stress(v, 0) != 0)  // another rank's vertex has none here
      largest = std::max(largest, std::abs(stress(v, 0) - 1));
  }
  CHECK(grid.comm().max(largest) < 1e-9);
  CHECK(grid.comm().sum(without) > 300);  // the cavity's
}

}  // namespace corpuscle
