// Whole cells into and out of messages: the vertices of one cell after the other, the components of one vertex (up to three) side by
// side.
#pragma once

#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

/// Cells in a message.
struct ParcelViews {
  int count = 0;
  Array<int> cell;      // [count] number on this rank
  Array<int> first;     // [count + 1] vertex in the message
  Table<double> shift;  // [count, 3] um, by which the receiver sees them moved; without entries: none
};

/// @param shifted  the field is of positions
inline void pack_cells(const ParcelViews& parcels, const Array<int>& first_vertex, const Components<double>& field, bool shifted,
                       const Table<double>& message) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const ParcelViews p = parcels;
  const int columns = static_cast<int>(field.extent(1));
  Kokkos::parallel_for(
      "corpuscle::cells::pack", Kokkos::TeamPolicy<Exec>(p.count, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int n = team.league_rank(), to = p.first(n), from = first_vertex(p.cell(n));
        const Vec3 by = shifted ? Vec3{p.shift(n, 0), p.shift(n, 1), p.shift(n, 2)} : Vec3{};
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, p.first(n + 1) - to), [&](int i) {
          for (int d = 0; d < columns; ++d) message(to + i, d) = shifted ? field(from + i, d) + by[d] : field(from + i, d);
        });
      });
}

inline void unpack_cells(const ParcelViews& parcels, const Array<int>& first_vertex, const Table<double>& message,
                         const Components<double>& field) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const ParcelViews p = parcels;
  const int columns = static_cast<int>(field.extent(1));
  Kokkos::parallel_for(
      "corpuscle::cells::unpack", Kokkos::TeamPolicy<Exec>(p.count, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int n = team.league_rank(), from = p.first(n), to = first_vertex(p.cell(n));
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, p.first(n + 1) - from), [&](int i) {
          for (int d = 0; d < columns; ++d) field(to + i, d) = message(from + i, d);
        });
      });
}

/// Which parts add up to the value of a cell, in which order.
struct PartsViews {
  int count = 0;
  Array<int> cell;   // [count] those that have copies
  Array<int> first;  // [count + 1] into `from`
  Array<int> from;   // first vertex of the copy in the message; -1: what the cell has here
};

/// field [vertex, 3] = the sum of the parts.
inline void add_parts(const PartsViews& parts, const Array<int>& first_vertex, const Table<double>& message,
                      const Components<double>& field) {
  using Team = Kokkos::TeamPolicy<Exec>::member_type;
  const PartsViews p = parts;
  Kokkos::parallel_for(
      "corpuscle::cells::add_parts", Kokkos::TeamPolicy<Exec>(p.count, Kokkos::AUTO), KOKKOS_LAMBDA(const Team& team) {
        const int cell = p.cell(team.league_rank()), begin = first_vertex(cell);
        const int first = p.first(team.league_rank()), last = p.first(team.league_rank() + 1);
        Kokkos::parallel_for(Kokkos::TeamThreadRange(team, first_vertex(cell + 1) - begin), [&](int i) {
          Vec3 sum;
          for (int n = first; n < last; ++n) {
            const int from = p.from(n);
            for (int d = 0; d < 3; ++d) sum[d] += from < 0 ? field(begin + i, d) : message(from + i, d);
          }
          store(field, begin + i, sum);
        });
      });
}

}  // namespace corpuscle
