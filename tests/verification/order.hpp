// Fitted orders of convergence.
#pragma once

#include <cmath>
#include <vector>

namespace corpuscle {

/// Least-squares slope of log error over log spacing.
inline double fitted_order(const std::vector<double>& spacing, const std::vector<double>& error) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double n = static_cast<double>(spacing.size());
  for (std::size_t i = 0; i < spacing.size(); ++i) {
    const double x = std::log(spacing[i]), y = std::log(error[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace corpuscle
