// What keeps forces and velocities sharp between faces and vertices. A kernel smears them by its second moment each way, so that a
// load that varies along a membrane, as on anything bent, moves the fluid less than it should: by l (l + 1) / 2 times that moment of
// both ways over the square of a sphere's radius, for the part of order l. A second difference takes it back. The same along all
// directions: else a uniform load is no gradient on the grid, and no pressure balances it.
#pragma once

#include "fluid/flux.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// Whether the second difference along e is taken in this row of cells, or of faces across e: not on a side, where fluxes are given,
/// nor in the cells beside it.
KOKKOS_INLINE_FUNCTION bool sharpens(const Lattice& lattice, int e, bool faces, int row) {
  const int last = lattice.index.n[e] - (faces ? 0 : 1);
  return !(lattice.boundary_below[e] && row <= 0) && !(lattice.boundary_above[e] && row >= last);
}

/// sharp = raw less half of `moment`, in spacings squared, times the second differences, at the faces of direction d of this rank;
/// raw's next to them must be valid. `transposed`: the same with rows and columns exchanged.
template <class Raw, class Sharp>
void sharpen_faces(const Lattice& block_lattice, int d, double moment, bool transposed, const Raw& raw_faces, const Sharp& sharp_faces) {
  const Lattice lattice = block_lattice;
  const IndexSpace index = lattice.index;
  const Raw raw = raw_faces;
  const Sharp sharp = sharp_faces;
  const double share = 0.5 * moment;
  const CellBox box = face_box(index, d);
  for_box(
      "corpuscle::transfer::sharpen", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), at[3] = {i, j, k};
        double value = raw(c);
        for (int e = 0; e < 3; ++e) {
          const int s = index.stride(e);
          const bool here = sharpens(lattice, e, e == d, at[e]);
          const bool below = transposed ? sharpens(lattice, e, e == d, at[e] - 1) : here;
          const bool above = transposed ? sharpens(lattice, e, e == d, at[e] + 1) : here;
          if (here) value += 2 * share * raw(c);
          if (below) value -= share * raw(c - s);
          if (above) value -= share * raw(c + s);
        }
        sharp(c) = value;
      });
}

/// Of two vectors [cell, 3] at the faces of direction d, over the length of the first.
inline double largest_difference(const IndexSpace& index, int d, const Components<double>& a, const Components<double>& b) {
  double most = 0;
  const CellBox box = face_box(index, d);
  const int n0 = box.upper[0], n1 = box.upper[1], n2 = box.upper[2];
  Kokkos::parallel_reduce(
      "corpuscle::transfer::largest_difference", Policy(0, n0 * n1 * n2),
      KOKKOS_LAMBDA(int e, double& largest) {
        const int c = index.cell(e % n0, (e / n0) % n1, e / (n0 * n1));
        const double size = norm(load(a, c)), difference = norm(load(a, c) - load(b, c));
        if (difference > largest * size) largest = difference / size;
      },
      Kokkos::Max<double>(most));
  return most;
}

inline void copy_faces(const IndexSpace& index, int d, const Array<double>& from, const Array<double>& to) {
  const CellBox box = face_box(index, d);
  for_box(
      "corpuscle::transfer::copy_faces", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        to(c) = from(c);
      });
}

}  // namespace corpuscle
