// Where the pressure jumps across membranes that are forces.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "../fluid/fluid_fixture.hpp"
#include "held_surface.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using namespace corpuscle::testing;

namespace {

FluidSettings stokes() {
  FluidSettings settings;
  settings.density_pg_per_um3 = settings.kinematic_viscosity_um2_per_us = 1;
  settings.convection = FluidSettings::Convection::none;
  return settings;
}

/// A surface in a closed box of 21 spacings of 0.2 um each way, whose middle cell has its centre at the origin.
HeldSurface in_box(const TriangleMesh& mesh) {
  auto nodes = box({21, 21, 21}, {2.1, 2.1, 2.1});
  nodes.lower_um = {-2.1, -2.1, -2.1};
  const auto closed = sides({Type::wall, Type::wall, Type::wall, Type::wall, Type::wall, Type::wall});
  return HeldSurface(make_node_source(nodes), closed, stokes(), mesh, CouplingSettings::Kernel::three_point, true);
}

}  // namespace

TEST_CASE("a uniform load is the jump of one pressure, wherever vertices and edges lie", "[transfer][sharp]") {
  // An octahedron whose vertices are centres of cells and whose edges and faces go through others, and the same moved by less than
  // what positions are rounded to, and by more.
  const double moved = GENERATE(0.0, 3e-8, -1.3e-7, 2.1e-7, -5e-6, 1e-3);
  TriangleMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (Triple& p : mesh.vertices) p = {p[0] + moved, p[1] - 0.7 * moved, p[2] + 0.4 * moved};
  HeldSurface held = in_box(mesh);
  held.set_force([](const Vec3&, const Vec3& area) { return area; });
  held.transfer.place(held.surface.x);
  held.spread();
  const IndexSpace& index = held.grid.index();
  HostMirror<Array<double>> across[3];
  for (int d = 0; d < 3; ++d) across[d] = on_host(held.transfer.faces().across[d]);
  double round_trip = 0, to_middle[3] = {0, 0, 0};
  for (int k = 1; k < index.n[2]; ++k)
    for (int j = 1; j < index.n[1]; ++j)
      for (int i = 1; i < index.n[0]; ++i)
        for (int d = 0; d < 3; ++d) {
          const int e = (d + 1) % 3, c = index.cell(i, j, k), s = index.stride(d), t = index.stride(e);
          round_trip = std::max(round_trip, std::abs(across[d](c - t) + across[e](c) - across[d](c) - across[e](c - s)));
        }
  const int middle = 10;
  for (int d = 0; d < 3; ++d)
    for (int n = 1; n <= middle; ++n) {
      int at[3] = {middle, middle, middle};
      at[d] = n;
      to_middle[d] += across[d](index.cell(at[0], at[1], at[2]));
    }
  INFO("moved by " << moved);
  CHECK(round_trip < 1e-12);
  for (double change : to_middle) CHECK(change == Approx(-1).epsilon(1e-12));
}

TEST_CASE("loads that jump add up to nearly their sum", "[transfer][sharp]") {
  const double pull = GENERATE(1.0, 3.0);
  HeldSurface held = in_box(ellipsoid_mesh({1.3, 1, 0.77}, {0.03, -0.02, 0.01}, 0.14));
  held.set_force([&](const Vec3& x, const Vec3& area) { return std::exp(pull * x.z) * area; });
  held.transfer.place(held.surface.x);
  held.spread();
  const auto f = on_host(held.force);
  double sum = 0, size = 0, on_faces = 0;
  for (int v = 0; v < held.surface.vertices; ++v) sum += f(v, 2), size += std::abs(f(v, 2));
  const auto across = on_host(held.transfer.faces().across[2]);
  const IndexSpace& index = held.grid.index();
  for (int k = 1; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) on_faces += 0.04 * across(index.cell(i, j, k));
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("{:.6f} of {:.6f}, off by {:.2e} of the magnitudes", on_faces, sum, (on_faces - sum) / size));
  CHECK(std::abs(on_faces - sum) < 0.01 * size);
}
