// What keeps forces and velocities sharp between faces and vertices. A kernel smears them by its second moment each way, so that a
// load that varies along a membrane, as on anything bent, moves the fluid less than it should: by l (l + 1) / 2 times that moment of
// both ways over the square of a sphere's radius, for the part of order l. A second difference takes it back. The same along all
// directions: else a uniform load is no gradient on the grid, and no pressure balances it.
#pragma once

#include "fluid/flux.hpp"
#include "transfer/marker_views.hpp"

namespace corpuscle {

enum class Sharpen { areas, fluxes, forces };  // forces: with rows and columns of the other two exchanged

/// The value beyond a side that a face beside it sees, which mirrors the face itself: its area; or its flux, which is then that of the
/// velocity on the side twice less the face's own where the side gives the velocity. @param beyond  the node on the side
KOKKOS_INLINE_FUNCTION double mirrored(const TransferBlock& block, Sharpen what, int d, int e, int end, int c, int beyond,
                                       const Components<double>& u, double own) {
  const double reflection = what == Sharpen::areas ? 1 : block.reflection[e][end][0];
  if (what != Sharpen::fluxes || reflection > 0) return reflection * own;
  return reflection * own + dot(load(block.area[d], c), load(u, beyond) + load(u, beyond - block.index().stride(d)));
}

/// sharpen_faces() within a box.
template <class Raw, class Sharp>
void sharpen_box(const TransferBlock& transfer_block, Sharpen what, int d, double moment, const Components<double>& u, const Raw& raw_faces,
                 const Sharp& sharp_faces, const CellBox& box) {
  const TransferBlock block = transfer_block;
  const IndexSpace index = block.index();
  const Raw raw = raw_faces;
  const Sharp sharp = sharp_faces;
  const double share = 0.5 * moment;
  for_box(
      "corpuscle::transfer::sharpen", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const Lattice& lattice = block.lattice;
        const int c = index.cell(i, j, k), at[3] = {i, j, k}, row = at[d], last = index.n[d], across = index.stride(d);
        const auto between = [&](int r) { return !(lattice.boundary_below[d] && r <= 0) && !(lattice.boundary_above[d] && r >= last); };
        const bool own = between(row), turned = what == Sharpen::forces;
        double sum = own ? 2 * raw(c) : 0.0;
        if (turned ? between(row - 1) : own) sum -= raw(c - across);
        if (turned ? between(row + 1) : own) sum -= raw(c + across);
        for (int n = 1; n < 3 && own; ++n) {
          const int e = (d + n) % 3, s = index.stride(e);
          const bool below = lattice.boundary_below[e] && at[e] == 0, above = lattice.boundary_above[e] && at[e] == index.n[e] - 1;
          sum += 2 * raw(c) - (below ? mirrored(block, what, d, e, 0, c, c - s, u, raw(c)) : raw(c - s)) -
                 (above ? mirrored(block, what, d, e, 1, c, c + s, u, raw(c)) : raw(c + s));
        }
        sharp(c) = raw(c) + share * sum;
      });
}

/// The same where no face sees a side, in lines that vectorise.
template <class Raw, class Sharp>
void sharpen_inside(const IndexSpace& cells, int d, double moment, const Raw& raw_faces, const Sharp& sharp_faces, const CellBox& box) {
  const IndexSpace index = cells;
  const Raw raw = raw_faces;
  const Sharp sharp = sharp_faces;
  const double share = 0.5 * moment;
  const int across = index.stride(d), s = index.stride((d + 1) % 3), t = index.stride((d + 2) % 3);
  for_box(
      "corpuscle::transfer::sharpen_inside", box.lower, box.upper, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        double sum = 2 * raw(c) - raw(c - across) - raw(c + across);
        sum += 2 * raw(c) - raw(c - s) - raw(c + s);
        sum += 2 * raw(c) - raw(c - t) - raw(c + t);
        sharp(c) = raw(c) + share * sum;
      });
}

/// sharp = raw less half of `moment`, in spacings squared, times the second differences, at the faces of direction d of this rank;
/// raw's next to them must be valid. Fluxes through the sides themselves are given and stay.
/// @param u  [cell, 3] um/us, read on the sides, of fluxes alone
template <class Raw, class Sharp>
void sharpen_faces(const TransferBlock& block, Sharpen what, int d, double moment, const Components<double>& u, const Raw& raw,
                   const Sharp& sharp) {
  CellBox box = face_box(block.index(), d);
#if !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)
  CellBox inside = box;
  for (int e = 0; e < 3; ++e) {
    const int seen = e == d ? 2 : 1;  // rows beside a side that depend on it
    if (block.lattice.boundary_below[e]) inside.lower[e] += seen;
    if (block.lattice.boundary_above[e]) inside.upper[e] -= seen;
  }
  if (inside.size() > 0) {
    sharpen_inside(block.index(), d, moment, raw, sharp, inside);
    for (int e = 2; e >= 0; --e) {  // what is left: slabs, from box down to inside
      CellBox low = box, high = box;
      low.upper[e] = inside.lower[e], high.lower[e] = inside.upper[e];
      sharpen_box(block, what, d, moment, u, raw, sharp, low);
      sharpen_box(block, what, d, moment, u, raw, sharp, high);
      box.lower[e] = inside.lower[e], box.upper[e] = inside.upper[e];
    }
    return;
  }
#endif
  sharpen_box(block, what, d, moment, u, raw, sharp, box);
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
