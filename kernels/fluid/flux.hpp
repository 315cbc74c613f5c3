// Volume fluxes on faces: interpolation from the nodes, divergence, and the correction by the projection.
#pragma once

#include "common/extremes.hpp"
#include "fluid/masked_gradient.hpp"
#include "fluid/viscosity.hpp"
#include "grid/grid_views.hpp"
#include "grid/halo_copy.hpp"

namespace corpuscle {

/// Box of the faces of direction d that bound owned cells.
inline CellBox face_box(const IndexSpace& index, int d) {
  CellBox box{{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
  box.upper[d] += 1;
  return box;
}

/// grad [cell, 3] = masked gradient of p, less the force, at fluid nodes of owned cells and one halo layer; zero elsewhere.
template <class Force = NoFaceForce>
void pressure_gradient(const GridViews& grid, const Array<NodeKind>& kind, const PressureMask& mask, const Array<double>& p,
                       const Components<double>& grad, const Force& force = {}) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for_box(
      "corpuscle::fluid::pressure_gradient", {-1, -1, -1}, {index.n[0] + 1, index.n[1] + 1, index.n[2] + 1},
      KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(grad, c, kind(c) == NodeKind::fluid ? cell_gradient(p, mask, x, index, c, force) : Vec3{});
      });
}

/// Face fluxes of the provisional velocity. Between fluid nodes the mean velocity is supplemented by the difference of
/// the wide and the compact pressure gradient times V / diagonal, which couples odd and even nodes (Rhie and Chow,
/// AIAA J. 21, 1983); on the boundary and next to bodies the known velocities are used as they are. A force on faces is part
/// of both gradients.
template <bool skewed, class Force = NoFaceForce>
void interpolate_flux(const GridViews& grid, const Array<double> (&coefficient)[3], const Array<NodeKind>& kind, const PressureMask& mask,
                      const Array<double>& diagonal, const Components<double>& u, const Array<double>& p, const Components<double>& grad_p,
                      const Array<double> (&flux)[3], const Force& force = {}) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const auto volume = grid.volume;
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    const auto g = coefficient[d];
    const auto f = flux[d];
    const CellBox box = face_box(index, d);
    for_box(
        "corpuscle::fluid::face_flux", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
          const int c = index.cell(i, j, k), low = c - index.stride(d);
          const Vec3 s = load(area, c);
          if (kind(c) == NodeKind::boundary) {
            f(c) = dot(s, load(u, c));
          } else if (kind(low) == NodeKind::boundary) {
            f(c) = dot(s, load(u, low));
          } else {
            double value = 0.5 * dot(s, load(u, c) + load(u, low));
            if (kind(c) == NodeKind::fluid && kind(low) == NodeKind::fluid) {
              const double reach = 0.5 * (volume(c) / diagonal(c) + volume(low) / diagonal(low));
              const double wide = 0.5 * dot(s, load(grad_p, c) + load(grad_p, low));
              value += reach * (wide - face_gradient<skewed>(p, mask, x, s, g(c), index, d, c, force));
            }
            f(c) = value;
          }
        });
  }
}

/// rhs (compact) = -(net flux out of each fluid cell), zero at other nodes.
inline void negative_divergence(const GridViews& grid, const Array<NodeKind>& kind, const Array<double> (&flux)[3],
                                const Array<double>& rhs) {
  const IndexSpace index = grid.index;
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  const int s0 = index.stride(0), s1 = index.stride(1), s2 = index.stride(2);
  for_owned(
      "corpuscle::fluid::divergence", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        rhs(index.compact(i, j, k)) = kind(c) == NodeKind::fluid ? -(f0(c + s0) - f0(c) + f1(c + s1) - f1(c) + f2(c + s2) - f2(c)) : 0.0;
      });
}

/// Sum of a compact vector.
inline double sum_of(const Array<double>& vector) {
  double total = 0;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::sum_of", Policy(0, static_cast<int>(vector.extent(0))), KOKKOS_LAMBDA(int e, double& sum) { sum += vector(e); },
      total);
  return total;
}

/// flux -= compact gradient of psi on faces whose both nodes have a pressure.
template <bool skewed>
void correct_flux(const GridViews& grid, const Array<double> (&coefficient)[3], const PressureMask& mask, const Array<double>& psi,
                  const Array<double> (&flux)[3]) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for (int d = 0; d < 3; ++d) {
    const auto area = grid.face_area[d];
    const auto g = coefficient[d];
    const auto f = flux[d];
    const CellBox box = face_box(index, d);
    for_box(
        "corpuscle::fluid::correct_flux", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
          const int c = index.cell(i, j, k), low = c - index.stride(d);
          if (mask(c) && mask(low)) f(c) -= face_gradient<skewed>(psi, mask, x, load(area, c), g(c), index, d, c);
        });
  }
}

/// u -= gradient of psi at fluid nodes.
inline void correct_velocity(const GridViews& grid, const Array<NodeKind>& kind, const PressureMask& mask, const Array<double>& psi,
                             const Components<double>& u) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  for_owned(
      "corpuscle::fluid::correct_velocity", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) == NodeKind::fluid) store(u, c, load(u, c) - cell_gradient(psi, mask, x, index, c));
      });
}

/// p += mass psi - share mu div u*: the rotational incremental form (Timmermans, Minev and Van de Vosse 1996). With
/// share = 1 it is only just stable: beside bodies, where the velocity is reconstructed, the force on a sphere held in a
/// flow oscillated with growing amplitude from nu dt / h^2 of about 20 on, and a cell in a grid of 0.1 um blew up. Shares
/// below 2/3 are stable for any step in three dimensions (Guermond, Minev and Shen, Comput. Methods Appl. Mech. Eng.
/// 195, 2006) and keep the order; the sphere's force is then steady to five digits. Where the viscosity varies the pressure goes by
/// what yields most about a cell: by the cell's own viscosity it overshot beside a thinner fluid or a side, and between cells with 20 to
/// 50 times the viscosity of the fluid around it blew up. `negative` is -V div u* in compact order.
template <class Viscosity>
void update_pressure(const GridViews& grid, const Array<NodeKind>& kind, double mass, double mu, const Viscosity& viscosity,
                     const Array<double>& psi, const Array<double>& negative, const Array<double>& p) {
  constexpr double share = 0.6;
  const Viscosity relative = viscosity;
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for_owned(
      "corpuscle::fluid::update_pressure", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) == NodeKind::fluid)
          p(c) += mass * psi(c) + share * mu * yielding_viscosity(relative, index, c) * negative(index.compact(i, j, k)) / volume(c);
      });
}

inline void scalar_from_compact(const IndexSpace& index, const Array<double>& vector, const Array<double>& field) {
  for_owned(
      "corpuscle::fluid::scalar_from_vector", index,
      KOKKOS_LAMBDA(int i, int j, int k) { field(index.cell(i, j, k)) = vector(index.compact(i, j, k)); });
}

inline void compact_from_scalar(const IndexSpace& index, const Array<double>& field, const Array<double>& vector) {
  for_owned(
      "corpuscle::fluid::vector_from_scalar", index,
      KOKKOS_LAMBDA(int i, int j, int k) { vector(index.compact(i, j, k)) = field(index.cell(i, j, k)); });
}

/// change (compact) = field - before (compact).
inline void compact_difference(const IndexSpace& index, const Array<double>& field, const Array<double>& before,
                               const Array<double>& change) {
  for_owned(
      "corpuscle::fluid::vector_difference", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int e = index.compact(i, j, k);
        change(e) = field(index.cell(i, j, k)) - before(e);
      });
}

/// Largest magnitude in a compact vector; not a number if any entry is not.
inline double largest_magnitude(const Array<double>& vector) {
  double largest = 0;
  Kokkos::parallel_reduce(
      "corpuscle::fluid::largest_magnitude", Policy(0, static_cast<int>(vector.extent(0))),
      KOKKOS_LAMBDA(int e, double& most) {
        const double a = vector(e) < 0 ? -vector(e) : vector(e);
        most = larger(most, a);
      },
      Largest(largest));
  return largest;
}

/// [cell] 1 where pressure has a value: fluid nodes, and boundary nodes that `outflow` marks.
inline void mark_pressure(const Array<NodeKind>& kind, const PressureMask& outflow, const PressureMask& mask) {
  Kokkos::parallel_for(
      "corpuscle::fluid::pressure_mask", Policy(0, static_cast<int>(kind.extent(0))),
      KOKKOS_LAMBDA(int c) { mask(c) = kind(c) == NodeKind::fluid || outflow(c) ? 1 : 0; });
}

}  // namespace corpuscle
