#include "core/anderson.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

AndersonAcceleration::AndersonAcceleration(int entries, int depth, std::function<void(double*, int)> sum)
    : depth_(depth),
      sum_(std::move(sum)),
      differences_{Components<double>("corpuscle::acceleration::residual_differences", entries, depth),
                   Components<double>("corpuscle::acceleration::iterate_differences", entries, depth)},
      previous_guess_("corpuscle::acceleration::previous_guess", entries),
      previous_residual_("corpuscle::acceleration::previous_residual", entries),
      products_("corpuscle::acceleration::products", 2 * depth),
      weight_("corpuscle::acceleration::weight", depth),
      products_host_(Kokkos::create_mirror_view(products_)),
      weight_host_(Kokkos::create_mirror_view(weight_)),
      gram_(depth * depth),
      right_(depth) {}

/// Least-squares weights of the differences by Cholesky factorisation of their products, scaled to a unit diagonal. A
/// difference that depends on those before it, to round-off, gets no weight.
std::vector<double> AndersonAcceleration::weights(int columns) const {
  constexpr double dependent = 1e-12;
  std::vector<double> factor(columns * columns, 0.0), scale(columns), result(columns, 0.0);
  std::vector<bool> used(columns, true);
  for (int c = 0; c < columns; ++c) scale[c] = 1 / std::sqrt(std::max(gram_[c * depth_ + c], 1e-300));
  for (int c = 0; c < columns; ++c) {
    for (int b = 0; b <= c; ++b) {
      double sum = gram_[b * depth_ + c] * scale[b] * scale[c];
      for (int a = 0; a < b; ++a) sum -= factor[b * columns + a] * factor[c * columns + a];
      if (b < c)
        factor[c * columns + b] = used[b] ? sum / factor[b * columns + b] : 0.0;
      else
        used[c] = sum > dependent;
      if (b == c) factor[c * columns + c] = used[c] ? std::sqrt(sum) : 1.0;
    }
  }
  for (int c = 0; c < columns; ++c) {
    double sum = right_[c] * scale[c];
    for (int b = 0; b < c; ++b) sum -= factor[c * columns + b] * result[b];
    result[c] = used[c] ? sum / factor[c * columns + c] : 0.0;
  }
  for (int c = columns - 1; c >= 0; --c) {
    double sum = result[c];
    for (int b = c + 1; b < columns; ++b) sum -= factor[b * columns + c] * result[b];
    result[c] = used[c] ? sum / factor[c * columns + c] : 0.0;
  }
  for (int c = 0; c < columns; ++c) result[c] *= scale[c];
  return result;
}

void AndersonAcceleration::advance(const Array<double>& guess, const Array<double>& residual) {
  const int column = recorded_ >= 0 ? recorded_ % depth_ : -1;
  record_differences(column, differences_, guess, residual, previous_guess_, previous_residual_);
  ++recorded_;
  const int columns = std::min(recorded_, depth_);
  if (columns > 0) {
    difference_products(columns, column, differences_.residual, residual, products_);
    Kokkos::deep_copy(products_host_, products_);
    if (sum_) sum_(products_host_.data(), 2 * columns);
    for (int c = 0; c < columns; ++c) {
      gram_[c * depth_ + column] = gram_[column * depth_ + c] = products_host_(c);
      right_[c] = products_host_(c + columns);
    }
    const auto weight = weights(columns);
    std::copy(weight.begin(), weight.end(), weight_host_.data());
    Kokkos::deep_copy(weight_, weight_host_);
  }
  combine_differences(columns, weight_, differences_.iterate, residual, guess);
}

}  // namespace corpuscle
