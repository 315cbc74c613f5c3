#include "blood/running_means.hpp"

#include <cmath>
#include <cstddef>

namespace corpuscle {

void RunningMeans::add(const std::vector<double>& values) {
  if (levels_.empty()) origin_ = values;
  std::vector<double> block(values);
  for (int q = 0; q < quantities_; ++q) block[q] -= origin_[q];
  for (std::size_t level = 0;; ++level) {
    if (level == levels_.size()) {
      const std::vector<double> zero(quantities_, 0.0);
      levels_.push_back({0, false, zero, zero, zero});
    }
    Level& at = levels_[level];
    ++at.blocks;
    for (int q = 0; q < quantities_; ++q) at.sum[q] += block[q], at.square[q] += block[q] * block[q];
    at.waiting = !at.waiting;
    if (at.waiting) {
      at.half = block;
      return;
    }
    for (int q = 0; q < quantities_; ++q) block[q] = 0.5 * (block[q] + at.half[q]);
  }
}

double RunningMeans::mean(int quantity) const {
  if (levels_.empty()) return std::nan("");
  const Level& all = levels_.front();
  return origin_[quantity] + all.sum[quantity] / static_cast<double>(all.blocks);
}

double RunningMeans::error(int quantity) const {
  double square = std::nan("");
  for (const Level& level : levels_) {
    if (level.blocks < least_blocks) break;
    const auto blocks = static_cast<double>(level.blocks);
    const double mean = level.sum[quantity] / blocks, variance = level.square[quantity] / blocks - mean * mean;
    const double estimate = variance < 0 ? 0 : variance / (blocks - 1);  // below zero by rounding
    if (!(estimate <= square)) square = estimate;
  }
  return std::sqrt(square);
}

std::vector<double> RunningMeans::state() const {
  std::vector<double> state{static_cast<double>(quantities_)};
  state.insert(state.end(), origin_.begin(), origin_.end());
  for (const Level& level : levels_) {
    state.push_back(static_cast<double>(level.blocks));
    state.push_back(level.waiting ? 1 : 0);
    for (const auto* part : {&level.sum, &level.square, &level.half}) state.insert(state.end(), part->begin(), part->end());
  }
  return state;
}

bool RunningMeans::set_state(const std::vector<double>& state) {
  const std::size_t width = static_cast<std::size_t>(quantities_), stride = 2 + 3 * width;
  if (state.size() < 1 + width || state[0] != quantities_ || (state.size() - 1 - width) % stride != 0) return false;
  auto at = state.begin() + 1;
  const auto take = [&] {
    std::vector<double> values(at, at + quantities_);
    at += quantities_;
    return values;
  };
  origin_ = take();
  levels_.clear();
  while (at != state.end()) {
    Level level;
    level.blocks = std::lround(*at++);
    level.waiting = *at++ != 0;
    level.sum = take(), level.square = take(), level.half = take();
    levels_.push_back(level);
  }
  return true;
}

}  // namespace corpuscle
