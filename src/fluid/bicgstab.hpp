// Stabilised bi-conjugate gradients (van der Vorst 1992), preconditioned from the right.
#pragma once

#include <cmath>

namespace corpuscle {

struct KrylovResult {
  int iterations = 0;
  double residual = 0;  // 2-norm
  bool converged = false;
};

/// Solve A x = r for a change of x until the residual's 2-norm is below `tolerance`. A half iteration that is enough ends
/// the solve, and counts as one.
/// @param system  holds x, r and the work vectors, and takes sums over all ranks:
///   start()            shadow = p = r
///   apply_p()          direction = M p with M close to the inverse of A, v = A direction; returns (shadow, v)
///   advance_v(alpha)   x += alpha direction, r -= alpha v; returns (r, r)
///   apply_r()          direction = M r, t = A direction; returns {(t, r), (t, t)}
///   advance_t(omega)   x += omega direction, r -= omega t; returns {(r, r), (shadow, r)}
///   next_p(beta, w)    p = r + beta (p - w v)
/// @param square  (r, r)
template <class System>
KrylovResult bicgstab(System& system, double square, double tolerance, int max_iterations) {
  system.start();
  double rho = square;
  KrylovResult result;
  result.residual = std::sqrt(rho);
  while (true) {
    if (result.residual <= tolerance) return result.converged = true, result;
    if (result.iterations >= max_iterations || !std::isfinite(result.residual)) return result;
    const double alpha = rho / system.apply_p();
    if (!std::isfinite(alpha)) return result;
    ++result.iterations;
    result.residual = std::sqrt(system.advance_v(alpha));
    if (result.residual <= tolerance) continue;
    const auto [along, whole] = system.apply_r();
    const double omega = whole > 0 ? along / whole : 0;
    const auto [norm, next] = system.advance_t(omega);
    result.residual = std::sqrt(norm);
    if (omega == 0 || std::abs(next) < 1e-30 * norm) {  // breakdown: start again from the present residual
      system.start();
      rho = norm;
      continue;
    }
    const double beta = (next / rho) * (alpha / omega);
    rho = next;
    system.next_p(beta, omega);
  }
}

}  // namespace corpuscle
