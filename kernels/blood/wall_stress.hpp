// The shear stress of the flow on walls.
#pragma once

#include "common/sums.hpp"
#include "fluid/momentum.hpp"
#include "grid/halo_copy.hpp"
#include "grid/wall_sides.hpp"

namespace corpuscle {

/// Force of the fluid on a wall's face, along it, nN: what the momentum equation takes from the cell beside it, so that
/// all of them together hold what drives the flow, but for what cells within the kernel's reach of a wall have on it
/// themselves (Coupling::power_on_sides()). Where the wall's stress is wanted no better derivative is: in a steady flow
/// along straight walls this one is exact, since it is what the flow has been solved with.
/// @param face  its number, that of the cell above it; end: 0 or 1, whether the wall is at the low or the high end of d
template <bool skewed>
KOKKOS_INLINE_FUNCTION Vec3 wall_face_force(const ViscousCoefficients& g, const IndexSpace& index, const Components<double>& u,
                                            const Vec3& area, double viscosity, int d, int end, int face) {
  Vec3 force;
  for (int m = 0; m < 3; ++m) force[m] = (end == 0 ? viscosity : -viscosity) * viscous_face<skewed>(g, u, index, d, face, m);
  return force - (dot(force, area) / dot(area, area)) * area;
}

/// stress [cell, 3] of owned cells, kPa, of the fluid alone: the mean over a cell's walls; zero where it has none.
template <bool skewed>
void wall_stress_field(const GridViews& grid, const ViscousCoefficients& coefficients, const WallSides& sides, double viscosity,
                       const Components<double>& u, const Components<double>& stress) {
  const IndexSpace index = grid.index;
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const auto kind = grid.base_kind;
  const ViscousCoefficients g = coefficients;
  const WallSides walls = sides;
  for_owned(
      "corpuscle::blood::wall_stress", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        Vec3 force;
        double whole = 0;
        for (int d = 0; d < 3; ++d)
          for (int end = 0; end < 2; ++end) {
            const int beyond = end == 0 ? c - index.stride(d) : c + index.stride(d), face = end == 0 ? c : beyond;
            if (!walls.wall[d][end] || kind(beyond) != NodeKind::boundary) continue;
            const Vec3 area = load(d == 0 ? area0 : (d == 1 ? area1 : area2), face);
            force += wall_face_force<skewed>(g, index, u, area, viscosity, d, end, face);
            whole += norm(area);
          }
        store(stress, c, whole > 0 ? (1 / whole) * force : force);
      });
}

/// Sums over this block's faces of one wall: of the force along `flow`, nN, and of their areas, um2.
template <bool skewed>
Sums<2> wall_force(const GridViews& grid, const ViscousCoefficients& coefficients, int d, int end, double viscosity,
                   const Components<double>& u, const Vec3& flow) {
  const IndexSpace index = grid.index;
  const auto area = grid.face_area[d];
  const ViscousCoefficients g = coefficients;
  CellBox box{{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
  box.lower[d] = end == 0 ? 0 : index.n[d];
  box.upper[d] = box.lower[d] + 1;
  const int n0 = box.upper[0] - box.lower[0], n1 = box.upper[1] - box.lower[1];
  const int lower0 = box.lower[0], lower1 = box.lower[1], lower2 = box.lower[2];
  Sums<2> result;
  Kokkos::parallel_reduce(
      "corpuscle::blood::wall_force", Policy(0, box.size()),
      KOKKOS_LAMBDA(int e, Sums<2>& sum) {
        const int face = index.cell(lower0 + e % n0, lower1 + (e / n0) % n1, lower2 + e / (n0 * n1));
        const Vec3 normal = load(area, face);
        sum[0] += dot(wall_face_force<skewed>(g, index, u, normal, viscosity, d, end, face), flow);
        sum[1] += norm(normal);
      },
      Kokkos::Sum<Sums<2>>(result));
  return result;
}

}  // namespace corpuscle
