#include "fluid/multigrid_hierarchy.hpp"

#include <algorithm>

namespace corpuscle {

namespace {

// A direction is coarsened where it couples at least this much of the strongest one.
constexpr double strong = 0.4;
constexpr int smallest_block = 2 * IndexSpace::halo;  // along a direction that is cut over ranks or periodic
constexpr double coarsest_cells = 300;

MultigridLevel make_level(const IndexSpace& index) {
  MultigridLevel level;
  level.index = index;
  for (auto& g : level.conductance) g = Array<CycleReal>("corpuscle::multigrid::conductance", index.size());
  return level;
}

}  // namespace

MultigridHierarchy::MultigridHierarchy(Grid& grid, const Array<double> (&coefficient)[3]) : grid_(&grid) {
  const IndexSpace& index = grid.index();
  for (int d = 0; d < 3; ++d) coefficient_[d] = coefficient[d];
  levels_.push_back({make_level(index), Halo(grid.comm(), index, grid.ranks_per_direction()), 0});
  const PressureMask everywhere("corpuscle::multigrid::mask", index.size());
  Kokkos::deep_copy(everywhere, 1);
  mask_conductances(coefficient_, everywhere, levels_[0].views);
  while (add_coarser()) coarsen(levels_.size() - 1);
}

/// Append the next level, unless the last one is small enough or cannot be coarsened where it should be.
bool MultigridHierarchy::add_coarser() {
  const Comm& comm = grid_->comm();
  Level& fine = levels_.back();
  IndexSpace index = fine.views.index;
  double strength[3], most = 0;
  for (int d = 0; d < 3; ++d) strength[d] = sum_conductances(fine.views, d);
  comm.sum(strength, 3);
  fine.strength = strength[0] + strength[1] + strength[2];
  if (static_cast<double>(index.global[0]) * index.global[1] * index.global[2] <= coarsest_cells) return false;
  for (double s : strength) most = std::max(most, s);
  int factor[3] = {1, 1, 1};
  for (int d = 0; d < 3; ++d) {
    if (strength[d] < strong * most) continue;
    const bool cut = grid_->ranks_per_direction()[d] > 1 || index.periodic[d];
    if (static_cast<int>(comm.min(index.n[d])) < (cut ? smallest_block : 2)) return false;
    factor[d] = 2;
  }
  double split = 0;
  for (int d = 0; d < 3; ++d) {
    const int first = index.first[d], end = first + index.n[d], f = factor[d];
    index.global[d] = (index.global[d] + f - 1) / f;
    index.first[d] = (first + f - 1) / f;
    index.n[d] = (end + f - 1) / f - index.first[d];
    fine.views.factor[d] = f;
    fine.views.shift[d] = f * index.first[d] - first;
    if (fine.views.shift[d] != 0) split = 1;
  }
  fine.views.split = comm.max(split) > 0;
  levels_.push_back({make_level(index), Halo(comm, index, grid_->ranks_per_direction()), 0});
  return true;
}

void MultigridHierarchy::coarsen(std::size_t number) {
  Level& level = levels_[number];
  coarsen_conductances(levels_[number - 1].views, level.views);
  for (auto& g : level.views.conductance) level.halo.exchange(g);
}

void MultigridHierarchy::update(const PressureMask& mask) {
  mask_conductances(coefficient_, mask, levels_[0].views);
  for (std::size_t l = 1; l < levels_.size(); ++l) coarsen(l);
}

}  // namespace corpuscle
