// Geometry and forces of one triangle of the membrane: plain functions of its corners and its neighbours' normals.
#pragma once

#include "membrane/triangle_shape.hpp"

namespace corpuscle {

/// Constants of a cell type, but for those of its in-plane law, and its totals at rest.
struct CellLaw {
  double bending = 0;             // k_b, fJ
  double area = 0;                // k_a, nN/um
  double local_area = 0;          // k_d, nN/um
  double volume = 0;              // k_v, kPa
  double rest_area = 1;           // A0, um2
  double rest_volume = 1;         // V0, um3
  double vertex_mass = 0;         // pg
  double central_damping = 0;     // gamma_C of Equation 10, nN us/um
  double tangential_damping = 0;  // gamma_T
};

/// A triangle that is squeezed to less than `from` of its area at rest, which k_d alone does not keep from turning over: springs have
/// hardly more to say as its corners come to lie on a line. Over k_d, by its area over that at rest: dE/dA, and the energy per area at
/// rest. Finite, and with the usual k_d at most some seven times as stiff as springs.
struct Squeeze {
  double tension = 0, energy = 0;

  KOKKOS_INLINE_FUNCTION explicit Squeeze(double ratio) {
    constexpr double from = 0.5, strength = 8;
    const double t = 1 - ratio / from;
    if (t <= 0) return;
    tension = -strength * t * t;
    energy = strength * from / 3 * t * t * t;
  }
};

struct Dihedral {
  double cosine, sine;
};

/// Signed angle between two unit normals about their common edge, positive where the surface is convex outward.
/// @param along  unit vector along the edge, counter-clockwise around the first triangle
KOKKOS_INLINE_FUNCTION Dihedral dihedral(const Vec3& normal, const Vec3& other, const Vec3& along) {
  return {dot(normal, other), dot(cross(normal, other), along)};
}

/// Two triangles that close like a book: (1 - cos) has no slope left when they lie on each other and then goes the other way, so
/// that a sheet under compression folds through itself, and with it what is inside and outside. Beyond a right angle their
/// moment has |tan(theta / 2)| - 1 on top, and from `steepest` on goes on as its tangent, which explicit steps can follow. Not
/// of edges that are sharp at rest.
struct Fold {
  double moment = 0, energy = 0;  // over k_b

  KOKKOS_INLINE_FUNCTION Fold(const Dihedral& angle, double cos_rest) {
    constexpr double sharp = 0.5, right_angle = 1.5707963267948966;
    if (angle.cosine >= 0 || cos_rest < sharp) return;
    constexpr double steepest = 2.6179938779914944, cos_steepest = -0.8660254037844386, tan_half = 3.732050807568877;  // 150 degrees
    constexpr double slope = 0.5 * (1 + tan_half * tan_half);
    const double theta = std::acos(angle.cosine > -1 ? angle.cosine : -1.0);
    const double beyond = theta > steepest ? theta - steepest : 0;
    const double cosine = beyond > 0 ? cos_steepest : angle.cosine;
    const double steep = std::sqrt((1 - cosine) / (1 + cosine)) - 1;  // up to where the tangent begins
    const double size = steep + slope * beyond;
    moment = angle.sine < 0 ? -size : size;
    energy = right_angle - std::acos(cosine) - std::log(1 + cosine) + beyond * (steep + 0.5 * slope * beyond);
  }
};

/// dE/dtheta of E = k_b (1 - cos(theta - theta0)) (Equation 7), and of a fold.
KOKKOS_INLINE_FUNCTION double bending_moment(const Dihedral& angle, double cos_rest, double sin_rest, double k_b) {
  return k_b * (angle.sine * cos_rest - angle.cosine * sin_rest + Fold(angle, cos_rest).moment);
}

KOKKOS_INLINE_FUNCTION double bending_energy(const Dihedral& angle, double cos_rest, double sin_rest, double k_b) {
  return k_b * (1 - (angle.cosine * cos_rest + angle.sine * sin_rest) + Fold(angle, cos_rest).energy);
}

/// How much a triangle takes part in the bending of its sides, by its area over that at rest. All of it down to `whole`: below,
/// angles turn by ever more for the same way of a corner, by any for that of a triangle whose corners lie on a line, and one step
/// would throw it away. Forces alone: an energy with this share would pull folded triangles flat, where it has none.
struct BendingShare {
  static constexpr double whole = 0.5;
  double value = 1, over_ratio;  // itself, and over the ratio of areas

  KOKKOS_INLINE_FUNCTION explicit BendingShare(double ratio) : over_ratio(1 / ratio) {
    const double t = ratio / whole;
    if (t >= 1) return;
    over_ratio = t * t * (4 - 3 * t) / whole;
    value = over_ratio * ratio;
  }
};

struct TriangleState {
  Vec3 corner[3];
  Vec3 normal;                        // unit, outward
  double area;                        // um2
  Vec3 other_normal[3];               // of the triangle across the side opposite each corner
  double other_share[3] = {1, 1, 1};  // BendingShare of those
};

/// Sum over the triangle of what the global terms need: dE/dA of the cell and the pressure -dE/dV.
struct GlobalLoads {
  double tension;   // k_a (A - A0) / A0, nN/um
  double pressure;  // -k_v (V - V0) / V0, kPa
};

KOKKOS_INLINE_FUNCTION GlobalLoads global_loads(double area, double volume, const CellLaw& law) {
  return {law.area * (area - law.rest_area) / law.rest_area, -law.volume * (volume - law.rest_volume) / law.rest_volume};
}

/// Forces on the three corners, nN: the in-plane law's, this triangle's part of the bending of each side, and the area and
/// volume terms (Equations 3 to 8).
/// @param in_plane  see triangle_shape.hpp
/// @return its strain
template <class Law>
KOKKOS_INLINE_FUNCTION double triangle_forces(const TriangleState& s, const TriangleRest& rest, const CellLaw& law, const Law& in_plane,
                                              const GlobalLoads& loads, Vec3 (&force)[3]) {
  const TriangleShape shape = triangle_shape(s.corner, s.normal, s.area);
  const double ratio = s.area / rest.area;
  const BendingShare share(ratio);
  const double tension = loads.tension + law.local_area * (ratio - 1 + Squeeze(ratio).tension);
  const double pressure = loads.pressure * s.area / 3;
  double along_normal[3] = {pressure, pressure, pressure};
  for (int k = 0; k < 3; ++k) force[k] = {};
  const double share_over_twice_area = 0.5 * share.over_ratio / rest.area;
  const double strain = in_plane.add_forces(shape, rest, force);
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    const double length = shape.length[k], inverse = 1 / length;
    // The angle falls by 1/h when corner k rises by 1 along the normal (h its height over the side); the two ends share
    // the opposite change by the foot of that height, so that the part exerts no net force or torque.
    const Dihedral angle = dihedral(s.normal, s.other_normal[k], shape.side[k] * inverse);
    const double k_b = s.other_share[k] * law.bending;
    const double per_height = bending_moment(angle, rest.cos_angle[k], rest.sin_angle[k], k_b) * length * share_over_twice_area;
    const double foot = -dot(shape.side[b], shape.side[k]) * inverse * inverse;
    along_normal[k] += per_height;
    along_normal[a] -= (1 - foot) * per_height;
    along_normal[b] -= foot * per_height;
  }
  // dA/dx of a corner is n x (opposite side) / 2.
  for (int k = 0; k < 3; ++k) force[k] += along_normal[k] * s.normal - (0.5 * tension) * cross(s.normal, shape.side[k]);
  return strain;
}

}  // namespace corpuscle
