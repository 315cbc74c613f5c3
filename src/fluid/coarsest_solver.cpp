#include "fluid/coarsest_solver.hpp"

#include <algorithm>

namespace corpuscle {

namespace {

/// Where position `at` of `n` comes along a direction: around a period both ways at once, so that its two ends meet.
int folded(int at, int n, bool periodic) {
  if (!periodic) return at;
  return 2 * at < n ? 2 * at : 2 * (n - 1 - at) + 1;
}

/// The order of the directions, fastest first, that keeps neighbours closest.
std::array<int, 3> order_of(const IndexSpace& index) {
  std::array<int, 3> order{0, 1, 2};
  const auto reach = [&](int d) { return static_cast<long>(index.owned()) / index.n[d] * (index.periodic[d] ? 2 : 1); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return reach(a) != reach(b) ? reach(a) > reach(b) : a < b; });
  return order;
}

}  // namespace

BandCoarsest::BandCoarsest(MultigridHierarchy& hierarchy) {
  BandSystem& band = direct_.band;
  const IndexSpace& index = hierarchy.levels().back().views.index;
  const auto order = order_of(index);
  const int n0 = index.n[order[0]], n1 = index.n[order[1]];
  const auto row_of = [&](const std::array<int, 3>& at) {
    int place[3];
    for (int m = 0; m < 3; ++m) place[m] = folded(at[order[m]], index.n[order[m]], index.periodic[order[m]]);
    return place[0] + n0 * (place[1] + n1 * place[2]);
  };
  band.rows = index.owned();
  band.cell = Array<int>("corpuscle::multigrid::band_cell", band.rows);
  band.neighbour = Table<int>("corpuscle::multigrid::band_neighbour", band.rows, 6);
  const auto cell = Kokkos::create_mirror_view(band.cell);
  const auto neighbour = Kokkos::create_mirror_view(band.neighbour);
  for (int e = 0; e < band.rows; ++e) {
    const std::array<int, 3> at{e % index.n[0], e / index.n[0] % index.n[1], e / (index.n[0] * index.n[1])};
    const int row = row_of(at);
    cell(row) = index.cell(at[0], at[1], at[2]);
    for (int side = 0; side < 6; ++side) {
      const int d = side / 2;
      auto there = at;
      there[d] += side % 2 == 0 ? -1 : 1;
      const bool outside = there[d] < 0 || there[d] >= index.n[d];
      if (outside && index.periodic[d]) there[d] = (there[d] + index.n[d]) % index.n[d];
      neighbour(row, side) = outside && !index.periodic[d] ? -1 : row_of(there);
      band.width = std::max(band.width, neighbour(row, side) - row);
    }
  }
  Kokkos::deep_copy(band.cell, cell);
  Kokkos::deep_copy(band.neighbour, neighbour);
  band.lower = Table<double>("corpuscle::multigrid::band_lower", band.rows + band.width, band.width + 1);
  band.upper = Table<double>("corpuscle::multigrid::band_upper", band.rows, band.width + 1);
  band.inverse = Array<double>("corpuscle::multigrid::band_inverse", band.rows);
  band.x = Array<double>("corpuscle::multigrid::band_x", band.rows + 2 * band.width);
}

void BandCoarsest::update(const MultigridLevel& level) {
  assemble_band(level, direct_.band);
  factorise_band(direct_.band);
}

InverseCoarsest::InverseCoarsest(MultigridHierarchy& hierarchy) : BandCoarsest(hierarchy) {
  const BandSystem& band = direct_.band;
  direct_.inverse = Table<double>("corpuscle::multigrid::inverse", band.rows, band.rows + 2 * band.width);
}

void InverseCoarsest::update(const MultigridLevel& level) {
  BandCoarsest::update(level);
  invert_band(direct_.band, direct_.inverse);
}

AmgCoarsest::AmgCoarsest(MultigridHierarchy& hierarchy)
    : system_(hierarchy.levels().back().comm, hierarchy.levels().back().views.index, hierarchy.levels().back().halo, false), amg_(system_) {
  const int rows = hierarchy.levels().back().views.index.owned();
  rhs_ = Array<double>("corpuscle::multigrid::coarse_rhs", rows);
  x_ = Array<double>("corpuscle::multigrid::coarse_x", rows);
}

void AmgCoarsest::update(const MultigridLevel& level) {
  level_rows(level, system_.values());
  system_.set_values();
  amg_.set_up();
}

void AmgCoarsest::solve(const MultigridLevel& level, const Array<CycleReal>& b, const Array<CycleReal>& x) {
  compact_scalar(level.index, b, rhs_);
  amg_.cycle(rhs_, x_);
  spread_scalar(level.index, 1, x_, x);
}

std::unique_ptr<CoarsestSolver> make_coarsest_solver(MultigridHierarchy& hierarchy) {
  const auto& last = hierarchy.levels().back();
  constexpr bool host_memory = Kokkos::SpaceAccessibility<Kokkos::HostSpace, Memory>::accessible;
  if (last.comm.size() == 1 && last.views.index.owned() <= MultigridHierarchy::most_direct) {
    if (host_memory) return std::make_unique<BandCoarsest>(hierarchy);
    return std::make_unique<InverseCoarsest>(hierarchy);
  }
  return std::make_unique<AmgCoarsest>(hierarchy);
}

}  // namespace corpuscle
