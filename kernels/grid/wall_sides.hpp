// Which sides of the grid are walls.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

/// [direction][low, high] whether that side is a wall.
struct WallSides {
  bool wall[3][2] = {};
  KOKKOS_INLINE_FUNCTION bool any() const { return wall[0][0] || wall[0][1] || wall[1][0] || wall[1][1] || wall[2][0] || wall[2][1]; }
};

}  // namespace corpuscle
