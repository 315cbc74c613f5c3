// The grid spacing that a coupling's default goes by.
#include <catch2/catch.hpp>

#include "scenes.hpp"

namespace corpuscle {
TEST_CASE("the smallest spacing at a surface is that of the grid beside it, wherever the surface lies", "[coupling][ranks]") {
  // Along k, which is periodic, cells are 0.5 um long at the ends and 1.5 um in the middle, or the other way round, so that no
  // node that a mistaken place would name, the first one say, passes for the right one in both; 1.5 um across.
  constexpr int along = 24;
  for (const double sign : {1.0, -1.0}) {
    const auto z = [&](double k) {
      const double turn = 2 * std::acos(-1.0) / along;
      return k - sign * 0.5 / turn * std::sin(turn * k);
    };
    const NodeSource source{{12, 12, along}, [&](int i, int j, int k) { return Triple{1.5 * i - 9, 1.5 * j - 9, z(k)}; }};
    Grid grid(Comm(), source, {false, false, true});
    auto sides = scenes::sides(BoundarySettings::Type::wall);
    sides[4].type = sides[5].type = BoundarySettings::Type::periodic;
    FluidSolver fluid(grid, FluidSettings{}, sides);
    for (const double at : {12.0, 0.1, 23.8, 5.0, 19.0}) {
      BodySettings body = scenes::sphere(3);
      body.center_um = {0.2, 0.1, at};
      body.vertices = 300;
      const TriangleMesh mesh = make_body_mesh(body, 1);
      double expected = 1e300;
      for (const auto& vertex : mesh.vertices) {
        const double inside = vertex[2] - along * std::floor(vertex[2] / along);
        int nearest = 0;  // cell k has its centre between nodes k and k + 1
        const auto centre = [&](int k) { return 0.5 * (z(k) + z(k + 1)); };
        for (int k = -1; k <= along; ++k)
          if (std::abs(centre(k) - inside) < std::abs(centre(nearest) - inside)) nearest = k;
        expected = std::min(expected, 0.5 * (centre(nearest + 1) - centre(nearest - 1)));
      }
      const SurfaceSet surfaces = make_surface_set({mesh});
      Timers timers;
      ImmersedFlow flow(fluid, surfaces, {}, timers);
      flow.update_geometry(0.5);
      INFO("centre at " << at << " um, sign " << sign);
      // Nearest in index space, not in space: one node off where a vertex lies half-way, and cells grow by up to 13 %.
      CHECK(flow.smallest_spacing_at_surfaces() == Approx(std::min(expected, 1.5)).epsilon(0.07));
    }
  }
}

}  // namespace corpuscle
