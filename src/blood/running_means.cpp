#include "blood/running_means.hpp"

#include <cmath>
#include <cstddef>

namespace corpuscle {

void RunningMeans::add(const std::vector<double>& values) {
  if (levels_.empty()) origin_ = values;
  std::vector<double> block(values);
  const auto number = static_cast<double>(samples());
  for (int q = 0; q < quantities_; ++q) {
    block[q] -= origin_[q];
    trend_[q] += number * block[q];
  }
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

double RunningMeans::drift(int quantity) const {
  const auto count = static_cast<double>(samples());
  if (count < 2) return std::nan("");
  const double middle = 0.5 * (count - 1), squares = count * (count * count - 1) / 12;
  return (trend_[quantity] - middle * levels_.front().sum[quantity]) / squares * (count - 1);
}

/// The slope of a line through numbers without a trend has the variance of their mean times 12 over their count
/// squared.
double RunningMeans::drift_over_chance(int quantity) const {
  return std::abs(drift(quantity)) / (std::sqrt(12.0) * error(quantity));
}

std::vector<double> RunningMeans::state() const {
  std::vector<double> state{static_cast<double>(quantities_)};
  for (const auto* part : {&origin_, &trend_}) state.insert(state.end(), part->begin(), part->end());
  for (const Level& level : levels_) {
    state.push_back(static_cast<double>(level.blocks));
    state.push_back(level.waiting ? 1 : 0);
    for (const auto* part : {&level.sum, &level.square, &level.half})
      state.insert(state.end(), part->begin(), part->end());
  }
  return state;
}

bool RunningMeans::set_state(const std::vector<double>& state) {
  const std::size_t width = static_cast<std::size_t>(quantities_), stride = 2 + 3 * width;
  if (state.size() < 1 + 2 * width || state[0] != quantities_ || (state.size() - 1 - 2 * width) % stride != 0)
    return false;
  auto at = state.begin() + 1;
  const auto take = [&] {
    std::vector<double> values(at, at + quantities_);
    at += quantities_;
    return values;
  };
  origin_ = take(), trend_ = take();
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
