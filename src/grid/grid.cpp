#include "grid/grid.hpp"

#include "common/extremes.hpp"
#include "core/error.hpp"
#include "grid/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace corpuscle {

namespace {

/// Sums over owned cells, with r the larger |g_e / g_d| at the lower face of direction d: of V r^2, and of V where
/// r is above `limit`.
struct CrossCoefficients {
  double square = 0, above = 0;
};
CrossCoefficients sum_cross_coefficients(const GridViews& grid, int d, double limit) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const auto area = grid.face_area[d];
  const auto volume = grid.volume;
  CrossCoefficients total;
  Kokkos::parallel_reduce(
      "corpuscle::grid::skewness", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& square, double& above) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        const int c = index.cell(i, j, k);
        const Vec3 g = face_coefficients(x, load(area, c), index, d, c);
        double most = 0;
        for (int m = 0; m < 3; ++m) {
          const double ratio = m != d ? g[m] / g[d] : 0;
          if (ratio * ratio > most) most = ratio * ratio;
        }
        square += volume(c) * most;
        if (most > limit * limit) above += volume(c);
      },
      total.square, total.above);
  return total;
}

/// Smallest, or largest, distance between neighbouring centres of owned cells along d.
template <bool largest>
double extreme_offset(const GridViews& grid, int d) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  double extreme = largest ? 0 : std::numeric_limits<double>::max();
  Kokkos::parallel_reduce(
      "corpuscle::grid::spacing", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& most) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        const double distance = 2 * norm(central_offset(x, index.cell(i, j, k), index.stride(d)));
        most = largest ? larger(most, distance) : smaller(most, distance);
      },
      Extreme<largest>(extreme));
  return extreme / 2;
}

double sum_volume(const GridViews& grid) {
  const IndexSpace index = grid.index;
  const auto volume = grid.volume;
  double total = 0;
  Kokkos::parallel_reduce(
      "corpuscle::grid::total_volume", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& sum) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        sum += volume(index.cell(i, j, k));
      },
      total);
  return total;
}

/// @throws InputError  unless every node of the far side of direction d is its partner on the near side moved by `period`
void check_translates(const NodeSource& source, int d, const Triple& period) {
  const int e = (d + 1) % 3, f = (d + 2) % 3;
  const double tolerance = 1e-9 * (1 + std::abs(period[0]) + std::abs(period[1]) + std::abs(period[2]));
  std::array<int, 3> near{}, far{};
  far[d] = source.cells[d];
  for (near[f] = 0; near[f] <= source.cells[f]; ++near[f])
    for (near[e] = 0; near[e] <= source.cells[e]; ++near[e]) {
      far[e] = near[e], far[f] = near[f];
      const Triple a = source.node(near[0], near[1], near[2]), b = source.node(far[0], far[1], far[2]);
      for (int m = 0; m < 3; ++m)
        if (!(std::abs(b[m] - a[m] - period[m]) <= tolerance))
          throw InputError(
              fmt::format("boundary: the {} sides cannot be periodic: they are not the same shape moved along one vector (node "
                          "({}, {}, {}) is out of place by {:.3g} um)",
                          std::array<const char*, 3>{"i", "j", "k"}[d], far[0], far[1], far[2], b[m] - a[m] - period[m]));
    }
}

}  // namespace

Grid::Grid(const Comm& comm, const NodeSource& source, const std::array<bool, 3>& periodic)
    : comm_(comm), views_{decompose(comm, source.cells, periodic, &ranks_), {}, {}, {}, {}}, halo_(comm, views_.index, ranks_) {
  const int size = views_.index.size();
  views_.x = Components<double>("corpuscle::grid::x", size, 3);
  for (int d = 0; d < 3; ++d) views_.face_area[d] = Components<double>("corpuscle::grid::face_area", size, 3);
  views_.volume = Array<double>("corpuscle::grid::volume", size);
  views_.base_kind = Array<NodeKind>("corpuscle::grid::base_kind", size);
  fill_nodes(source);
  mark_base_kinds(views_);
  check_volumes();
  measure();
}

void Grid::fill_nodes(const NodeSource& source) {
  const IndexSpace& index = views_.index;
  corner_ = source.node(0, 0, 0);
  for (int d = 0; d < 3; ++d) {
    if (!index.periodic[d]) continue;
    std::array<int, 3> low{}, high{};
    high[d] = source.cells[d];
    const Triple a = source.node(low[0], low[1], low[2]), b = source.node(high[0], high[1], high[2]);
    for (int m = 0; m < 3; ++m) period_[d][m] = b[m] - a[m];
    check_translates(source, d, period_[d]);
  }
  const NodeIndex at{index};
  Components<double> node(uninitialised("corpuscle::grid::node"), at.size(), 3);
  auto host = Kokkos::create_mirror_view(node);
  for (int k = -IndexSpace::halo; k < at.extent(2) - IndexSpace::halo; ++k)
    for (int j = -IndexSpace::halo; j < at.extent(1) - IndexSpace::halo; ++j)
      for (int i = -IndexSpace::halo; i < at.extent(0) - IndexSpace::halo; ++i) {
        std::array<int, 3> g{i + index.first[0], j + index.first[1], k + index.first[2]};
        Triple shift{};
        for (int d = 0; d < 3; ++d) {
          const int n = source.cells[d];
          if (!index.periodic[d]) {
            g[d] = std::clamp(g[d], 0, n);
          } else if (g[d] < 0 || g[d] > n) {
            const int turns = g[d] < 0 ? -1 : 1;
            g[d] -= turns * n;
            for (int m = 0; m < 3; ++m) shift[m] += turns * period_[d][m];
          }
        }
        const Triple x = source.node(g[0], g[1], g[2]);
        for (int m = 0; m < 3; ++m) host(at(i, j, k), m) = x[m] + shift[m];
      }
  for (int k = 0; k <= index.n[2]; ++k)
    for (int j = 0; j <= index.n[1]; ++j)
      for (int i = 0; i <= index.n[0]; ++i)
        for (int m = 0; m < 3; ++m) owned_nodes_.push_back(host(at(i, j, k), m));
  Kokkos::deep_copy(node, host);
  compute_geometry(node, views_);
}

void Grid::check_volumes() {
  const auto smallest = smallest_volume(views_);
  const bool bad = !(smallest.val > 0);
  const double first = comm_.min(static_cast<double>(bad ? comm_.rank() : comm_.size()));
  if (first == comm_.size()) return;
  double found[7] = {0, 0, 0, 0, 0, 0, 0};  // cell, centre and volume, from the first rank that has one
  if (first == comm_.rank()) {
    const IndexSpace& index = views_.index;
    const int at[3] = {smallest.loc % index.n[0], (smallest.loc / index.n[0]) % index.n[1], smallest.loc / (index.n[0] * index.n[1])};
    const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.x);
    const auto volume = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.volume);
    const int c = index.cell(at[0], at[1], at[2]);
    for (int d = 0; d < 3; ++d) found[d] = at[d] + index.first[d], found[3 + d] = x(c, d);
    found[6] = volume(c);
  }
  comm_.sum(found, 7);
  throw InputError(
      fmt::format("grid: cell ({}, {}, {}) at ({:.4g}, {:.4g}, {:.4g}) um has the volume {:.3g} um3; every cell needs a positive "
                  "one. The grid is folded or left-handed there: check the node coordinates and their order (i, j, k must form a "
                  "right-handed system)",
                  found[0], found[1], found[2], found[3], found[4], found[5], found[6]));
}

void Grid::measure() {
  total_volume_ = comm_.sum(sum_volume(views_));
  const IndexSpace& index = views_.index;
  mean_spacing_ = std::cbrt(total_volume_ / (static_cast<double>(index.global[0]) * index.global[1] * index.global[2]));
  smallest_spacing_ = std::numeric_limits<double>::max();
  for (int d = 0; d < 3; ++d) {
    const auto mine = sum_cross_coefficients(views_, d, negligible_typical_skewness);
    double sums[2] = {mine.square, mine.above};
    comm_.sum(sums, 2);
    skewness_ = larger(skewness_, std::sqrt(sums[0] / total_volume_));
    skewed_share_ = larger(skewed_share_, sums[1] / total_volume_);
    smallest_spacing_ = smaller(smallest_spacing_, comm_.min(extreme_offset<false>(views_, d)));
    largest_spacing_ = larger(largest_spacing_, comm_.max(extreme_offset<true>(views_, d)));
  }
}

}  // namespace corpuscle
