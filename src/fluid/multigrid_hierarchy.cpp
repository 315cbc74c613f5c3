#include "fluid/multigrid_hierarchy.hpp"

#include <algorithm>

namespace corpuscle {

namespace {

// A direction is coarsened where it couples at least this much of the strongest one.
constexpr double strong = 0.4;
constexpr int smallest_block = 2 * IndexSpace::halo;  // along a direction that is cut over ranks or periodic
constexpr double coarsest_cells = 300;
constexpr int gathered_cells = 4096;  // a message takes as long as smoothing about as many once

}  // namespace

MultigridHierarchy::MultigridHierarchy(Grid& grid, const Array<double> (&coefficient)[3]) : grid_(&grid) {
  for (int d = 0; d < 3; ++d) coefficient_[d] = coefficient[d];
  build(coefficient, gathered_cells);
  // A level that hypre solves is one for all ranks together, which end alike when that fails.
  const bool alone = levels_.back().views.index.owned() > most_direct && levels_.back().comm.size() < grid.comm().size();
  if (grid.comm().max(alone) > 0) build(coefficient, 0);
}

void MultigridHierarchy::build(const Array<double> (&coefficient)[3], int most_gathered) {
  levels_.clear();
  add_level(grid_->index(), grid_->comm(), grid_->ranks_per_direction());
  const PressureMask everywhere("corpuscle::multigrid::mask", grid_->index().size());
  Kokkos::deep_copy(everywhere, 1);
  mask_conductances(coefficient, everywhere, levels_[0].views);
  while (add_coarser(most_gathered)) coarsen(levels_.size() - 1);
}

void MultigridHierarchy::add_level(const IndexSpace& index, const Comm& comm, const std::array<int, 3>& ranks) {
  Level level{{}, Components<CycleReal>("corpuscle::multigrid::conductance", index.size(), 3), comm, Halo(comm, index, ranks)};
  level.views.index = index;
  for (int d = 0; d < 3; ++d) level.views.conductance[d] = Kokkos::subview(level.conductances, Kokkos::ALL, d);
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) level.views.shared[d][side] = level.halo.neighbour(d, side) >= 0;
  levels_.push_back(std::move(level));
}

/// Append the next level, unless the last one is small enough or cannot be coarsened where it should be.
bool MultigridHierarchy::add_coarser(int most_gathered) {
  Level& fine = levels_.back();
  const Comm comm = fine.comm;
  const auto& ranks = grid_->ranks_per_direction();
  IndexSpace index = fine.views.index;
  double strength[3], most = 0;
  for (int d = 0; d < 3; ++d) strength[d] = sum_conductances(fine.views, d);
  comm.sum(strength, 3);
  fine.strength = strength[0] + strength[1] + strength[2];
  if (static_cast<double>(index.global[0]) * index.global[1] * index.global[2] <= coarsest_cells) return false;
  for (double s : strength) most = std::max(most, s);
  int factor[3] = {1, 1, 1};
  double coarse_cells = 1;
  for (int d = 0; d < 3; ++d) {
    if (strength[d] >= strong * most) factor[d] = 2;
    const int cells = (index.global[d] + factor[d] - 1) / factor[d];
    coarse_cells *= cells;
  }
  const bool gathered = comm.size() > 1 && coarse_cells <= most_gathered;
  for (int d = 0; d < 3; ++d) {
    const bool cut = (comm.size() > 1 && ranks[d] > 1 && !gathered) || index.periodic[d];
    const int least = gathered ? index.global[d] : static_cast<int>(comm.min(index.n[d]));
    if (factor[d] == 2 && least < (cut ? smallest_block : 2)) return false;
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
  fine.views.part = index;
  if (!gathered) {
    add_level(index, comm, comm.size() > 1 ? ranks : std::array<int, 3>{1, 1, 1});
    return true;
  }
  IndexSpace whole = index;
  for (int d = 0; d < 3; ++d) {
    fine.views.begin[d] = index.first[d];
    whole.first[d] = 0, whole.n[d] = index.global[d];
  }
  add_level(whole, Comm::alone(), {1, 1, 1});
  Level& coarse = levels_.back();
  coarse.cells = std::make_unique<Gathering>(comm, index, whole, Gathering::of_cells);
  for (int d = 0; d < 3; ++d) coarse.faces[d] = std::make_unique<Gathering>(comm, index, whole, d);
  return true;
}

void MultigridHierarchy::coarsen(std::size_t number) {
  Level& level = levels_[number];
  coarsen_conductances(levels_[number - 1].views, level.views);
  for (int d = 0; d < 3; ++d)
    if (level.faces[d]) level.faces[d]->run(level.views.conductance[d]);
  level.halo.exchange(level.conductances);
}

/// All coarser levels from the finest, of which one layer of the halo is known.
void MultigridHierarchy::coarsen_all() {
  if (levels_[0].halo.cut()) levels_[0].halo.exchange(levels_[0].conductances);
  for (std::size_t l = 1; l < levels_.size(); ++l) coarsen(l);
}

void MultigridHierarchy::update(const PressureMask& mask) {
  mask_conductances(coefficient_, mask, levels_[0].views);
  coarsen_all();
}

void MultigridHierarchy::update(const PressureMask& mask, const VaryingViscosity& viscosity) {
  mask_conductances(coefficient_, mask, levels_[0].views, viscosity);
  coarsen_all();
}

}  // namespace corpuscle
