// Immersed nodes inside the flow solver: their part of the momentum operator, and the flux that compatibility demands
// through the faces around each body.
#pragma once

#include "common/vec3.hpp"
#include "fluid/embedded.hpp"
#include "grid/grid_views.hpp"

namespace corpuscle {

/// u_row = sum of weight u[column]: the rows' part of the linear operator, with the surface at rest.
template <class Velocity>
void apply_homogeneous_rows(const EmbeddedBodies& b, const Velocity& u) {
  const StencilViews row = b.velocity;
  Kokkos::parallel_for(
      "corpuscle::immersed::homogeneous_rows", Policy(0, b.rows), KOKKOS_LAMBDA(int r) {
        Vec3 sum;
        for (int n = 0; n < row.columns(r); ++n) sum += row.weight(r, n) * to_double(load(u, row.column(r, n)));
        store(u, row.node(r), sum);
      });
}

/// sums [body, 2] = flux into the fluid through the faces of each body, and their total area, over the faces that this rank
/// counts.
inline void body_flux_sums(const GridViews& grid, const EmbeddedBodies& b, const Array<double> (&flux)[3], const Table<double>& sums) {
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const FaceViews face = b.faces;
  const auto start = face.start;
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  Kokkos::parallel_for(
      "corpuscle::immersed::flux_sums", Kokkos::TeamPolicy<Exec>(b.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = team.league_rank();
        double into = 0, total = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, start(body), start(body + 1)),
            [&](int n, double& sum) {
              const int d = face.direction(n), c = face.cell(n);
              sum += face.counted(n) * face.sign(n) * (d == 0 ? f0 : (d == 1 ? f1 : f2))(c);
            },
            into);
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, start(body), start(body + 1)),
            [&](int n, double& sum) {
              const int d = face.direction(n), c = face.cell(n);
              sum += face.counted(n) * norm(load(d == 0 ? area0 : (d == 1 ? area1 : area2), c));
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          sums(body, 0) = into;
          sums(body, 1) = total;
        });
      });
}

/// Spread what is missing from `growth` evenly over the area of each body's faces, so that the net flux into the fluid
/// equals the body's growth. `sums` holds the totals over all ranks.
inline void correct_body_flux(const GridViews& grid, const EmbeddedBodies& b, const Table<double>& sums, const Array<double> (&flux)[3]) {
  const auto f0 = flux[0], f1 = flux[1], f2 = flux[2];
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const FaceViews face = b.faces;
  const auto start = face.start;
  const auto growth = b.growth;
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  Kokkos::parallel_for(
      "corpuscle::immersed::correct_flux", Kokkos::TeamPolicy<Exec>(b.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = team.league_rank();
        const double missing = (growth(body) - sums(body, 0)) / (sums(body, 1) > 0 ? sums(body, 1) : 1.0);
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, start(body), start(body + 1)), [&](int n) {
          const int d = face.direction(n), c = face.cell(n);
          (d == 0 ? f0 : (d == 1 ? f1 : f2))(c) += face.sign(n) * missing * norm(load(d == 0 ? area0 : (d == 1 ? area1 : area2), c));
        });
      });
}

}  // namespace corpuscle
