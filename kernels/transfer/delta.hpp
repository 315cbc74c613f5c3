// Regularised delta functions of one index coordinate: what a point gives to, and takes from, the grid points near it. Their
// values at all integers add up to one and their first moment about the point vanishes, wherever it is.
#pragma once

#include <Kokkos_Core.hpp>
#include <cmath>

namespace corpuscle {

/// Roma, Peskin & Berger, J. Comput. Phys. 153, 1999.
struct ThreePointDelta {
  static constexpr int points = 3;
  static constexpr double reach = 1.5;
  /// What is taken back by sharpen_faces(), spacings squared: the kernel's own 1/4 to 1/3, as a point lies between the integers, and
  /// something of what means between faces and centres smear, a quarter each way along a component's own direction.
  static constexpr double moment = 0.3;
  static constexpr double radius = 0.62;  // spacings, of the sphere that moves as a point alone
  /// The first of the integers near t.
  KOKKOS_INLINE_FUNCTION static int first(double t) { return static_cast<int>(std::floor(t + 0.5)) - 1; }
  KOKKOS_INLINE_FUNCTION static double value(double r) {
    const double a = std::fabs(r);
    if (a <= 0.5) return (1 + std::sqrt(1 - 3 * a * a)) / 3;
    const double under = 1 - 3 * (1 - a) * (1 - a);
    return (5 - 3 * a - std::sqrt(under > 0 ? under : 0)) / 6;
  }
  /// How the value of the integer numbered p from the first on changes with the point; `w` are the values of all.
  template <class Values>
  KOKKOS_INLINE_FUNCTION static double slope(const Values& w, int p) {
    const double r = w(2) - w(0), bend = r / (3 * w(1) - 1);  // 3 w(1) = 1 + sqrt(1 - 3 r^2)
    return p == 1 ? -bend : 0.5 * (bend + (p - 1));
  }
};

/// Peskin, Acta Numerica 11, 2002.
struct FourPointDelta {
  static constexpr int points = 4;
  static constexpr double reach = 2;
  static constexpr double moment = 0;  // as others have it
  static constexpr double radius = 1.25;
  KOKKOS_INLINE_FUNCTION static int first(double t) { return static_cast<int>(std::floor(t)) - 1; }
  KOKKOS_INLINE_FUNCTION static double value(double r) {
    const double a = std::fabs(r);
    if (a <= 1) return (3 - 2 * a + std::sqrt(1 + 4 * a - 4 * a * a)) / 8;
    const double under = -7 + 12 * a - 4 * a * a;
    return (5 - 2 * a - std::sqrt(under > 0 ? under : 0)) / 8;
  }
  template <class Values>
  KOKKOS_INLINE_FUNCTION static double slope(const Values& w, int p) {
    const double r = 2 * (w(2) - w(1)) + 0.5, bend = (2 - 4 * r) / (4 * (w(1) - w(0)));  // 4 (w(1) - w(0)) = sqrt(1 + 4 r - 4 r^2)
    return 0.125 * ((p < 2 ? -2 : 2) + (p == 1 || p == 2 ? bend : -bend));
  }
};

}  // namespace corpuscle
