#include "grid/grid.hpp"

#include "core/error.hpp"
#include "grid/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace corpuscle {

namespace {

/// Sum over owned cells of volume times the larger (g_e / g_d)^2 at the lower face of direction d.
double sum_cross_coefficients(const GridViews& grid, int d) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  const auto area = grid.face_area[d];
  const auto volume = grid.volume;
  double total = 0;
  Kokkos::parallel_reduce(
      "corpuscle::grid::skewness", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& sum) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        const int c = index.cell(i, j, k);
        const Vec3 g = face_coefficients(x, load(area, c), index, d, c);
        double most = 0;
        for (int m = 0; m < 3; ++m) {
          const double ratio = m != d ? g[m] / g[d] : 0;
          if (ratio * ratio > most) most = ratio * ratio;
        }
        sum += volume(c) * most;
      },
      total);
  return total;
}

/// Smallest distance between neighbouring centres of owned cells along d.
double smallest_offset(const GridViews& grid, int d) {
  const IndexSpace index = grid.index;
  const auto x = grid.x;
  double smallest = std::numeric_limits<double>::max();
  Kokkos::parallel_reduce(
      "corpuscle::grid::spacing", Policy(0, index.owned()),
      KOKKOS_LAMBDA(int e, double& least) {
        const int i = e % index.n[0], j = (e / index.n[0]) % index.n[1], k = e / (index.n[0] * index.n[1]);
        const double distance = 2 * norm(central_offset(x, index.cell(i, j, k), index.stride(d)));
        if (distance < least) least = distance;
      },
      Kokkos::Min<double>(smallest));
  return smallest / 2;
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

}  // namespace

Grid::Grid(const Comm& comm, const NodeSource& source, const std::array<bool, 3>& periodic)
    : comm_(comm), views_{decompose(comm, source.cells, periodic, &ranks_), {}, {}, {}, {}},
      halo_(comm, views_.index, ranks_) {
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
  for (int d = 0; d < 3; ++d) {
    if (!index.periodic[d]) continue;
    std::array<int, 3> low{}, high{};
    high[d] = source.cells[d];
    const Triple a = source.node(low[0], low[1], low[2]), b = source.node(high[0], high[1], high[2]);
    for (int m = 0; m < 3; ++m) period_[d][m] = b[m] - a[m];
    std::array<int, 3> far = source.cells;
    far[d] = 0;
    const Triple c = source.node(far[0], far[1], far[2]);
    const Triple e = source.node(source.cells[0], source.cells[1], source.cells[2]);
    for (int m = 0; m < 3; ++m)
      if (std::abs(e[m] - c[m] - period_[d][m]) > 1e-9 * (1 + std::abs(period_[d][m])))
        throw InputError(fmt::format(
            "boundary: the {} sides cannot be periodic: they are not the same shape moved along one vector",
            std::array<const char*, 3>{"i", "j", "k"}[d]));
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
  if (comm_.min(smallest.val) > 0) return;
  std::string message;
  if (!(smallest.val > 0)) {
    const IndexSpace& index = views_.index;
    const int i = smallest.loc % index.n[0], j = (smallest.loc / index.n[0]) % index.n[1],
              k = smallest.loc / (index.n[0] * index.n[1]);
    auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.x);
    const int c = index.cell(i, j, k);
    message = fmt::format(
        "grid: cell ({}, {}, {}) at ({:.4g}, {:.4g}, {:.4g}) um has the volume {:.3g} um3; every cell needs a positive "
        "one. The grid is folded or left-handed there: check the node coordinates and their order (i, j, k must form a "
        "right-handed system)",
        i + index.first[0], j + index.first[1], k + index.first[2], x(c, 0), x(c, 1), x(c, 2), smallest.val);
  } else {
    message = "grid: a cell of another rank has a non-positive volume";
  }
  throw InputError(message);
}

void Grid::measure() {
  total_volume_ = comm_.sum(sum_volume(views_));
  const IndexSpace& index = views_.index;
  mean_spacing_ = std::cbrt(total_volume_ / (static_cast<double>(index.global[0]) * index.global[1] * index.global[2]));
  smallest_spacing_ = std::numeric_limits<double>::max();
  for (int d = 0; d < 3; ++d) {
    skewness_ = std::max(skewness_, std::sqrt(comm_.sum(sum_cross_coefficients(views_, d)) / total_volume_));
    smallest_spacing_ = std::min(smallest_spacing_, comm_.min(smallest_offset(views_, d)));
  }
}

}  // namespace corpuscle
