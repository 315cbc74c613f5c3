// Values of a box of cells in file order (k slowest, i fastest, components of one cell side by side).
#pragma once

#include "grid/halo_copy.hpp"

namespace corpuscle {

/// Calls body(position in the box, padded cell number).
template <class Body>
void for_box_positions(const char* label, const IndexSpace& index, const CellBox& box, const Body& body) {
  const int nx = box.upper[0] - box.lower[0], ny = box.upper[1] - box.lower[1];
  const int lx = box.lower[0], ly = box.lower[1], lz = box.lower[2];
  Kokkos::parallel_for(
      label, Policy(0, box.size()), KOKKOS_LAMBDA(int e) { body(e, index.cell(lx + e % nx, ly + (e / nx) % ny, lz + e / (nx * ny))); });
}

template <class Field, class Buffer>
void gather_box(const IndexSpace& index, const CellBox& box, const Field& field, const Buffer& buffer) {
  for_box_positions(
      "corpuscle::output::gather", index, box, KOKKOS_LAMBDA(int e, int c) { buffer(e) = field(c); });
}

template <class Field, class Buffer>
void scatter_box(const IndexSpace& index, const CellBox& box, const Buffer& buffer, const Field& field) {
  using Value = typename Field::non_const_value_type;
  for_box_positions(
      "corpuscle::output::scatter", index, box, KOKKOS_LAMBDA(int e, int c) { field(c) = static_cast<Value>(buffer(e)); });
}

template <class Field, class Buffer>
void gather_vectors(const IndexSpace& index, const CellBox& box, const Field& field, const Buffer& buffer) {
  for_box_positions(
      "corpuscle::output::gather_vectors", index, box, KOKKOS_LAMBDA(int e, int c) {
        for (int m = 0; m < 3; ++m) buffer(3 * e + m) = field(c, m);
      });
}

template <class Field, class Buffer>
void scatter_vectors(const IndexSpace& index, const CellBox& box, const Buffer& buffer, const Field& field) {
  for_box_positions(
      "corpuscle::output::scatter_vectors", index, box, KOKKOS_LAMBDA(int e, int c) {
        for (int m = 0; m < 3; ++m) field(c, m) = buffer(3 * e + m);
      });
}

}  // namespace corpuscle
