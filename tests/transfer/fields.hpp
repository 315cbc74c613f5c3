// Points, fluxes and sums over faces that tests of the transfer share.
#pragma once

#include <functional>
#include <memory>
#include <random>

#include "../fluid/fluid_fixture.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle::transfer_test {

using namespace corpuscle::fluid_test;

using Kernel = CouplingSettings::Kernel;
inline const std::array<Type, 6> walls{Type::moving_wall, Type::moving_wall, Type::moving_wall,
                                       Type::moving_wall, Type::moving_wall, Type::moving_wall};

class Noise {
 public:
  /// Uniform in [lower, upper], the same on every platform.
  double operator()(double lower, double upper) { return lower + (upper - lower) * (double(engine_()) / 4294967295.0); }

 private:
  std::mt19937 engine_{20260101};
};

inline Components<double> points(int count, const std::function<Triple(int)>& at) {
  Components<double> x("corpuscle::test::x", count, 3);
  const auto host = Kokkos::create_mirror_view(x);
  for (int i = 0; i < count; ++i) {
    const Triple value = at(i);
    for (int m = 0; m < 3; ++m) host(i, m) = value[m];
  }
  Kokkos::deep_copy(x, host);
  return x;
}

/// A sheared box, periodic or not: every cell the same parallelepiped.
inline NodeSource sheared_box(const std::array<int, 3>& cells) {
  return {cells, [cells](int i, int j, int k) {
            const double u = 2.0 * i / cells[0], v = 2.0 * j / cells[1], w = 2.0 * k / cells[2];
            return Triple{u + 0.3 * v, v + 0.2 * w, w + 0.15 * u};
          }};
}

/// Points from `edge` to 1 - `edge` of the way along each direction of sheared_box() or warped_box().
inline Components<double> inside(int count, double edge, bool warped) {
  auto noise = std::make_shared<Noise>();
  const NodeSource map = warped ? warped_box({1000, 1000, 1000}) : sheared_box({1000, 1000, 1000});
  return points(count, [=](int) {
    int at[3];
    for (auto& value : at) value = static_cast<int>(1000 * (*noise)(edge, 1 - edge));
    return map.node(at[0], at[1], at[2]);
  });
}

/// What all ranks have found of the points together.
inline auto sum_of_ranks(const Components<double>& part) {
  const auto sum = Kokkos::create_mirror(part);
  Kokkos::deep_copy(sum, part);
  Comm().sum(sum.data(), static_cast<int>(sum.size()));
  return sum;
}

/// No two are alike, nor near each other; of a face the same on every rank that has it.
inline Triple rough(const Triple& p) {
  return {std::sin(31 * p[0] - 17 * p[1] + 23 * p[2]), std::cos(29 * p[0] + 37 * p[1] - 13 * p[2]),
          std::sin(19 * p[0] + 11 * p[1] + 41 * p[2] + 1)};
}

/// Fluxes of a velocity given at face centres, and the velocity on the sides.
struct Field {
  Array<double> flux[3];
  Components<double> u;
};
inline Field make_field(const Grid& grid, const std::function<Triple(const Triple&)>& velocity) {
  const IndexSpace& index = grid.index();
  Field field;
  const Lattice lattice = make_lattice(grid.views());
  field.u = Components<double>("corpuscle::test::u", index.size(), 3);
  const auto x = on_host(grid.views().x);
  const auto u = Kokkos::create_mirror_view(field.u);
  for (int c = 0; c < index.size(); ++c) {
    const Triple value = velocity({x(c, 0), x(c, 1), x(c, 2)});
    for (int m = 0; m < 3; ++m) u(c, m) = value[m];
  }
  Kokkos::deep_copy(field.u, u);
  for (int d = 0; d < 3; ++d) {
    field.flux[d] = Array<double>("corpuscle::test::flux", index.size());
    const auto flux = Kokkos::create_mirror_view(field.flux[d]);
    const auto area = on_host(grid.views().face_area[d]);
    const CellBox box = face_box(index, d);
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
      for (int j = box.lower[1]; j < box.upper[1]; ++j)
        for (int i = box.lower[0]; i < box.upper[0]; ++i) {
          const int c = index.cell(i, j, k), low = c - index.stride(d);
          const int at[3] = {i, j, k};
          Triple centre;
          for (int m = 0; m < 3; ++m)  // beyond a side lies the side itself
            centre[m] = at[d] == 0 && lattice.boundary_below[d]            ? x(low, m)
                        : at[d] == index.n[d] && lattice.boundary_above[d] ? x(c, m)
                                                                           : 0.5 * (x(c, m) + x(low, m));
          const Triple value = velocity(centre);
          flux(c) = 0;
          for (int m = 0; m < 3; ++m) flux(c) += area(c, m) * value[m];
        }
    Kokkos::deep_copy(field.flux[d], flux);
  }
  return field;
}

/// Sum of (pressure across a face) times `value(face)` over the faces of the grid, on all ranks.
inline double face_sum(const Transfer& transfer, const std::function<double(int, int)>& value) {
  const IndexSpace& index = transfer.block().index();
  double sum = 0;
  for (int d = 0; d < 3; ++d) {
    const auto across = on_host(transfer.faces().across[d]);
    CellBox box = face_box(index, d);
    if (!transfer.block().lattice.boundary_above[d]) --box.upper[d];  // the next block's, or the first one's
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
      for (int j = box.lower[1]; j < box.upper[1]; ++j)
        for (int i = box.lower[0]; i < box.upper[0]; ++i) sum += across(index.cell(i, j, k)) * value(d, index.cell(i, j, k));
  }
  return Comm().sum(sum);
}

/// Of the force across the faces of this rank, from that on a grid which is not cut, over the largest of it.
inline double largest_difference(const Transfer& of_ranks, const Transfer& of_one) {
  const IndexSpace &index = of_ranks.block().index(), &whole = of_one.block().index();
  double largest = 0, off = 0;
  for (int d = 0; d < 3; ++d) {
    const auto mine = on_host(of_ranks.faces().across[d]), all = on_host(of_one.faces().across[d]);
    const CellBox box = face_box(index, d);
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
      for (int j = box.lower[1]; j < box.upper[1]; ++j)
        for (int i = box.lower[0]; i < box.upper[0]; ++i) {
          const double exact = all(whole.cell(index.first[0] + i, index.first[1] + j, index.first[2] + k));
          largest = std::max(largest, std::abs(exact));
          off = std::max(off, std::abs(mine(index.cell(i, j, k)) - exact));
        }
  }
  return off / largest;
}

inline double largest_error(const Components<double>& v, const Components<double>& x,
                            const std::function<Triple(const Triple&)>& velocity) {
  const auto at = on_host(x);
  const auto found = sum_of_ranks(v);
  double worst = 0;
  for (std::size_t i = 0; i < at.extent(0); ++i) {
    const Triple exact = velocity({at(i, 0), at(i, 1), at(i, 2)});
    for (int m = 0; m < 3; ++m) worst = std::max(worst, std::abs(found(i, m) - exact[m]));
  }
  return worst;
}

}  // namespace corpuscle::transfer_test
