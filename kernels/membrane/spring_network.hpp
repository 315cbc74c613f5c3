// In-plane elasticity from springs along the edges, of any law.
#pragma once

#include "common/extremes.hpp"
#include "membrane/triangle_shape.hpp"

namespace corpuscle {

/// Each triangle has half of each of its sides' springs; the other half comes from the triangle across.
/// @tparam Spring  the constants of one cell type, with force(length, rest_length) along the link, nN, positive where it
///                 pulls; energy(length, rest_length), fJ; strain(length, rest_length); stiffening(length, rest_length); and
///                 limit of the strain
template <class Spring>
struct SpringNetwork {
  static constexpr double limit = Spring::limit;
  static constexpr bool holds_area = true;
  Spring spring;

  KOKKOS_INLINE_FUNCTION double strain(const TriangleShape& s, const TriangleRest& rest) const {
    double largest = 0;
    for (int k = 0; k < 3; ++k) {
      largest = larger(largest, spring.strain(s.length[k], rest.length[k]));
    }
    return largest;
  }

  KOKKOS_INLINE_FUNCTION double add_forces(const TriangleShape& s, const TriangleRest& rest, Vec3 (&force)[3]) const {
    for (int k = 0; k < 3; ++k) {
      const double inverse = 1 / s.length[k];
      const Vec3 pull = (0.5 * spring.force(s.length[k], rest.length[k]) * inverse) * s.side[k];
      force[(k + 1) % 3] += pull;
      force[(k + 2) % 3] -= pull;
    }
    return strain(s, rest);
  }

  KOKKOS_INLINE_FUNCTION double stiffening(const TriangleShape& s, const TriangleRest& rest) const {
    double most = 0;
    for (int k = 0; k < 3; ++k) most = larger(most, spring.stiffening(s.length[k], rest.length[k]));
    return most;
  }

  KOKKOS_INLINE_FUNCTION double energy(const TriangleShape& s, const TriangleRest& rest) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += 0.5 * spring.energy(s.length[k], rest.length[k]);
    return sum;
  }
};

}  // namespace corpuscle
