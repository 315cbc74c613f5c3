// Which nodes lie on the same side of every surface as a given point.
#pragma once

#include "immersed/views.hpp"

namespace corpuscle {

/// A point outside, its closest surface point (itself, for a vertex), the outward normal there and the body.
struct SidePoint {
  Vec3 at, foot, normal;
  int body;
};

/// Whether node q is on the side of `p`: in front of the tangent plane at p's foot, and, where q has a closest surface
/// point of its own, with p not behind the surface as q sees it. The second test keeps the far face of another body,
/// or of a thin fold of the same one, from leaking in. The bounds (cosine of the angle between q's normal and the
/// direction to p) leave room for the curvature of a convex surface: half for the same body, hardly any for another.
KOKKOS_INLINE_FUNCTION bool own_side(const Lattice& lattice, const SurfaceSet& s, const BandViews& band, const SidePoint& p, int q) {
  const Vec3 x = lattice.position(q);
  if (!(dot(x - p.foot, p.normal) > 0)) return false;
  const Key key = band.key(q);
  if (key == no_key) return true;
  if (band.distance(q) < 0) return false;
  const Vec3 foot = load(band.foot, q), out = x - foot, to_p = p.at - foot;
  const int body = key_body(s.triangle_body, key);
  const double least = body == p.body ? -0.5 : -0.1;
  return dot(out, to_p) >= least * norm(out) * norm(to_p);
}

}  // namespace corpuscle
