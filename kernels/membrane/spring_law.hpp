// The spectrin links: worm-like chain attraction and power-law repulsion (Equations 5 and 6), for one edge.
#pragma once

#include "membrane/spring_network.hpp"

namespace corpuscle {

/// A link is its rest length l0 alone: the contour length is l_m = 2.2 l0, the persistence length p is such that p l0
/// is the same for all links (Equation 14, which keeps the shear modulus), and k_p makes the force vanish at l0.
struct WlcPowSpring {
  static constexpr double x0 = 1 / 2.2;  // l0 / l_m
  static constexpr double limit = 0.99;  // beyond this share of l_m the force is not evaluated: the step is refused

  double stiffness = 0;  // kT / (p l0), nN/um

  KOKKOS_INLINE_FUNCTION double force(double length, double rest_length) const;
  KOKKOS_INLINE_FUNCTION double energy(double length, double rest_length) const;
  /// The force's slope over that at rest.
  KOKKOS_INLINE_FUNCTION double stiffening(double length, double rest_length) const;
  /// Length over l_m.
  KOKKOS_INLINE_FUNCTION static double strain(double length, double rest_length) { return length / rest_length * x0; }
};

/// The law "wlc-pow".
using WlcPow = SpringNetwork<WlcPowSpring>;

/// The worm-like chain's force over kT / p (Equation 5, differentiated).
KOKKOS_INLINE_FUNCTION constexpr double wlc_shape(double x) { return 0.25 / ((1 - x) * (1 - x)) - 0.25 + x; }

/// Attraction along the link, nN: kT/p wlc_shape(x) - k_p / l^2, with k_p = kT/p wlc_shape(x0) l0^2.
/// Lengths beyond `limit` l_m are taken as `limit` l_m.
KOKKOS_INLINE_FUNCTION double WlcPowSpring::force(double length, double rest_length) const {
  const double ratio = length / rest_length;
  const double x = ratio * x0 < limit ? ratio * x0 : limit;
  return stiffness * rest_length * (wlc_shape(x) - wlc_shape(x0) / (ratio * ratio));
}

/// The slope of force() over the stiffness, by the ratio of the length to that at rest.
KOKKOS_INLINE_FUNCTION constexpr double link_slope(double ratio) {
  const double x = ratio * WlcPowSpring::x0 < WlcPowSpring::limit ? ratio * WlcPowSpring::x0 : WlcPowSpring::limit;
  return WlcPowSpring::x0 * (0.5 / ((1 - x) * (1 - x) * (1 - x)) + 1) + 2 * wlc_shape(WlcPowSpring::x0) / (ratio * ratio * ratio);
}

KOKKOS_INLINE_FUNCTION double WlcPowSpring::stiffening(double length, double rest_length) const {
  return link_slope(length / rest_length) / link_slope(1);
}

/// U_WLC + U_POW of the link, fJ (Equations 5 and 6 with m = 2).
KOKKOS_INLINE_FUNCTION double WlcPowSpring::energy(double length, double rest_length) const {
  const double x = length / rest_length * x0;
  const double wlc = rest_length / (4 * x0) * (3 - 2 * x) * x * x / (1 - x);
  return stiffness * rest_length * (wlc + wlc_shape(x0) * rest_length * rest_length / length);
}

/// Linear shear modulus of a regular network of such links over the stiffness (Fedosov, Caswell & Karniadakis 2010,
/// with the terms written in x0; kT/(p l0) and k_p/l0^3 are both proportional to the stiffness).
KOKKOS_INLINE_FUNCTION constexpr double shear_modulus_over_stiffness() {
  constexpr double x = WlcPowSpring::x0, y = 1 - x;
  constexpr double attraction = x / (2 * y * y * y) - 1 / (4 * y * y) + 0.25;
  return 1.7320508075688772 / 4 * (attraction + 3 * wlc_shape(x));
}

}  // namespace corpuscle
