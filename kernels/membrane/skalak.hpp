// A sheet that resists shear and, apart from it, change of area (Skalak, Tozeren, Zarda & Chien, Biophys. J. 13, 1973).
#pragma once

#include "membrane/triangle_law.hpp"

namespace corpuscle {

struct SkalakSheet {
  static constexpr double limit = 10;  // stretch; a sheet that stiffens as this one does is lost long before

  double shear_modulus = 0;   // G, nN/um
  double area_hardening = 0;  // C: the modulus of area, small strains, is G (1 + 2 C)

  /// W = G/4 (I1^2 + 2 I1 - 2 I2 + C I2^2), I1 = a^2 + b^2 - 2, I2 = (a b)^2 - 1. The 1973 paper writes
  /// B/4 (I1^2/2 + I1 - I2) + C'/8 I2^2: B = 2 G, C' = 2 G C. G is the linear shear modulus, as in the other laws.
  KOKKOS_INLINE_FUNCTION EnergyDensity density(double trace, double ratio) const {
    const double g = shear_modulus, i1 = trace - 2, i2 = ratio * ratio - 1;
    return {0.25 * g * (i1 * i1 + 2 * (i1 - i2) + area_hardening * i2 * i2), 0.5 * g * (i1 + 1), g * ratio * (area_hardening * i2 - 1)};
  }
  /// Of W's second derivatives by a and by b, the sum over that at rest.
  KOKKOS_INLINE_FUNCTION double stiffening(double trace, double ratio) const {
    return (3 * trace - 2 + area_hardening * trace * (3 * ratio * ratio - 1)) / (4 * (1 + area_hardening));
  }
};

/// The law "skalak".
using Skalak = TriangleLaw<SkalakSheet>;

}  // namespace corpuscle
