// Grids that the tests of this folder share.
#pragma once

#include <cmath>

#include "grid/grid.hpp"

namespace corpuscle::grid_test {

inline GridSettings tube_settings(int across, int along, GridSettings::CrossSection map) {
  GridSettings s;
  s.generator = GridSettings::Generator::straight_tube;
  s.nodes = {across + 1, across + 1, along + 1};
  s.diameter_um = 10;
  s.length_um = 20;
  s.cross_section = map;
  return s;
}

/// Unit box whose inner nodes are moved by up to 0.2 spacings, by a fixed rule without any symmetry: faces are not
/// flat.
inline NodeSource crumpled_box(const std::array<int, 3>& cells) {
  return {cells, [cells](int i, int j, int k) {
            const int at[3] = {i, j, k};
            Triple x;
            for (int d = 0; d < 3; ++d) {
              const bool inner = at[d] > 0 && at[d] < cells[d];
              const double wave = std::sin(1.3 * i + 2.1 * j + 0.7 * k + 1.9 * d) * std::cos(0.9 * i - 1.7 * k + d);
              x[d] = (at[d] + (inner ? 0.2 * wave : 0.0)) / cells[d];
            }
            return x;
          }};
}

/// Unit box under a linear map: a grid whose every cell is the same parallelepiped.
inline NodeSource sheared_box(int cells, double shear) {
  return {{cells, cells, cells}, [=](int i, int j, int k) {
            const double s = 1.0 / cells;
            return Triple{s * (i + shear * j), s * j, s * k};
          }};
}

}  // namespace corpuscle::grid_test
