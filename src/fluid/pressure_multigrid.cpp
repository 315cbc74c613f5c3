#include "fluid/pressure_multigrid.hpp"

#include "fluid/flux.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr int smoothing_steps = 3;
// Smoothing acts on this part of the spectrum of D^-1 A, which ends below 2. Measured on the tube with a cell: 0.2 to 2
// with three steps takes the fewest passes over the fields of 0.1 to 0.4 with two to five.
constexpr double smoothed_from = 0.2, smoothed_to = 2.0;
// A direction is coarsened where it couples at least this much of the strongest one.
constexpr double strong = 0.4;
constexpr int smallest_block = 2 * IndexSpace::halo;  // along a direction that is cut over ranks or periodic
constexpr double coarsest_cells = 300;

template <class Real>
void allocate(const IndexSpace& index, LevelOperator<Real>& level) {
  level.index = index;
  for (auto& g : level.conductance) g = Array<Real>("corpuscle::multigrid::conductance", index.size());
  level.diagonal = Array<Real>("corpuscle::multigrid::diagonal", index.size());
  level.inverse = Array<Real>("corpuscle::multigrid::inverse", index.size());
}

MultigridLevel make_level(const IndexSpace& index) {
  MultigridLevel level;
  allocate(index, level);
  return level;
}

Array<CycleReal> cycle_vector(const IndexSpace& index) {
  return Array<CycleReal>("corpuscle::multigrid::cycle_vector", index.size());
}

}  // namespace

PressureMultigrid::PressureMultigrid(Grid& grid, const Array<double> (&coefficient)[3], int max_iterations)
    : grid_(&grid), max_iterations_(max_iterations) {
  const IndexSpace& index = grid.index();
  for (int d = 0; d < 3; ++d) coefficient_[d] = coefficient[d];
  levels_.push_back({make_level(index), Halo(grid.comm(), index, grid.ranks_per_direction()), cycle_vector(index),
                     cycle_vector(index), cycle_vector(index)});
  for (auto* vector : {&p_, &q_, &r_}) *vector = Array<double>("corpuscle::multigrid::vector", index.size());
  allocate(index, operator_);
  auto& finest = levels_[0].views;
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) finest.open[d][side] = grid.halo().neighbour(d, side) >= 0;
  const PressureMask everywhere("corpuscle::multigrid::mask", index.size());
  Kokkos::deep_copy(everywhere, 1);
  mask_conductances(coefficient_, everywhere, operator_);
  round_operator(operator_, finest);
  while (add_coarser()) {
  }
  Level& last = levels_.back();
  const int rows = last.views.index.owned();
  coarsest_ = std::make_unique<PressureSolver>(grid.comm(), last.views.index, last.halo, false, max_iterations);
  coarse_rhs_ = Array<double>("corpuscle::multigrid::coarse_rhs", rows);
  coarse_x_ = Array<double>("corpuscle::multigrid::coarse_x", rows);
}

/// Append the next level, unless the last one is small enough or cannot be coarsened where it should be.
bool PressureMultigrid::add_coarser() {
  const Comm& comm = grid_->comm();
  Level& fine = levels_.back();
  IndexSpace index = fine.views.index;
  if (static_cast<double>(index.global[0]) * index.global[1] * index.global[2] <= coarsest_cells) return false;
  double strength[3], most = 0;
  for (int d = 0; d < 3; ++d) strength[d] = sum_conductances(fine.views, d);
  comm.sum(strength, 3);
  for (double s : strength) most = std::max(most, s);
  std::array<bool, 3> joined{};
  for (int d = 0; d < 3; ++d) {
    if (strength[d] < strong * most) continue;
    const bool cut = comm.max(fine.views.open[d][0] || fine.views.open[d][1] ? 1.0 : 0.0) > 0;
    const int least = static_cast<int>(comm.min(index.n[d]));
    if (least < (cut ? smallest_block : 2)) return false;
    joined[d] = true;
  }
  for (int d = 0; d < 3; ++d) {
    fine.views.factor[d] = joined[d] ? 2 : 1;
    index.n[d] = (index.n[d] + fine.views.factor[d] - 1) / fine.views.factor[d];
    index.first[d] = 0;  // not used: only the rows' numbers tell cells of different ranks apart
    // Blocks of odd length round up, so the whole is the sum over the ranks along d.
    const auto& ranks = grid_->ranks_per_direction();
    const double lines = static_cast<double>(comm.size()) / ranks[d];
    index.global[d] = static_cast<int>(std::lround(comm.sum(static_cast<double>(index.n[d])) / lines));
  }
  MultigridLevel views = make_level(index);
  std::copy(&fine.views.open[0][0], &fine.views.open[0][0] + 6, &views.open[0][0]);
  coarsen_conductances(fine.views, views);
  levels_.push_back({views, Halo(comm, index, grid_->ranks_per_direction()), cycle_vector(index), cycle_vector(index),
                     cycle_vector(index)});
  return true;
}

std::vector<int> PressureMultigrid::cells() const {
  std::vector<int> counts;
  for (const auto& level : levels_) counts.push_back(level.views.index.owned());
  return counts;
}

void PressureMultigrid::update(const PressureMask& mask, int pinned) {
  mask_conductances(coefficient_, mask, operator_);
  level_diagonals(operator_, -1, 0.0);
  double extra = 0;
  if (pinned >= 0) {  // the extra is as large as the diagonal itself
    Kokkos::deep_copy(extra, Kokkos::subview(operator_.diagonal, pinned));
    level_diagonals(operator_, pinned, extra);
  }
  grid_->halo().exchange(operator_.inverse);
  round_operator(operator_, levels_[0].views);
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    auto& views = levels_[l].views;
    if (l > 0) {
      coarsen_conductances(levels_[l - 1].views, views);
      level_diagonals(views, pinned, static_cast<CycleReal>(extra));
      levels_[l].halo.exchange(views.inverse);
    }
    if (pinned >= 0 && l + 1 < levels_.size()) {
      int at[3];
      views.index.unpack(pinned, at[0], at[1], at[2]);
      for (int d = 0; d < 3; ++d) at[d] /= views.factor[d];
      pinned = levels_[l + 1].views.index.cell(at[0], at[1], at[2]);
    }
  }
  level_rows(levels_.back().views, coarsest_->values());
  coarsest_->set_values();
  coarsest_->set_up();
}

void PressureMultigrid::solve_coarsest(Level& level) {
  compact_scalar(level.views.index, level.b, coarse_rhs_);
  coarsest_->cycle(coarse_rhs_, coarse_x_);
  spread_scalar(level.views.index, 1, coarse_x_, level.x);
}

/// x = one V-cycle for b on a level and all below it.
void PressureMultigrid::cycle(std::size_t number) {
  Level& level = levels_[number];
  if (number + 1 == levels_.size()) return solve_coarsest(level);
  const MultigridLevel& views = level.views;
  level.halo.exchange(level.b);
  ChebyshevSteps before(smoothed_from, smoothed_to);
  const auto first = before.next(), second = before.next();
  smooth_from_zero(views, first, second, level.b, level.y, level.x);
  for (int n = 2; n < smoothing_steps; ++n) {
    level.halo.exchange(level.x);
    smooth(views, before.next(), level.b, level.x, level.y);
    std::swap(level.x, level.y);
  }
  level.halo.exchange(level.x);
  Level& coarse = levels_[number + 1];
  restrict_residual(views, coarse.views.index, level.b, level.x, level.y, coarse.b);
  cycle(number + 1);
  add_correction(views, coarse.views.index, coarse.x, level.x);
  ChebyshevSteps after(smoothed_from, smoothed_to);
  for (int n = 0; n < smoothing_steps; ++n) {
    level.halo.exchange(level.x);
    smooth(views, after.next(), level.b, level.x, level.y);
    std::swap(level.x, level.y);
  }
}

KrylovResult PressureMultigrid::solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance) {
  constexpr double least_reduction = 1e-10;  // in one solve; round-off allows about 1e-12
  const Comm& comm = grid_->comm();
  Level& finest = levels_[0];
  const IndexSpace& index = finest.views.index;
  scalar_from_compact(index, rhs, r_);
  Kokkos::deep_copy(Exec(), x, 0.0);
  KrylovResult result;
  double norm = std::sqrt(comm.sum(owned_dot(index, r_, r_)));
  result.residual = norm;
  if (!(norm > 0) || !std::isfinite(norm)) {
    result.converged = norm == 0;
    return result;
  }
  // The cycle sees residuals of order one: single precision has no room for very small ones.
  double scale = 1 / norm;
  spread_scalar(index, scale, rhs, finest.b);
  const double tolerance = std::max(absolute_tolerance, least_reduction * norm);
  double rz = 1;
  while (norm > tolerance && result.iterations < max_iterations_ && std::isfinite(norm)) {
    cycle(0);
    const double next = comm.sum(owned_dot(index, r_, finest.x)) / scale;
    new_direction(index, result.iterations == 0 ? 0.0 : next / rz, 1 / scale, finest.x, p_);
    rz = next;
    finest.halo.exchange(p_);
    const double alpha = rz / comm.sum(apply_and_dot(operator_, p_, q_));
    scale = 1 / norm;
    norm = std::sqrt(comm.sum(advance_and_norm(index, alpha, scale, p_, q_, x, r_, finest.b)));
    ++result.iterations;
  }
  result.converged = norm <= tolerance;
  return result;
}

}  // namespace corpuscle
