#include "fluid/multigrid_cycle.hpp"

#include <algorithm>
#include <stdexcept>
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
  find_small_levels();
}

template <class Field>
void MultigridCycle<Field>::find_small_levels() {
  using Small = SmallLevels<Field>;
  static_assert(sizeof(Small) < 4000);  // it goes along with the launch
  if (smoothing_.steps > Small::most_steps) throw std::logic_error("multigrid: more smoothing steps than small levels have room for");
  const auto& shared = hierarchy_->levels();
  const auto is_small = [&](std::size_t l) {
    return shared[l].comm.size() == 1 && levels_[l].views.index.owned() <= Small::most_cells && levels_.size() - l <= Small::most;
  };
  for (first_small_ = levels_.size(); first_small_ > 0 && is_small(first_small_ - 1);) --first_small_;
  small_.steps = smoothing_.steps;
  ChebyshevSteps steps(smoothing_.from, smoothing_.to);
  for (int n = 0; n < small_.steps; ++n) small_.step[n] = steps.next();
  for (std::size_t l = first_small_; l < levels_.size(); ++l) {
    const Level& level = levels_[l];
    small_.level[l - first_small_] = {level.views, level.b, level.x, level.y};
  }
}

template <class Field>
void MultigridCycle<Field>::solve_directly(const DirectLevel& coarsest) {
  if (first_small_ == levels_.size())
    throw std::logic_error("multigrid: a level that is solved directly must be small and one rank's alone");
  small_.coarsest = coarsest, direct_ = true;
}

template <class Field>
void MultigridCycle<Field>::run_small(int depth) {
  small_.count = std::min(depth + 1, static_cast<int>(levels_.size() - first_small_));
  small_.direct = direct_ && first_small_ + small_.count == levels_.size();
  const Level& first = levels_[first_small_];  // of the whole grid's own the owner may have put another b
  small_.level[0].b = first.b, small_.level[0].x = first.x, small_.level[0].y = first.y;
  run_small_levels(small_);
}

template <class Field>
void MultigridCycle<Field>::update() {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    Halo& halo = hierarchy_->levels()[l].halo;
    level_diagonals(level.views, level.views.closed, level.own);
    if (halo.cut()) {
      halo.exchange(level.views.diagonal);
      invert_diagonal(level.views);
    } else {
      halo.exchange(level.views.inverse);
    }
    if (l + 1 == levels_.size()) break;
    if (level.views.split) halo.exchange(level.own);
    restrict_sums(level.views, levels_[l + 1].views.index, level.own, levels_[l + 1].own);
    if (hierarchy_->levels()[l + 1].cells) hierarchy_->levels()[l + 1].cells->run(levels_[l + 1].own);
  }
}

/// @param layers  of other ranks' cells around this one's block in which `body` does what those do
template <class Field>
template <class Body>
void MultigridCycle<Field>::pass(const char* step, std::size_t number, const Body& body, const Field& result, int layers) {
  const IndexSpace& index = levels_[number].views.index;
  Halo& halo = hierarchy_->levels()[number].halo;
  const CellBox box = halo.with_others(layers);
  const WithImages<Body, Field> whole{body, index, {halo.wraps(0), halo.wraps(1), halo.wraps(2)}, box.lower[0], box.upper[0], result};
  if (whole.wraps[0] || whole.wraps[1] || whole.wraps[2])
    for_box_rounded(cycle_label<Field>(step), index, box, whole);
  else
    for_box_rounded(cycle_label<Field>(step), index, box, body);
}

/// Where the grid is cut, as many layers go over at once as there are steps of smoothing: each step's layers are one less, and what other
/// ranks do in them is done here too, which takes less time than a message for each step.
template <class Field>
int MultigridCycle<Field>::layers_exchanged(std::size_t number) const {
  return hierarchy_->levels()[number].halo.cut() ? std::min(smoothing_.steps, IndexSpace::halo) : 1;
}

/// @returns the layers of other ranks' cells in which x is known
template <class Field>
int MultigridCycle<Field>::smooth_down(std::size_t number) {
  Level& level = levels_[number];
  Halo& halo = hierarchy_->levels()[number].halo;
  int known = layers_exchanged(number);
  halo.exchange(level.b, known);
  ChebyshevSteps steps(smoothing_.from, smoothing_.to);
  const auto first = steps.next(), second = steps.next();
  pass("smooth_from_zero", number, SmoothFromZero<Field>(level.views, first, second, level.b, level.y, level.x), level.x, --known);
  for (int n = 2; n < smoothing_.steps; ++n) {
    if (known == 0) halo.exchange_with_others(level.x, known = 1);
    pass("smooth", number, Smooth<Field>(level.views, steps.next(), level.b, level.x, level.y), level.y, --known);
    std::swap(level.x, level.y);
  }
  return known;
}

template <class Field>
void MultigridCycle<Field>::smooth_up(std::size_t number) {
  Level& level = levels_[number];
  Halo& halo = hierarchy_->levels()[number].halo;
  ChebyshevSteps steps(smoothing_.from, smoothing_.to);
  int known = 0;
  for (int n = 0; n < smoothing_.steps; ++n) {
    if (known == 0) {
      known = n == 0 ? layers_exchanged(number) : 1;  // later ones read `previous`, too, which is not exchanged
      // What is done in other ranks' layers reads images of those, too.
      known > 1 ? halo.exchange(level.x, known) : halo.exchange_with_others(level.x, known);
    }
    pass("smooth", number, Smooth<Field>(level.views, steps.next(), level.b, level.x, level.y), level.y, --known);
    std::swap(level.x, level.y);
  }
}

template <class Field>
void MultigridCycle<Field>::run(int depth) {
  descend(0, depth);
  if (levels_.size() == 1 && solve_coarsest) hierarchy_->levels()[0].halo.exchange(levels_[0].x, 1);
}

template <class Field>
void MultigridCycle<Field>::descend(std::size_t number, int depth) {
  Level& level = levels_[number];
  if (number >= first_small_ && !solve_coarsest) return run_small(depth);
  const bool coarsest = number + 1 == levels_.size();
  if (coarsest && solve_coarsest) return solve_coarsest(level);
  const int known = smooth_down(number);
  if (!coarsest && depth > 0) {
    Halo& halo = hierarchy_->levels()[number].halo;
    Level& coarse = levels_[number + 1];
    auto& shared = hierarchy_->levels()[number + 1];
    if (known == 0) halo.exchange_with_others(level.x, 1);
    for_owned_rounded(cycle_label<Field>("residual"), level.views.index, LevelResidual<Field>{level.views, level.b, level.x, level.y});
    if (level.views.split) halo.exchange_with_others(level.y, 1);
    restrict_sums(level.views, coarse.views.index, level.y, coarse.b);
    if (shared.cells) shared.cells->run(coarse.b);
    descend(number + 1, depth - 1);
    if (level.views.split) shared.halo.exchange(coarse.x, 1);
    pass("prolong", number, AddCorrection<Field>(level.views, coarse.views.index, coarse.x, level.x), level.x);
  }
  smooth_up(number);
}

template class MultigridCycle<Array<CycleReal>>;
template class MultigridCycle<Components<CycleReal>>;

}  // namespace corpuscle
