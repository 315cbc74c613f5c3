#include "blood/running_means.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace corpuscle {

void RunningMean::add(double value) {
  if (levels_.empty()) origin_ = value;
  double block = value - origin_;
  for (std::size_t level = 0;; ++level) {
    if (level == levels_.size()) levels_.emplace_back();
    Level& at = levels_[level];
    at.sum += block, at.square += block * block;
    at.trend += static_cast<double>(at.blocks) * block;
    if (at.blocks > 0) at.steps += (block - at.last) * (block - at.last);
    ++at.blocks;
    at.waiting = !at.waiting;
    const double before = at.last;
    at.last = block;
    if (at.waiting) return;
    block = 0.5 * (before + block);
  }
}

double RunningMean::mean() const {
  if (levels_.empty()) return std::nan("");
  const Level& all = levels_.front();
  return origin_ + all.sum / static_cast<double>(all.blocks);
}

/// Of the line that fits best, from one block to the next.
double RunningMean::slope(const Level& level) {
  const auto count = static_cast<double>(level.blocks);
  const double middle = 0.5 * (count - 1), squares = count * (count * count - 1) / 12;
  return (level.trend - middle * level.sum) / squares;
}

/// Neighbouring blocks of which each remembers the share r of the one before hide the factor (1 + r) / (1 - r) of the
/// variance. They must be so many that r is small within its own uncertainty.
RunningMean::Spread RunningMean::spread(bool about_line) const {
  constexpr double small = 0.45, rounding = 1e-12;
  Spread result{std::nan(""), false};
  double most = 0;
  for (const Level& level : levels_) {
    if (level.blocks < least_blocks) break;
    const auto blocks = static_cast<double>(level.blocks);
    const double mean = level.sum / blocks, whole = std::max(0.0, (level.square - blocks * mean * mean) / (blocks - 1));
    double variance = whole, step = 0.5 * level.steps / (blocks - 1);
    if (about_line) {
      const double rise = slope(level);
      variance = std::max(0.0, whole - rise * rise * blocks * (blocks + 1) / 12);
      step = std::max(0.0, step - 0.5 * rise * rise);
      if (variance <= rounding * whole) variance = step = 0;
    }
    const double shared = variance > 0 ? 1 - step / variance : 0, positive = std::clamp(shared, 0.0, small);
    result.known = shared + 1 / std::sqrt(blocks) <= small;
    most = std::max(most, variance / blocks);
    const double all = result.known ? variance / blocks * (1 + positive) / (1 - positive) : 0;
    result.error = std::sqrt(std::max(most, all));
  }
  return result;
}

double RunningMean::effective_samples() const {
  const double error = least_error(), count = static_cast<double>(samples());
  if (!(error > 0)) return error == 0 ? count : std::nan("");
  const Level& all = levels_.front();
  const double mean = all.sum / count;
  return std::min(count, (all.square - count * mean * mean) / (count - 1) / (error * error));
}

double RunningMean::correlation() const { return 0.5 * static_cast<double>(samples()) / effective_samples(); }

double RunningMean::drift() const {
  if (samples() < 2) return std::nan("");
  return slope(levels_.front()) * static_cast<double>(samples() - 1);
}

/// The slope of a line through numbers without a trend has the variance of their mean times 12 over their count
/// squared.
double RunningMean::drift_over_chance() const {
  const Spread about_line = spread(true);
  if (!about_line.known) return std::nan("");
  const double change = std::abs(drift());
  return change == 0 ? 0 : change / (std::sqrt(12.0) * about_line.error);
}

void RunningMean::append_state(std::vector<double>& state) const {
  state.insert(state.end(), {static_cast<double>(levels_.size()), origin_});
  for (const Level& level : levels_)
    state.insert(state.end(), {static_cast<double>(level.blocks), level.waiting ? 1.0 : 0.0, level.sum, level.square, level.trend,
                               level.steps, level.last});
}

std::size_t RunningMean::take_state(const std::vector<double>& state, std::size_t at) {
  constexpr std::size_t head = 2, width = 7, most = 64;
  if (at + head > state.size() || !(state[at] >= 0 && state[at] <= most)) return 0;
  const auto count = static_cast<std::size_t>(state[at]);
  const std::size_t size = head + width * count;
  if (at + size > state.size()) return 0;
  origin_ = state[at + 1];
  levels_.clear();
  for (const double* row = state.data() + at + head; row != state.data() + at + size; row += width)
    levels_.push_back({std::lround(row[0]), row[1] != 0, row[2], row[3], row[4], row[5], row[6]});
  return size;
}

void RunningMeans::add(const std::vector<double>& values) {
  ++samples_;
  for (std::size_t q = 0; q < series_.size(); ++q)
    if (std::isfinite(values[q])) series_[q].add(values[q]);
}

double RunningMeans::error(int quantity) const {
  const RunningMean& series = series_[quantity];
  return series.error_known() ? series.least_error() : std::nan("");
}

namespace {

constexpr double form = -2;  // of the state; states of another one are not read

}  // namespace

std::vector<double> RunningMeans::state() const {
  std::vector<double> state{form, static_cast<double>(series_.size()), static_cast<double>(samples_)};
  for (const RunningMean& series : series_) series.append_state(state);
  return state;
}

bool RunningMeans::set_state(const std::vector<double>& state) {
  if (state.size() < 3 || state[0] != form || state[1] != static_cast<double>(series_.size())) return false;
  std::vector<RunningMean> read(series_.size());
  std::size_t at = 3;
  for (RunningMean& series : read) {
    const std::size_t taken = series.take_state(state, at);
    if (taken == 0) return false;
    at += taken;
  }
  if (at != state.size()) return false;
  series_ = std::move(read);
  samples_ = std::lround(state[2]);
  return true;
}

}  // namespace corpuscle
