// The flow's kinetic energy and its sources and sinks, as reductions over the field.
#pragma once

#include "common/sums.hpp"
#include "fluid/momentum.hpp"
#include "grid/halo_copy.hpp"

namespace corpuscle {

/// Columns of fluid_energy's result. Immersed nodes are kept apart: a body's surface cuts their cells.
struct EnergyColumn {
  enum : int {
    gradient_square = 0,  // integral of |grad u|^2, um3/us2
    volume = 1,           // um3
    speed_square = 2,     // integral of |u|^2, um5/us2
    immersed = 3,         // the same three at immersed nodes
    count = 6
  };
};

/// V |grad u|^2 of one node, from the viscous fluxes of its faces: half of each; twice that at the block's boundary, which
/// is half a spacing away. Summed over all nodes this is what the discrete viscous force takes out of the flow. A face
/// towards the inside of a body has no meaning: the opposite one stands for it.
template <bool skewed>
KOKKOS_INLINE_FUNCTION double node_gradient_square(const ViscousCoefficients& g, const Components<double>& u, const Array<NodeKind>& kind,
                                                   const IndexSpace& index, int c) {
  double total = 0;
  for (int d = 0; d < 3; ++d) {
    const int s = index.stride(d);
    double sum = 0;
    int faces = 0;
    for (int end = 0; end < 2; ++end) {
      const NodeKind beyond = kind(end == 0 ? c - s : c + s);
      if (beyond == NodeKind::inside || beyond == NodeKind::none) continue;
      const int face = end == 0 ? c : c + s;
      double product = 0;
      for (int m = 0; m < 3; ++m) product += viscous_face<skewed>(g, u, index, d, face, m) * (u(face, m) - u(face - s, m));
      sum += beyond == NodeKind::boundary ? 2 * product : product;
      ++faces;
    }
    if (faces > 0) total += sum / faces;
  }
  return total;
}

template <bool skewed>
Sums<EnergyColumn::count> fluid_energy(const GridViews& grid, const ViscousCoefficients& g, const Array<NodeKind>& kind,
                                       const Components<double>& u) {
  using Column = EnergyColumn;
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  Sums<Column::count> result;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::energy", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, Sums<Column::count>& sum) {
        const int c = index.cell(e % index.n[0], (e / index.n[0]) % index.n[1], e / (index.n[0] * index.n[1]));
        if (kind(c) != NodeKind::fluid && kind(c) != NodeKind::immersed) return;
        const int first = kind(c) == NodeKind::fluid ? 0 : static_cast<int>(Column::immersed);
        sum[first + Column::gradient_square] += node_gradient_square<skewed>(g, u, kind, index, c);
        sum[first + Column::volume] += volume(c);
        sum[first + Column::speed_square] += volume(c) * dot(load(u, c), load(u, c));
      },
      Kokkos::Sum<Sums<Column::count>>(result));
  return result;
}

/// Of the two faces of direction d of fluid cell c.
template <int d>
KOKKOS_INLINE_FUNCTION double face_dissipation(const VaryingViscosity& v, const Components<double>& u, const Array<NodeKind>& kind,
                                               const IndexSpace& index, int c) {
  const int s = index.stride(d);
  double sum = 0;
  for (int end = 0; end < 2; ++end) {
    const int face = end == 0 ? c : c + s, beyond = end == 0 ? c - s : c + s;
    if (kind(beyond) != NodeKind::fluid && kind(beyond) != NodeKind::boundary) continue;
    const double r = face_viscosity(v, kind, c, beyond), share = kind(beyond) == NodeKind::boundary ? 1 : 0.5;
    if (exceeds(v, r)) sum += share * dot(excess_flux<d>(v, r, u, kind, index, face), load(u, face) - load(u, face - s));
  }
  return sum;
}

/// What a viscosity that varies takes out of the flow beyond the uniform one, over that one's value, um3/us2: this rank's part.
/// Faces between two nodes count half at each.
inline double excess_dissipation(const GridViews& grid, const VaryingViscosity& viscosity, const Array<NodeKind>& kind,
                                 const Components<double>& u) {
  const VaryingViscosity v = viscosity;
  const IndexSpace index = grid.index;
  return sum_owned(
      "corpuscle::fluid::excess_dissipation", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::fluid || (v.least != 1 && uniform_beside_body(v, kind, index, c))) return 0.0;
        return face_dissipation<0>(v, u, kind, index, c) + face_dissipation<1>(v, u, kind, index, c) +
               face_dissipation<2>(v, u, kind, index, c);
      });
}

/// Sides of the grid: boxes of boundary nodes, each with its direction and end (0 low, 1 high).
struct GridSides {
  CellBoxes boxes;
  int direction[CellBoxes::most], end[CellBoxes::most];

  void add(const IndexSpace& index, int d, int at_end) {
    CellBox box{{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
    box.lower[d] = at_end == 0 ? -1 : index.n[d];
    box.upper[d] = box.lower[d] + 1;
    direction[boxes.count] = d, end[boxes.count] = at_end;
    boxes.add(box);
  }
};

/// Power that enters through the boundary faces of the sides, nW: pressure, viscous stress, and the kinetic energy that the flow
/// carries, with `rho` zero where convection is left out. Second: the volume that flows in, um3/us. Pressure on a face without one of
/// its own is extended from the two nodes beside it.
template <bool skewed>
Sums<2> boundary_power(const GridViews& grid, const ViscousCoefficients& g, const Array<NodeKind>& kind, const PressureMask& mask,
                       double rho, double mu, const Components<double>& u, const Array<double>& p, const Array<double> (&flux)[3],
                       const GridSides& sides) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const GridSides of = sides;
  const Kokkos::Array<Array<double>, 3> through{flux[0], flux[1], flux[2]};
  Sums<2> result;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::boundary_power", Policy(0, sides.boxes.size()),
      KOKKOS_LAMBDA(int e, Sums<2>& sum) {
        of.boxes.visit(e, [&](int side, int i, int j, int k) {
          const int d = of.direction[side], end = of.end[side], b = index.cell(i, j, k);
          const int inward = end == 0 ? index.stride(d) : -index.stride(d), outward = end == 0 ? -1 : 1;
          const int c = b + inward, next = c + inward, face = end == 0 ? c : b;
          double pressure = p(c);
          if (mask(b)) {
            pressure = p(b);
          } else if (kind(next) == NodeKind::fluid || kind(next) == NodeKind::immersed) {
            pressure += norm(load(x, b) - load(x, c)) / norm(load(x, c) - load(x, next)) * (p(c) - p(next));
          }
          const double out = outward * through[d](face);
          double viscous = 0;
          for (int m = 0; m < 3; ++m) viscous += outward * mu * viscous_face<skewed>(g, u, index, d, face, m) * u(b, m);
          sum[0] += viscous - (pressure + 0.5 * rho * dot(load(u, b), load(u, b))) * out;
          sum[1] += out < 0 ? -out : 0.0;
        });
      },
      Kokkos::Sum<Sums<2>>(result));
  return result;
}

}  // namespace corpuscle
