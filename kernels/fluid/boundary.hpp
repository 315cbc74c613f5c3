// Velocity on the physical sides of the block: filling the first layer beyond them.
#pragma once

#include "common/vec3.hpp"
#include "grid/grid_views.hpp"
#include "grid/halo_copy.hpp"

namespace corpuscle {

/// Zero normal derivative (outflow): the boundary takes the velocity of the cell beside it.
template <class Velocity>
void fill_outflow(const IndexSpace& index, const CellBox& side, int inward_offset, const Velocity& u) {
  for_box(
      "corpuscle::fluid::outflow", side.lower, side.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(u, c, load(u, c + inward_offset));
      });
}

/// No flow through the side and no shear on it: the normal part of the neighbouring velocity is taken out. `area` are
/// the face area vectors normal to the side, and `area_offset` leads from a boundary node to its face; nodes on the
/// block's edges, whose own face is a line, take the normal of the nearest node of `faces`.
template <class Velocity>
void fill_symmetry(const IndexSpace& index, const CellBox& side, const CellBox& faces, int inward_offset, int area_offset,
                   const Components<double>& area, const Velocity& u) {
  const int lx = faces.lower[0], ly = faces.lower[1], lz = faces.lower[2];
  const int ux = faces.upper[0] - 1, uy = faces.upper[1] - 1, uz = faces.upper[2] - 1;
  for_box(
      "corpuscle::fluid::symmetry", side.lower, side.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        const int f = index.cell(i < lx ? lx : (i > ux ? ux : i), j < ly ? ly : (j > uy ? uy : j), k < lz ? lz : (k > uz ? uz : k));
        const Vec3 s = load(area, f + area_offset), inner = to_double(load(u, c + inward_offset));
        const double square = dot(s, s);
        store(u, c, square > 0 ? inner - (dot(inner, s) / square) * s : inner);
      });
}

/// Boundary nodes whose velocity is given, and whether it is zero.
struct GivenBoxes {
  CellBoxes boxes;
  bool zero[CellBoxes::most] = {};
};

/// Velocity given: zero where it always is, or everywhere (`homogeneous`, for the linear operator alone), else the values in `given`.
template <class Velocity>
void fill_given(const IndexSpace& index, const GivenBoxes& sides, bool homogeneous, const Components<double>& given, const Velocity& u) {
  GivenBoxes in = sides;
  for (bool& zero : in.zero) zero = zero || homogeneous;
  for_boxes(
      "corpuscle::fluid::given_velocity", in.boxes, KOKKOS_LAMBDA(int b, int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(u, c, in.zero[b] ? Vec3{} : load(given, c));
      });
}

template <class Velocity>
void fill_zero(const IndexSpace& index, const CellBox& side, const Velocity& u) {
  for_box(
      "corpuscle::fluid::no_slip", side.lower, side.upper, KOKKOS_LAMBDA(int i, int j, int k) { store(u, index.cell(i, j, k), Vec3{}); });
}

/// Sum over the faces of a box of `sign` times the flux, and of their areas.
struct FluxAndArea {
  double flux = 0, area = 0;
};
inline FluxAndArea side_flux(const IndexSpace& index, const CellBox& faces, double sign, const Components<double>& area,
                             const Array<double>& flux) {
  FluxAndArea result;
  const int nx = faces.upper[0] - faces.lower[0], ny = faces.upper[1] - faces.lower[1];
  const int lx = faces.lower[0], ly = faces.lower[1], lz = faces.lower[2];
  Kokkos::parallel_reduce(
      "corpuscle::fluid::side_flux", Policy(0, faces.size()),
      KOKKOS_LAMBDA(int e, double& net, double& total) {
        const int c = index.cell(lx + e % nx, ly + (e / nx) % ny, lz + e / (nx * ny));
        net += sign * flux(c);
        total += norm(load(area, c));
      },
      result.flux, result.area);
  return result;
}

/// flux += per_area times the area of each face.
inline void spread_flux(const IndexSpace& index, const CellBox& faces, double per_area, const Components<double>& area,
                        const Array<double>& flux) {
  for_box(
      "corpuscle::fluid::spread_flux", faces.lower, faces.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        flux(c) += per_area * norm(load(area, c));
      });
}

inline void clear_flux(const IndexSpace& index, const CellBox& faces, const Array<double>& flux) {
  for_box(
      "corpuscle::fluid::closed_faces", faces.lower, faces.upper, KOKKOS_LAMBDA(int i, int j, int k) { flux(index.cell(i, j, k)) = 0; });
}

/// mask = 1 over a box.
template <class Mask>
void mark_box(const IndexSpace& index, const CellBox& box, const Mask& mask) {
  for_box(
      "corpuscle::fluid::mark_box", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) { mask(index.cell(i, j, k)) = 1; });
}

/// given = factor * profile on one side.
inline void scale_profile(const IndexSpace& index, const CellBox& side, const Components<double>& profile, double factor,
                          const Components<double>& given) {
  for_box(
      "corpuscle::fluid::inlet_profile", side.lower, side.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        store(given, c, factor * load(profile, c));
      });
}

}  // namespace corpuscle
