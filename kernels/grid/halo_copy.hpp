// Copies between cell views and halo buffers.
#pragma once

#include "grid/index_space.hpp"

namespace corpuscle {

/// The values of one cell, to or from a buffer with `size` entries a component. (Functions of their own: a device
/// lambda must not capture anything first inside an `if constexpr`.)
template <class Field, class Buffer>
KOKKOS_INLINE_FUNCTION void pack_cell(const Field& field, int c, const Buffer& buffer, int at, int size) {
  if constexpr (Field::rank == 1) {
    buffer(at) = field(c);
  } else {
    for (int m = 0; m < static_cast<int>(field.extent(1)); ++m) buffer(at + m * size) = field(c, m);
  }
}

template <class Field, class Buffer>
KOKKOS_INLINE_FUNCTION void unpack_cell(const Field& field, int c, const Buffer& buffer, int at, int size) {
  if constexpr (Field::rank == 1) {
    field(c) = buffer(at);
  } else {
    for (int m = 0; m < static_cast<int>(field.extent(1)); ++m) field(c, m) = buffer(at + m * size);
  }
}

template <class Field>
KOKKOS_INLINE_FUNCTION void copy_cell(const Field& field, int from, int to) {
  if constexpr (Field::rank == 1) {
    field(to) = field(from);
  } else {
    for (int m = 0; m < static_cast<int>(field.extent(1)); ++m) field(to, m) = field(from, m);
  }
}

/// buffer[component * box.size() + position in box] = field(cell, component)
template <class Field, class Buffer>
void pack_box(const IndexSpace& index, const CellBox& box, const Field& field, const Buffer& buffer) {
  const auto lower = box.lower, upper = box.upper;
  const int nx = upper[0] - lower[0], ny = upper[1] - lower[1], size = box.size();
  const int lx = lower[0], ly = lower[1], lz = lower[2];
  for_box(
      "corpuscle::halo::pack", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) {
        pack_cell(field, index.cell(i, j, k), buffer, (i - lx) + nx * ((j - ly) + ny * (k - lz)), size);
      });
}

template <class Field, class Buffer>
void unpack_box(const IndexSpace& index, const CellBox& box, const Buffer& buffer, const Field& field) {
  const auto lower = box.lower, upper = box.upper;
  const int nx = upper[0] - lower[0], ny = upper[1] - lower[1], size = box.size();
  const int lx = lower[0], ly = lower[1], lz = lower[2];
  for_box(
      "corpuscle::halo::unpack", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) {
        unpack_cell(field, index.cell(i, j, k), buffer, (i - lx) + nx * ((j - ly) + ny * (k - lz)), size);
      });
}

/// Where a coordinate of a halo cell comes from around a period of n cells.
KOKKOS_FORCEINLINE_FUNCTION int around_period(int at, int n) { return at < 0 ? at + n : (at >= n ? at - n : at); }

/// field over `targets`, halo cells, = field at the other ends of the periods along the directions `wraps`.
template <class Field>
void copy_around_periods(const IndexSpace& index, const CellBoxes& targets, const std::array<bool, 3>& wraps, const Field& field) {
  const bool w0 = wraps[0], w1 = wraps[1], w2 = wraps[2];
  for_boxes(
      "corpuscle::halo::periodic", targets, KOKKOS_LAMBDA(int, int i, int j, int k) {
        const int from =
            index.cell(w0 ? around_period(i, index.n[0]) : i, w1 ? around_period(j, index.n[1]) : j, w2 ? around_period(k, index.n[2]) : k);
        copy_cell(field, from, index.cell(i, j, k));
      });
}

/// buffer = the values of cells cell[first .. last), those of each cell side by side.
template <class Field, class Buffer>
void pack_cells(const Array<int>& cell, int first, int last, const Field& field, const Buffer& buffer) {
  const auto cells = cell;
  const int components = static_cast<int>(Field::rank) == 1 ? 1 : static_cast<int>(field.extent(1));
  Kokkos::parallel_for(
      "corpuscle::halo::pack_cells", Policy(first, last), KOKKOS_LAMBDA(int e) { pack_cell(field, cells(e), buffer, components * e, 1); });
}

template <class Field, class Buffer>
void unpack_cells(const Array<int>& cell, int first, int last, const Buffer& buffer, const Field& field) {
  const auto cells = cell;
  const int components = static_cast<int>(Field::rank) == 1 ? 1 : static_cast<int>(field.extent(1));
  Kokkos::parallel_for(
      "corpuscle::halo::unpack_cells", Policy(first, last),
      KOKKOS_LAMBDA(int e) { unpack_cell(field, cells(e), buffer, components * e, 1); });
}

}  // namespace corpuscle
