#include "fluid/multigrid_cycle.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

namespace corpuscle {

namespace {

template <class Field>
Field cycle_vector(const IndexSpace& index) {
  const std::string label = "corpuscle::multigrid::cycle_vector";
  if constexpr (Field::rank == 1)
    return Field(label, index.size());
  else
    return Field(label, index.size(), 3);
}

}  // namespace

template <class Field>
MultigridCycle<Field>::MultigridCycle(MultigridHierarchy& hierarchy, const Smoothing& smoothing)
    : hierarchy_(&hierarchy), smoothing_(smoothing) {
  for (const auto& shared : hierarchy.levels()) {
    const IndexSpace& index = shared.views.index;
    Level level{shared.views, Array<CycleReal>("corpuscle::multigrid::own", index.size()), cycle_vector<Field>(index),
                cycle_vector<Field>(index), cycle_vector<Field>(index)};
    level.views.diagonal = Array<CycleReal>("corpuscle::multigrid::diagonal", index.size());
    level.views.inverse = Array<CycleReal>("corpuscle::multigrid::inverse", index.size());
    levels_.push_back(std::move(level));
  }
}

template <class Field>
void MultigridCycle<Field>::update() {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    Halo& halo = hierarchy_->levels()[l].halo;
    level_diagonals(level.views, level.views.closed, level.own);
    halo.exchange(level.views.inverse);
    halo.exchange(level.views.diagonal);
    if (l + 1 == levels_.size()) break;
    if (level.views.split) halo.exchange(level.own);
    restrict_sums(level.views, levels_[l + 1].views.index, level.own, levels_[l + 1].own);
    if (hierarchy_->levels()[l + 1].cells) hierarchy_->levels()[l + 1].cells->run(levels_[l + 1].own);
  }
}

/// x from zero, valid in `layers` of the halo at least, with one exchange; fewer where the steps leave fewer.
/// @returns how many
template <class Field>
int MultigridCycle<Field>::smooth_down(std::size_t number, int layers) {
  Level& level = levels_[number];
  const int others = smoothing_.steps - 2;
  layers = std::max(0, std::min(layers, IndexSpace::halo - 1 - others));
  hierarchy_->levels()[number].halo.exchange(level.b, std::max(layers + others + 1, smoothing_.steps - 1));
  ChebyshevSteps steps(smoothing_.from, smoothing_.to);
  const auto first = steps.next(), second = steps.next();
  smooth_from_zero(level.views, first, second, layers + others, level.b, level.y, level.x);
  for (int n = others - 1; n >= 0; --n) {
    smooth(level.views, steps.next(), layers + n, level.b, level.x, level.y);
    std::swap(level.x, level.y);
  }
  return layers;
}

/// @param layers  of x that are valid in the halo
template <class Field>
void MultigridCycle<Field>::smooth_up(std::size_t number, int layers) {
  Level& level = levels_[number];
  if (layers < smoothing_.steps) hierarchy_->levels()[number].halo.exchange(level.x, smoothing_.steps);
  ChebyshevSteps steps(smoothing_.from, smoothing_.to);
  for (int n = smoothing_.steps - 1; n >= 0; --n) {
    smooth(level.views, steps.next(), n, level.b, level.x, level.y);
    std::swap(level.x, level.y);
  }
}

template <class Field>
void MultigridCycle<Field>::descend(std::size_t number, int depth) {
  Level& level = levels_[number];
  const bool coarsest = number + 1 == levels_.size();
  if (coarsest && solve_coarsest) return solve_coarsest(level);
  if (coarsest || depth == 0) return smooth_up(number, smooth_down(number, smoothing_.steps));
  const bool split = level.views.split;
  const int layers = smooth_down(number, split ? 2 : 1);
  if (layers == 0) hierarchy_->levels()[number].halo.exchange(level.x, 1);
  level_residual(level.views, layers > 1 ? 1 : 0, level.b, level.x, level.y);
  if (split && layers < 2) hierarchy_->levels()[number].halo.exchange(level.y, 1);
  Level& coarse = levels_[number + 1];
  auto& shared = hierarchy_->levels()[number + 1];
  restrict_sums(level.views, coarse.views.index, level.y, coarse.b);
  if (shared.cells) shared.cells->run(coarse.b);
  descend(number + 1, depth - 1);
  if (split) shared.halo.exchange(coarse.x, 1);
  add_correction(level.views, coarse.views.index, coarse.x, level.x);
  smooth_up(number, 0);
}

template class MultigridCycle<Array<CycleReal>>;
template class MultigridCycle<Components<CycleReal>>;

}  // namespace corpuscle
