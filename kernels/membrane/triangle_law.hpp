// In-plane elasticity of a triangle as a whole: an energy of the two invariants of its deformation from the triangle of
// rest, which is the same everywhere on it.
#pragma once

#include "membrane/triangle_shape.hpp"

namespace corpuscle {

/// Per area of the triangle at rest, of the principal stretches a and b: energy, nN/um, and its derivatives.
struct EnergyDensity {
  double value;
  double by_trace;  // by a^2 + b^2
  double by_ratio;  // by a b, the area over that at rest
};

/// a^2 + b^2 is a sum over the sides of the cotangent of the angle across, at rest, times the length squared, over twice
/// the area at rest (Pinkall & Polthier 1993: the Dirichlet energy of a linear map).
/// @tparam Energy  the constants of one cell type, with density(trace, ratio), stiffening(trace, ratio), and limit of the
///                 larger stretch
template <class Energy>
struct TriangleLaw {
  static constexpr double limit = Energy::limit;
  static constexpr bool holds_area = false;
  Energy material;

  /// Coefficients of the squared lengths in the trace, 1/um2.
  KOKKOS_INLINE_FUNCTION static void weights(const TriangleRest& rest, double (&weight)[3]) {
    const double scale = 1 / (8 * rest.area * rest.area);
    for (int k = 0; k < 3; ++k) {
      const double a = rest.length[(k + 1) % 3], b = rest.length[(k + 2) % 3], c = rest.length[k];
      weight[k] = (a * a + b * b - c * c) * scale;
    }
  }
  KOKKOS_INLINE_FUNCTION static double trace(const TriangleShape& s, const double (&weight)[3]) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += weight[k] * s.length[k] * s.length[k];
    return sum;
  }

  KOKKOS_INLINE_FUNCTION static double largest_stretch(double trace, double ratio) {
    const double difference = 0.25 * trace * trace - ratio * ratio;
    const double square = 0.5 * trace + std::sqrt(difference > 0 ? difference : 0);
    return std::sqrt(square);
  }
  KOKKOS_INLINE_FUNCTION double strain(const TriangleShape& s, const TriangleRest& rest) const {
    double weight[3];
    weights(rest, weight);
    return largest_stretch(trace(s, weight), s.area / rest.area);
  }

  KOKKOS_INLINE_FUNCTION double add_forces(const TriangleShape& s, const TriangleRest& rest, Vec3 (&force)[3]) const {
    double weight[3];
    weights(rest, weight);
    const double i1 = trace(s, weight), ratio = s.area / rest.area;
    const EnergyDensity w = material.density(i1, ratio);
    for (int k = 0; k < 3; ++k) {
      const Vec3 pull = (2 * rest.area * w.by_trace * weight[k]) * s.side[k];
      force[(k + 1) % 3] += pull;
      force[(k + 2) % 3] -= pull;
      // dA/dx of a corner is n x (opposite side) / 2.
      force[k] -= (0.5 * w.by_ratio) * cross(s.normal, s.side[k]);
    }
    return largest_stretch(i1, ratio);
  }

  KOKKOS_INLINE_FUNCTION double stiffening(const TriangleShape& s, const TriangleRest& rest) const {
    double weight[3];
    weights(rest, weight);
    return material.stiffening(trace(s, weight), s.area / rest.area);
  }

  KOKKOS_INLINE_FUNCTION double energy(const TriangleShape& s, const TriangleRest& rest) const {
    double weight[3];
    weights(rest, weight);
    return rest.area * material.density(trace(s, weight), s.area / rest.area).value;
  }
};

}  // namespace corpuscle
