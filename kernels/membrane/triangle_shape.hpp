// A triangle of the membrane and its state of rest: what in-plane laws are functions of.
//
// A law is a plain struct, the constants of one cell type, with
//   double add_forces(const TriangleShape&, const TriangleRest&, Vec3 (&force)[3]) const
//     adds the forces on the corners, nN, minus the gradient of energy(); returns strain();
//   double energy(const TriangleShape&, const TriangleRest&) const   fJ, over all triangles the membrane's;
//   double strain(const TriangleShape&, const TriangleRest&) const   how far the triangle is strained: at `limit` and
//     beyond, where the law holds no more, the step is refused. A shape that is not a number gives 1e300;
//   double stiffening(const TriangleShape&, const TriangleRest&) const   how many times as stiff it is as at rest, about and
//     at most, in the direction in which it is stiffest;
//   static constexpr double limit, and bool holds_area: whether the law alone keeps a membrane's area about what it is.
// Springs of any kind are SpringNetwork<Spring> (spring_network.hpp); a law of the triangle as a whole goes by its two
// invariants (triangle_law.hpp). laws.hpp lists the laws that a scene can choose.
#pragma once

#include "common/vec3.hpp"

namespace corpuscle {

/// Reference state of one triangle: of the side opposite each corner, the rest length and the rest angle.
struct TriangleRest {
  double length[3];
  double cos_angle[3], sin_angle[3];
  double area;
};

struct TriangleShape {
  Vec3 side[3];      // opposite each corner, counter-clockwise: from corner k + 1 to corner k + 2, um
  double length[3];  // of the sides
  Vec3 normal;       // unit, outward
  double area;       // um2
};

KOKKOS_INLINE_FUNCTION TriangleShape triangle_shape(const Vec3 (&corner)[3], const Vec3& normal, double area) {
  TriangleShape s;
  for (int k = 0; k < 3; ++k) {
    s.side[k] = corner[(k + 2) % 3] - corner[(k + 1) % 3];
    s.length[k] = norm(s.side[k]);
  }
  s.normal = normal;
  s.area = area;
  return s;
}

}  // namespace corpuscle
