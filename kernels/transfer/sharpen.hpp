// What takes back the averaging between faces and centres. The momentum equation knows forces at centres, as means of faces, and
// fluxes through faces are means of centres: each way a component is smeared along its own direction by a second moment of a
// quarter of a spacing squared, beyond what the kernel does. A face less an eighth of the second difference along its direction
// has none of it.
#pragma once

#include "fluid/flux.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

/// sharp = raw less an eighth of its second difference, at the faces of direction d of this rank; raw's next to them must be
/// valid. Faces on a side are left as they are: fluxes there are given. `transposed`: the same with rows and columns exchanged.
inline void sharpen_faces(const TransferBlock& transfer_block, int d, bool transposed, const Array<double>& raw,
                          const Array<double>& sharp) {
  const Lattice lattice = transfer_block.lattice;
  const IndexSpace index = lattice.index;
  const bool low = lattice.boundary_below[d], high = lattice.boundary_above[d];
  const CellBox box = face_box(index, d);
  const int s = index.stride(d), n = index.n[d];
  const double beside = transposed ? 0 : 1;  // whether faces beside a side see what is on it
  for_box("corpuscle::transfer::sharpen", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k), row = d == 0 ? i : (d == 1 ? j : k);
    const double own = low && row == 0 ? 0 : (high && row == n ? 0 : 1);
    const double below = low && row == 1 ? beside : own, above = high && row == n - 1 ? beside : own;
    const double of_low = low && row == 0 ? 0 : below, of_high = high && row == n ? 0 : above;
    double value = (1 + 0.25 * own) * raw(c) - 0.125 * (of_low * raw(c - s) + of_high * raw(c + s));
    if (transposed && low && row == 0) value -= 0.125 * raw(c + s);
    if (transposed && high && row == n) value -= 0.125 * raw(c - s);
    sharp(c) = value;
  });
}

inline void copy_faces(const IndexSpace& index, int d, const Array<double>& from, const Array<double>& to) {
  const CellBox box = face_box(index, d);
  for_box("corpuscle::transfer::copy_faces", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    to(c) = from(c);
  });
}

}  // namespace corpuscle
