// Reductions over the flow field.
#pragma once

#include "common/extremes.hpp"
#include "fluid/embedded.hpp"
#include "fluid/momentum.hpp"

namespace corpuscle {

/// Reduce over owned cells: `body(i, j, k, value)`.
template <class Body, class Reducer>
void reduce_owned(const char* label, const IndexSpace& index, const Body& body, const Reducer& reducer) {
  using Value = typename Reducer::value_type;
  Kokkos::parallel_reduce(
      label, Policy(0, index.owned()), KOKKOS_LAMBDA(int e, Value& value) { index.visit_compact(e, body, value); }, reducer);
}

/// Padded number of this rank's first fluid cell, -1 if it has none.
inline int first_fluid_cell(const IndexSpace& index, const Array<NodeKind>& kind) {
  int first = index.size();
  reduce_owned(
      "corpuscle::fluid::first_fluid_cell", index,
      KOKKOS_LAMBDA(int i, int j, int k, int& least) {
        const int c = index.cell(i, j, k);
        if (kind(c) == NodeKind::fluid && c < least) least = c;
      },
      Kokkos::Min<int>(first));
  return first < index.size() ? first : -1;
}

/// mark = 1 at nodes of outflow sides and at `pinned` (-1 for none).
inline void seed_marks(const PressureMask& outflow, int pinned, const Array<int>& mark) {
  Kokkos::parallel_for(
      "corpuscle::fluid::seed_marks", Policy(0, static_cast<int>(mark.extent(0))), KOKKOS_LAMBDA(int c) {
        if (outflow(c) || c == pinned) mark(c) = 1;
      });
}

/// next = mark, and 1 in fluid cells beside a marked one. @returns how many of this rank's were not marked yet.
inline int spread_marks(const IndexSpace& index, const Array<NodeKind>& kind, const Array<int>& mark, const Array<int>& next) {
  int added = 0;
  const int s1 = index.stride(1), s2 = index.stride(2);
  reduce_owned(
      "corpuscle::fluid::spread_marks", index,
      KOKKOS_LAMBDA(int i, int j, int k, int& sum) {
        const int c = index.cell(i, j, k);
        const int beside = mark(c - 1) | mark(c + 1) | mark(c - s1) | mark(c + s1) | mark(c - s2) | mark(c + s2);
        next(c) = mark(c) | (kind(c) == NodeKind::fluid ? beside : 0);
        sum += next(c) - mark(c);
      },
      Kokkos::Sum<int>(added));
  return added;
}

/// This rank's fluid cells without a mark.
inline int unmarked_cells(const IndexSpace& index, const Array<NodeKind>& kind, const Array<int>& mark) {
  int count = 0;
  reduce_owned(
      "corpuscle::fluid::unmarked_cells", index,
      KOKKOS_LAMBDA(int i, int j, int k, int& sum) {
        const int c = index.cell(i, j, k);
        if (kind(c) == NodeKind::fluid && mark(c) == 0) sum += 1;
      },
      Kokkos::Sum<int>(count));
  return count;
}

/// Largest velocity magnitude at fluid nodes, 0 without any; not a number if any is not.
inline double largest_speed(const IndexSpace& index, const Array<NodeKind>& kind, const Components<double>& u) {
  double square = 0;
  reduce_owned(
      "corpuscle::fluid::largest_speed", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::fluid) return;
        const double s = dot(load(u, c), load(u, c));
        most = larger(most, s);
      },
      Largest(square));
  return std::sqrt(larger(square, 0));
}

/// Sum over fluid nodes of (mass V inverse)^2 |u - before|^2: how far a change of the velocity over a step leaves a momentum
/// equation without its viscous part, scaled as momentum_residual() scales residuals.
inline double inertia_square(const GridViews& grid, const Array<NodeKind>& kind, double mass_over_mu, const Array<float>& inverse,
                             const Components<double>& u, const Components<double>& before) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  double sum = 0;
  reduce_owned(
      "corpuscle::fluid::inertia_square", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& total) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::fluid) return;
        const Vec3 change = (mass_over_mu * volume(c) * inverse(c)) * (load(u, c) - load(before, c));
        total += dot(change, change);
      },
      Kokkos::Sum<double>(sum));
  return sum;
}

/// Sum of squares of a vector field over fluid nodes.
inline double owned_square(const IndexSpace& index, const Array<NodeKind>& kind, const Components<double>& field) {
  double sum = 0;
  reduce_owned(
      "corpuscle::fluid::sum_of_squares", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& total) {
        const int c = index.cell(i, j, k);
        if (kind(c) == NodeKind::fluid) total += dot(load(field, c), load(field, c));
      },
      Kokkos::Sum<double>(sum));
  return sum;
}

/// Integral of u over the volume, um4/us; cells inside bodies count with the velocity stored there.
inline void volume_integral(const GridViews& grid, const Array<NodeKind>& kind, const Components<double>& u, double (&result)[3]) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  for (int m = 0; m < 3; ++m) {
    result[m] = 0;
    reduce_owned(
        "corpuscle::fluid::volume_integral", index,
        KOKKOS_LAMBDA(int i, int j, int k, double& total) {
          const int c = index.cell(i, j, k);
          if (kind(c) != NodeKind::none) total += volume(c) * u(c, m);
        },
        Kokkos::Sum<double>(result[m]));
  }
}

/// result -= viscous forces on each fluid cell, nN.
template <bool skewed>
void subtract_viscous(const GridViews& grid, const ViscousCoefficients& g, const Array<NodeKind>& kind, double mu,
                      const Components<double>& u, const Components<double>& result) {
  const IndexSpace index = grid.index;
  for_owned(
      "corpuscle::fluid::viscous_force", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        if (kind(c) != NodeKind::fluid) return;
        for (int m = 0; m < 3; ++m)
          for (int d = 0; d < 3; ++d)
            result(c, m) -=
                mu * (viscous_face<skewed>(g, u, index, d, c + index.stride(d), m) - viscous_face<skewed>(g, u, index, d, c, m));
      });
}

/// force [body, 3] = pressure and viscous force that the fluid puts on each body through the faces around it, nN: what
/// leaves the fluid's momentum balance there. `gradient` is the imposed part of the pressure's. The pressure on a face is that of the fluid
/// node, extended along the face's direction where the next node has one.
template <bool skewed>
void momentum_balance(const GridViews& grid, const ViscousCoefficients& g, const Array<unsigned char>& mask, double mu,
                      const Vec3& gradient, const Components<double>& u, const Array<double>& p, const EmbeddedBodies& b,
                      const Table<double>& force) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const auto area0 = grid.face_area[0], area1 = grid.face_area[1], area2 = grid.face_area[2];
  const FaceViews face = b.faces;
  const Images images = b.images;
  const auto start = face.start;
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  Kokkos::parallel_for(
      "corpuscle::immersed::momentum_balance", Kokkos::TeamPolicy<Exec>(b.bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int body = team.league_rank();
        for (int m = 0; m < 3; ++m) {
          double total = 0;
          Kokkos::parallel_reduce(
              Kokkos::TeamThreadRange(team, start(body), start(body + 1)),
              [&](int n, double& sum) {
                const int d = face.direction(n), c = face.cell(n), stride = index.stride(d), sign = face.sign(n);
                const int fluid = sign > 0 ? c : c - stride, beyond = fluid + sign * stride;
                if (face.counted(n) == 0) return;
                // Where the body is, not its image: across a periodic side the imposed pressure jumps.
                const Vec3 at = 0.5 * (load(x, c) + load(x, c - stride)) - images.shift[face.image(n)];
                const double p_face = (mask(beyond) ? p(fluid) + 0.5 * (p(fluid) - p(beyond)) : p(fluid)) + dot(gradient, at);
                const double s = (d == 0 ? area0 : (d == 1 ? area1 : area2))(c, m);
                sum += sign * (mu * viscous_face<skewed>(g, u, index, d, c, m) - p_face * s);
              },
              total);
          Kokkos::single(Kokkos::PerTeam(team), [&]() { force(body, m) = total; });
        }
      });
}

}  // namespace corpuscle
