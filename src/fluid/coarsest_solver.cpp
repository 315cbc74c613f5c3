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
  const IndexSpace& index = hierarchy.levels().back().views.index;
  const auto order = order_of(index);
  const int n0 = index.n[order[0]], n1 = index.n[order[1]];
  const auto row_of = [&](const std::array<int, 3>& at) {
    int place[3];
    for (int m = 0; m < 3; ++m) place[m] = folded(at[order[m]], index.n[order[m]], index.periodic[order[m]]);
    return place[0] + n0 * (place[1] + n1 * place[2]);
  };
  band_.rows = index.owned();
  band_.cell = Array<int>("corpuscle::multigrid::band_cell", band_.rows);
  band_.neighbour = Table<int>("corpuscle::multigrid::band_neighbour", band_.rows, 6);
  const auto cell = Kokkos::create_mirror_view(band_.cell);
  const auto neighbour = Kokkos::create_mirror_view(band_.neighbour);
  for (int e = 0; e < band_.rows; ++e) {
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
      band_.width = std::max(band_.width, neighbour(row, side) - row);
    }
  }
  Kokkos::deep_copy(band_.cell, cell);
  Kokkos::deep_copy(band_.neighbour, neighbour);
  band_.lower = Table<double>("corpuscle::multigrid::band_lower", band_.rows + band_.width, band_.width + 1);
  band_.upper = Table<double>("corpuscle::multigrid::band_upper", band_.rows, band_.width + 1);
  band_.inverse = Array<double>("corpuscle::multigrid::band_inverse", band_.rows);
  band_.x = Array<double>("corpuscle::multigrid::band_x", band_.rows + 2 * band_.width);
}

void BandCoarsest::update(const MultigridLevel& level) {
  assemble_band(level, band_);
  factorise_band(band_);
}

void BandCoarsest::solve(const MultigridLevel&, const Array<CycleReal>& b, const Array<CycleReal>& x) {
  solve_band(band_, b, x);
}

InverseCoarsest::InverseCoarsest(MultigridHierarchy& hierarchy)
    : BandCoarsest(hierarchy), inverse_("corpuscle::multigrid::inverse", band_.rows, band_.rows + 2 * band_.width) {}

void InverseCoarsest::update(const MultigridLevel& level) {
  BandCoarsest::update(level);
  invert_band(band_, inverse_);
}

void InverseCoarsest::solve(const MultigridLevel&, const Array<CycleReal>& b, const Array<CycleReal>& x) {
  apply_inverse(band_, inverse_, b, x);
}

AmgCoarsest::AmgCoarsest(MultigridHierarchy& hierarchy)
    : system_(hierarchy.levels().back().comm, hierarchy.levels().back().views.index, hierarchy.levels().back().halo, false),
      amg_(system_) {
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
