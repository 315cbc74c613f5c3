// How membranes repel and attract each other across a gap: energy and pressure per area of a film.
#pragma once

#include <Kokkos_Core.hpp>
#include <cmath>

namespace corpuscle {

/// Repulsion pressure (range / d - 1)^2 below the range: without bound as the gap d closes. Below `knee`, where a step
/// could not follow so stiff a force, it goes on as its tangent there. Aggregation after Morse, with its minimum at the
/// range and an end: depth ((1 - exp(-steepness (d - range)))^2 - 1), switched off smoothly over the outer half of the
/// way to `reach`; below the range it repels as well, and goes on as its tangent below the knee.
struct ContactLaw {
  double range = 0;      // um, of the repulsion
  double pressure = 0;   // kPa, at half the range
  double knee = 0;       // um
  double depth = 0;      // fJ/um2, of the aggregation; 0 for none
  double steepness = 0;  // 1/um
  double reach = 0;      // um, where all ends: the range, or beyond it that of the aggregation

  KOKKOS_INLINE_FUNCTION double steep_pressure(double d) const {
    const double q = range / d - 1;
    return pressure * q * q;
  }
  KOKKOS_INLINE_FUNCTION double steep_energy(double d) const {
    const double u = d / range;
    return pressure * range * (1 / u + 2 * std::log(u) - u);
  }
  /// -dP/dd, kPa/um.
  KOKKOS_INLINE_FUNCTION double steep_stiffness(double d) const { return 2 * pressure * (range / d - 1) * range / (d * d); }

  /// kPa that drives the surfaces apart; negative gaps are as if less than nothing were left.
  KOKKOS_INLINE_FUNCTION double repulsion(double d) const {
    if (d >= range) return 0;
    if (d >= knee) return steep_pressure(d);
    return steep_pressure(knee) + steep_stiffness(knee) * (knee - d);
  }
  /// fJ/um2.
  KOKKOS_INLINE_FUNCTION double repulsion_energy(double d) const {
    if (d >= range) return 0;
    if (d >= knee) return steep_energy(d);
    const double below = knee - d;
    return steep_energy(knee) + below * (steep_pressure(knee) + 0.5 * steep_stiffness(knee) * below);
  }

  /// fJ/um2, minus its derivative, kPa, and minus that of this, kPa/um.
  struct Well {
    double energy = 0, drive = 0, stiffness = 0;
  };
  KOKKOS_INLINE_FUNCTION Well steep_well(double d) const {
    const double e = std::exp(-steepness * (d - range));
    return {depth * ((1 - e) * (1 - e) - 1), -2 * depth * steepness * (1 - e) * e, 2 * depth * steepness * steepness * (2 * e - 1) * e};
  }
  /// Energy of the aggregation and minus its derivative.
  KOKKOS_INLINE_FUNCTION void aggregation(double d, double& energy, double& drive) const {
    energy = drive = 0;
    if (depth == 0 || d >= reach) return;
    const double below = d < knee ? knee - d : 0;
    const Well well = steep_well(d + below);
    const double begin = 0.5 * (range + reach), t = (d - begin) / (reach - begin);
    if (t <= 0) {
      energy = well.energy + below * (well.drive + 0.5 * well.stiffness * below);
      drive = well.drive + well.stiffness * below;
      return;
    }
    const double share = 1 - t * t * (3 - 2 * t), change = -6 * t * (1 - t) / (reach - begin);
    energy = share * well.energy;
    drive = share * well.drive - change * well.energy;
  }
  KOKKOS_INLINE_FUNCTION double total_pressure(double d, bool aggregates) const {
    double energy = 0, drive = 0;
    if (aggregates) aggregation(d, energy, drive);
    return repulsion(d) + drive;
  }
  KOKKOS_INLINE_FUNCTION double total_energy(double d, bool aggregates) const {
    double energy = 0, drive = 0;
    if (aggregates) aggregation(d, energy, drive);
    return repulsion_energy(d) + energy;
  }
};

}  // namespace corpuscle
