// The viscosity of the momentum equation: one for the whole flow, or one that varies in space.
#pragma once

#include "grid/metrics.hpp"

namespace corpuscle {

/// Nothing is stored and nothing added: the operator is written over this viscosity.
struct UniformViscosity {};

/// `relative` [cell] is the viscosity at a node over that of the rest of the operator (FluidSolver::viscosity()), with valid
/// halos; boundary nodes hold the value on the boundary. `least` is not above any of them, nor above 1.
struct VaryingViscosity {
  Array<double> relative;
  double least;
  bool bodies;                         // whether there may be nodes inside bodies
  Array<double> fluidity;              // [cell] mean of 1 / viscosity where cells hold two fluids; without values: none does
  Array<double> smooth;                // [cell] of smooth_viscosity(), then
  Components<double> x, face_area[3];  // as in GridViews
  // Of mark_excess(): what the face of each direction below a cell, and the cell itself, have beyond the uniform viscosity's.
  Array<unsigned char> marks;
  Components<double> excess[3];  // [cell, 3] of find_excess(), on faces that are marked
  Components<double> force;      // [cell, 3] the same, of whole cells: zero where none is marked

  KOKKOS_INLINE_FUNCTION static constexpr unsigned char face_mark(int d) { return 1 << d; }
  static constexpr unsigned char cell_mark = 1 << 3;
};

KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const UniformViscosity&, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double relative_viscosity(const VaryingViscosity& v, int c) { return v.relative(c); }
/// About a cell: the harmonic mean over its faces of the viscosities on both sides of each.
KOKKOS_FORCEINLINE_FUNCTION double yielding_viscosity(const UniformViscosity&, const IndexSpace&, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double yielding_viscosity(const VaryingViscosity& v, const IndexSpace& index, int c) {
  double beyond = 0;
  for (int d = 0; d < 3; ++d) beyond += 1 / v.relative(c - index.stride(d)) + 1 / v.relative(c + index.stride(d));
  return 2 / (1 / v.relative(c) + beyond / 6);
}
/// On the face between two nodes.
KOKKOS_FORCEINLINE_FUNCTION double mean_viscosity(const UniformViscosity&, int, int) { return 1; }
KOKKOS_FORCEINLINE_FUNCTION double mean_viscosity(const VaryingViscosity& v, int a, int b) { return 0.5 * (v.relative(a) + v.relative(b)); }

/// Differences across a face of direction d and along it, of one value after the other. (With d known when it is compiled no vector has to
/// be looked up in memory by direction: a fifth less time.)
template <int d>
struct FaceDifferences {
  DualBasis dual;
  int low, c;

  KOKKOS_INLINE_FUNCTION static Vec3 link(const Components<double>& x, const IndexSpace& index, int c, int e) {
    const int low = c - index.stride(d), s = index.stride(e);
    return e == d ? load(x, c) - load(x, low) : 0.5 * (central_offset(x, c, s) + central_offset(x, low, s));
  }
  KOKKOS_INLINE_FUNCTION FaceDifferences(const Components<double>& x, const IndexSpace& index, int c)
      : dual(link(x, index, c, 0), link(x, index, c, 1), link(x, index, c, 2)), low(c - index.stride(d)), c(c) {}
  /// Along direction e.
  template <class Value>
  KOKKOS_INLINE_FUNCTION auto of(const Value& value, const IndexSpace& index, int e) const {
    const int s = index.stride(e);
    return e == d ? value(c) - value(low) : 0.25 * (value(c + s) - value(c - s) + value(low + s) - value(low - s));
  }
  /// The same of what has no value inside bodies: there the difference towards the other side is taken.
  template <class Value>
  KOKKOS_INLINE_FUNCTION Vec3 of(const Value& value, const Array<NodeKind>& kind, const IndexSpace& index, int e) const {
    if (e == d) return value(c) - value(low);
    const int s = index.stride(e);
    const auto known = [&](int at) { return kind(at) != NodeKind::inside; };
    if (known(c + s) && known(c - s) && known(low + s) && known(low - s)) return of(value, index, e);
    Vec3 sum;
    for (const int at : {c, low}) {
      const bool above = known(at + s), below = known(at - s);
      if (!above && !below) continue;
      sum += (above && below ? 0.5 : 1.0) * (value(above ? at + s : at) - value(below ? at - s : at));
    }
    return 0.5 * sum;
  }
  /// The same, across the face of as many values as along it: what is a few cells thick does not look steeper that way.
  KOKKOS_INLINE_FUNCTION double even(const Array<double>& value, const IndexSpace& index, int e) const {
    const int s = index.stride(e);
    return e == d ? 0.25 * (value(c + s) + value(c) - value(low) - value(low - s)) : of(value, index, e);
  }
};

/// Where a face lies between two fluids they lie side by side, and share what stretches along their interface, but what shears
/// across it one bears after the other: there the viscosity is the harmonic mean, less by `less` than the other one. Of flux, the part
/// that this makes.
template <int d>
KOKKOS_INLINE_FUNCTION Vec3 layered_flux(const VaryingViscosity& v, double less, const FaceDifferences<d>& face, const Vec3 (&du)[3],
                                         const IndexSpace& index, const Vec3& area) {
  const auto smooth = v.smooth;
  Vec3 normal;
  for (int e = 0; e < 3; ++e) normal += face.even(smooth, index, e) * face.dual.b[e];
  const double square = dot(normal, normal);
  if (!(square > 0)) return {};
  normal *= 1 / std::sqrt(square);
  Vec3 shear;
  for (int e = 0; e < 3; ++e) shear += dot(face.dual.b[e], normal) * du[e] + dot(du[e], normal) * face.dual.b[e];
  shear -= dot(shear, normal) * normal;
  return -less * (dot(normal, area) * shear + dot(shear, area) * normal);
}

/// `relative` with weights of 1/4, 1/2, 1/4 along each direction, on owned cells and two halo layers: its gradient is across an
/// interface that is no thicker than a cell. Differences of what is that thin are not, by up to 18 degrees, which loosens the
/// interface of fluids as different as 1 and 20 by a fifth.
inline void smooth_viscosity(const IndexSpace& of_cells, const Array<double>& relative, const Array<double>& smooth) {
  const IndexSpace index = of_cells;
  const Array<double> from = relative, out = smooth;
  for_box(
      "corpuscle::fluid::excess_smooth", {-2, -2, -2}, {index.n[0] + 2, index.n[1] + 2, index.n[2] + 2},
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        double sum = 0;
        for (int z = -1; z <= 1; ++z)
          for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
              sum += (2 - x * x) * (2 - y * y) * (2 - z * z) * from(c + x * index.stride(0) + y * index.stride(1) + z * index.stride(2));
        out(c) = sum / 64;
      });
}

/// (r - 1) grad u . area + (r - least) grad u^T . area on the face between c - stride(d) and c, where r is the viscosity, and what two
/// fluids beside each other make of it. A uniform part of the transpose's viscosity is the gradient of a divergence, which vanishes
/// in the end. On the way there it is in the operator: with less than `least` taken off, velocities along their own gradient would be
/// driven, not resisted, where r < 1/2.
template <int d, class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 excess_flux(const VaryingViscosity& v, double r, const Velocity& u, const Array<NodeKind>& kind,
                                        const IndexSpace& index, int c) {
  const FaceDifferences<d> face(v.x, index, c);
  const Vec3 area = load(v.face_area[d], c);
  Vec3 du[3], flux;
  for (int e = 0; e < 3; ++e) {
    const auto value = [&](int at) { return to_double(load(u, at)); };
    du[e] = v.bodies ? face.of(value, kind, index, e) : face.of(value, index, e);
    flux += ((r - 1) * dot(area, face.dual.b[e])) * du[e] + ((r - v.least) * dot(area, du[e])) * face.dual.b[e];
  }
  constexpr double round_off = 1e-12;
  const bool between = v.fluidity.extent(0) > 0 && r == mean_viscosity(v, c, face.low);  // not on a boundary
  const double less = between ? r - 2 / (v.fluidity(c) + v.fluidity(face.low)) : 0;
  if (less > round_off * r) flux += layered_flux(v, less, face, du, index, area);
  return flux;
}

/// On the face towards `beyond`: the mean of its two nodes', on the boundary that of the boundary.
KOKKOS_FORCEINLINE_FUNCTION double face_viscosity(const VaryingViscosity& v, const Array<NodeKind>& kind, int c, int beyond) {
  return kind(beyond) == NodeKind::boundary ? v.relative(beyond) : mean_viscosity(v, c, beyond);
}

/// Whether that viscosity on a face adds anything to the uniform one's flux.
KOKKOS_FORCEINLINE_FUNCTION bool exceeds(const VaryingViscosity& v, double on_face) { return on_face != 1 || v.least != 1; }

/// Whether a cell beside a body, and the fluid around it, have the uniform viscosity. All that its faces add up to there is the uniform
/// part of the transpose, which vanishes with the divergence; what next to a surface is no flow of the grid's has one, and would drive
/// the flow past a body by a share that depends on cells anywhere.
KOKKOS_INLINE_FUNCTION bool uniform_beside_body(const VaryingViscosity& v, const Array<NodeKind>& kind, const IndexSpace& index, int c) {
  bool beside = false;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const NodeKind here = kind(c + x * index.stride(0) + y * index.stride(1) + z * index.stride(2));
        beside = beside || here == NodeKind::immersed || here == NodeKind::inside;
      }
  if (!beside) return false;
  for (int d = 0; d < 3; ++d)
    for (const int s : {-index.stride(d), index.stride(d)})
      if (face_viscosity(v, kind, c, c + s) != 1) return false;
  return true;
}

/// Where find_excess() has anything to find with the present viscosity and nodes: there alone is it looked for, a few times a step.
inline void mark_excess(const VaryingViscosity& viscosity, const Array<NodeKind>& kinds, const IndexSpace& of_cells) {
  const VaryingViscosity v = viscosity;
  const Array<NodeKind> kind = kinds;
  const IndexSpace index = of_cells;
  for_box(
      "corpuscle::fluid::excess_marks", {0, 0, 0}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
        const int at[3] = {i, j, k}, c = index.cell(i, j, k);
        int beyond = 0;  // directions along which the cell is none of the owned ones
        for (int d = 0; d < 3; ++d) beyond += at[d] == index.n[d];
        unsigned char marks = 0;
        bool any = false;
        for (int d = 0; d < 3; ++d) {
          if (beyond > (at[d] == index.n[d] ? 1 : 0)) continue;  // no face of an owned cell
          const int low = c - index.stride(d), high = c + index.stride(d);
          const bool below = exceeds(v, kind(low) == NodeKind::boundary ? v.relative(low) : face_viscosity(v, kind, low, c));
          if (below) marks |= VaryingViscosity::face_mark(d);
          any = any || below || (beyond == 0 && exceeds(v, face_viscosity(v, kind, c, high)));
        }
        if (beyond == 0) {
          if (any && !(v.least != 1 && uniform_beside_body(v, kind, index, c)))
            marks |= VaryingViscosity::cell_mark;
          else
            store(v.force, c, Vec3{});
        }
        v.marks(c) = marks;
      });
}

/// v.excess of the face between c - stride(d) and c.
template <int d, class Velocity>
KOKKOS_INLINE_FUNCTION void find_face_excess(const VaryingViscosity& v, const Velocity& u, const Array<NodeKind>& kind,
                                             const IndexSpace& index, int c) {
  const int low = c - index.stride(d);
  const double r = kind(low) == NodeKind::boundary ? v.relative(low) : face_viscosity(v, kind, low, c);
  store(v.excess[d], c, excess_flux<d>(v, r, u, kind, index, c));
}

/// What a viscosity that varies adds to the viscous force of u on owned cells, over the uniform one, into v.force: div(r (grad u +
/// grad u^T)) less div grad u. After mark_excess().
template <class Velocity>
void find_excess(const UniformViscosity&, const Velocity&, const Array<NodeKind>&, const IndexSpace&) {}
template <class Velocity>
void find_excess(const VaryingViscosity& viscosity, const Velocity& velocity, const Array<NodeKind>& kinds, const IndexSpace& of_cells) {
  const VaryingViscosity v = viscosity;
  const Velocity u = velocity;
  const Array<NodeKind> kind = kinds;
  const IndexSpace index = of_cells;
  for_box(
      "corpuscle::fluid::excess_flux", {0, 0, 0}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const unsigned char marks = v.marks(c);
        if (marks == 0) return;
        if (marks & VaryingViscosity::face_mark(0)) find_face_excess<0>(v, u, kind, index, c);
        if (marks & VaryingViscosity::face_mark(1)) find_face_excess<1>(v, u, kind, index, c);
        if (marks & VaryingViscosity::face_mark(2)) find_face_excess<2>(v, u, kind, index, c);
      });
  for_owned(
      "corpuscle::fluid::excess_force", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (!(v.marks(c) & VaryingViscosity::cell_mark)) return;
        Vec3 force;
        for (int d = 0; d < 3; ++d) {
          const int next = c + index.stride(d);
          if (v.marks(c) & VaryingViscosity::face_mark(d)) force -= load(v.excess[d], c);
          if (v.marks(next) & VaryingViscosity::face_mark(d)) force += load(v.excess[d], next);
        }
        store(v.force, c, force);
      });
}

/// image -= v.force of cell c.
template <class Image>
KOKKOS_FORCEINLINE_FUNCTION void subtract_excess(const UniformViscosity&, int, Image&) {}
template <class Image>
KOKKOS_FORCEINLINE_FUNCTION void subtract_excess(const VaryingViscosity& v, int c, Image& image) {
  for (int m = 0; m < 3; ++m) image[m] -= v.force(c, m);
}

}  // namespace corpuscle
