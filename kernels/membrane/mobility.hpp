// How fast a membrane that moves with the fluid relaxes: an estimate, from forces to velocities without solving the flow.
#pragma once

#include "membrane/stiffness.hpp"

namespace corpuscle {

/// Vertices as blobs in an unbounded fluid (Rotne & Prager, J. Chem. Phys. 50, 1969; Yamakawa, ibid. 53, 1970), and each one's slip.
struct MobilityModel {
  double viscosity = 1;          // mPa s
  double radius = 1;             // um, of a blob
  Components<double> slip[3];    // [vertex, 3] um, columns of what makes slip of force, times viscosity and area; without values none
  double dipole = 0, width = 1;  // um: how far the dipoles of forces take the membrane along, and what they are smeared over
};

/// Of forces along a surface whose dipoles are spread, and act back, as well: the velocities on both sides of it differ by their strength
/// over the viscosity, and what shears between moves the membrane.
KOKKOS_INLINE_FUNCTION Vec3 dipole_velocity(const MobilityModel& model, const Vec3& r, const Vec3& f, const Vec3& normal) {
  const double pi = 3.14159265358979323846, square = model.width * model.width;
  const double share = std::exp(-0.5 * dot(r, r) / square) / (2 * pi * square);
  return (model.dipole / model.viscosity * share) * (f - dot(f, normal) * normal);
}

KOKKOS_INLINE_FUNCTION Vec3 blob_velocity(const MobilityModel& model, const Vec3& r, const Vec3& f) {
  const double pi = 3.14159265358979323846, a = model.radius, distance = norm(r);
  if (distance < 2 * a) {
    const double along = distance > 0 ? 3 * dot(r, f) / (32 * a * distance) : 0;
    return (1 / (6 * pi * model.viscosity * a)) * ((1 - 9 * distance / (32 * a)) * f + along * r);
  }
  const double square = a * a / (distance * distance);
  return (1 / (8 * pi * model.viscosity * distance)) *
         ((1 + 2 * square / 3) * f + ((1 - 2 * square) * dot(r, f) / (distance * distance)) * r);
}

/// w.mode = `values` [vertex, 3] of the vertices of `cell`; their squared norm goes to the sums.
inline void take_mode(const Components<double>& values, int cell, int first, int last, const StiffnessViews& w) {
  double total = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::take_mode", Policy(first, last),
      KOKKOS_LAMBDA(int i, double& sum) {
        const Vec3 v = load(values, i);
        store(w.mode, i, v);
        sum += dot(v, v);
      },
      total);
  Kokkos::parallel_for(
      "corpuscle::membrane::mode_sums", Policy(0, sections), KOKKOS_LAMBDA(int s) { w.sums(cell * sections + s, 0) = s == 0 ? total : 0; });
}

/// w.mode = the velocities that the forces w.mode [vertex, 3] give to the vertices of `cell`; w.probe is overwritten, the
/// squared norm goes to the sums. Normals and areas must be current.
inline void apply_mobility(const MembraneViews& m, const MobilityModel& mobility, int cell, int first, int last, const StiffnessViews& w) {
  const MobilityModel model = mobility;
  const auto x = m.surface.x, normal = m.surface.normal;
  const auto area = m.surface.area;
  Kokkos::parallel_for(
      "corpuscle::membrane::mobility", Policy(first, last), KOKKOS_LAMBDA(int i) {
        const Vec3 at = load(x, i), f = load(w.mode, i), n = load(normal, i);
        Vec3 v;
        if (model.slip[0].extent(0) > 0)
          for (int d = 0; d < 3; ++d) v += (f[d] / (model.viscosity * area(i))) * load(model.slip[d], i);
        for (int j = first; j < last; ++j) {
          const Vec3 r = at - load(x, j), of_j = load(w.mode, j);
          v += blob_velocity(model, r, of_j);
          if (model.dipole > 0) v += dipole_velocity(model, r, of_j, n);
        }
        store(w.probe, i, v);
      });
  take_mode(w.probe, cell, first, last, w);
}

}  // namespace corpuscle
