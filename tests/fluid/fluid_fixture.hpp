// Scenes and helpers that the fluid tests share.
#pragma once

#include <cmath>

#include "fluid/flow_balances.hpp"
#include "fluid/integrals.hpp"

namespace corpuscle::fluid_test {

using Side = BoundarySettings::Side;
using Type = BoundarySettings::Type;

/// One entry per side, in the order i_min, i_max, j_min, j_max, k_min, k_max.
inline std::vector<BoundarySettings> sides(const std::array<Type, 6>& types) {
  std::vector<BoundarySettings> all(6);
  for (int s = 0; s < 6; ++s) {
    all[s].side = static_cast<Side>(s);
    all[s].type = types[s];
    if (types[s] == Type::moving_wall) all[s].velocity = Triple{0, 0, 0};
  }
  return all;
}

inline GridSettings box(const std::array<int, 3>& cells, const Triple& upper) {
  GridSettings s;
  s.generator = GridSettings::Generator::box;
  for (int d = 0; d < 3; ++d) s.nodes[d] = cells[d] + 1;
  s.upper_um = upper;
  return s;
}

inline GridSettings tube(int across, int along, GridSettings::CrossSection map = GridSettings::CrossSection::conformal) {
  GridSettings s;
  s.generator = GridSettings::Generator::straight_tube;
  s.nodes = {across + 1, across + 1, along + 1};
  s.diameter_um = 10;
  s.length_um = 45;
  s.cross_section = map;
  return s;
}

/// The tube's conditions: inlet of mean speed 2 mm/s at k_min, outflow at k_max, walls around.
inline std::vector<BoundarySettings> tube_sides(double ramp_us) {
  auto all = sides({Type::wall, Type::wall, Type::wall, Type::wall, Type::velocity_inlet, Type::outflow});
  all[4].speed = 2e-3;
  all[4].ramp_us = ramp_us;
  return all;
}

/// Box of side 2 um, sheared and warped inside and outside: no two faces are parallel.
inline NodeSource warped_box(const std::array<int, 3>& cells) {
  return {cells, [cells](int i, int j, int k) {
            const double u = 2.0 * i / cells[0], v = 2.0 * j / cells[1], w = 2.0 * k / cells[2];
            return Triple{u + 0.3 * v + 0.05 * std::sin(2.1 * w + u), v + 0.2 * w - 0.06 * std::sin(1.7 * u),
                          w + 0.15 * u + 0.05 * std::sin(1.9 * v + 0.4)};
          }};
}

inline auto on_host(const Components<double>& view) { return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view); }
inline auto on_host(const Array<double>& view) { return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view); }

/// body(i, j, k, c) for every owned cell, on the host.
template <class Body>
void visit_owned(const IndexSpace& index, const Body& body) {
  for (int k = 0; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) body(i, j, k, index.cell(i, j, k));
}

/// Divergence of the face fluxes after the last step over U h^2.
inline double divergence_over_uh2(FluidSolver& solver) {
  const double h = solver.grid().mean_spacing();
  return solver.statistics().divergence / (solver.statistics().reference_speed * h * h);
}

}  // namespace corpuscle::fluid_test
