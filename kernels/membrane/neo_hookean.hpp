// A thin sheet of an incompressible neo-Hookean solid (Barthes-Biesel, Diaz & Dhenin, J. Fluid Mech. 460, 2002).
#pragma once

#include "membrane/triangle_law.hpp"

namespace corpuscle {

struct NeoHookeanSheet {
  static constexpr double limit = 10;  // stretch; the solid has none, a mesh that comes this far is lost

  double shear_modulus = 0;  // G, of the surface, nN/um

  /// W = G/2 (a^2 + b^2 + 1 / (a b)^2 - 3): the third stretch is 1 / (a b).
  KOKKOS_INLINE_FUNCTION EnergyDensity density(double trace, double ratio) const {
    const double g = 0.5 * shear_modulus, inverse = 1 / ratio;
    return {g * (trace + inverse * inverse - 3), g, -2 * g * inverse * inverse * inverse};
  }
  /// Of W's second derivatives by a and by b, the sum over that at rest.
  KOKKOS_INLINE_FUNCTION double stiffening(double trace, double ratio) const {
    const double square = ratio * ratio;
    return 0.125 * (2 + 3 * trace / (square * square));
  }
};

/// The law "neo-hookean".
using NeoHookean = TriangleLaw<NeoHookeanSheet>;

}  // namespace corpuscle
