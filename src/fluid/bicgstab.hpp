// Stabilised bi-conjugate gradients (van der Vorst 1992) for a Jacobian-free operator.
#pragma once

#include "common/types.hpp"
#include "parallel/comm.hpp"

#include <KokkosBlas1_axpby.hpp>
#include <KokkosBlas1_dot.hpp>
#include <KokkosBlas1_update.hpp>

#include <cmath>

namespace corpuscle {

struct KrylovResult {
  int iterations = 0;
  double residual = 0;  // 2-norm
  bool converged = false;
};

/// Work vectors live as long as the solver, so a solve allocates nothing. Vectors hold this rank's unknowns.
class BiCGStab {
 public:
  BiCGStab(const Comm& comm, int size, const std::string& owner)
      : comm_(comm),
        shadow_(uninitialised(owner + "::shadow"), size),
        p_(uninitialised(owner + "::p"), size),
        v_(uninitialised(owner + "::v"), size),
        t_(uninitialised(owner + "::t"), size) {}

  /// Solve A x = r from x = 0 until the residual's 2-norm is below `tolerance`; r ends as the residual.
  /// `apply(x, y)` sets y = A x.
  template <class Operator>
  KrylovResult solve(const Operator& apply, const Array<double>& r, const Array<double>& x, double tolerance,
                     int max_iterations) {
    Kokkos::deep_copy(x, 0.0);
    Kokkos::deep_copy(shadow_, r);
    Kokkos::deep_copy(p_, r);
    double rho = comm_.sum(KokkosBlas::dot(r, r));
    KrylovResult result;
    result.residual = std::sqrt(rho);
    while (true) {
      if (result.residual <= tolerance) return result.converged = true, result;
      if (result.iterations >= max_iterations || !std::isfinite(result.residual)) return result;
      apply(p_, v_);
      const double alpha = rho / comm_.sum(KokkosBlas::dot(shadow_, v_));
      KokkosBlas::axpy(-alpha, v_, r);
      apply(r, t_);
      double products[2] = {KokkosBlas::dot(t_, r), KokkosBlas::dot(t_, t_)};
      comm_.sum(products, 2);
      const double omega = products[1] > 0 ? products[0] / products[1] : 0;
      KokkosBlas::update(alpha, p_, omega, r, 1.0, x);
      KokkosBlas::axpy(-omega, t_, r);
      double next[2] = {KokkosBlas::dot(r, r), KokkosBlas::dot(shadow_, r)};
      comm_.sum(next, 2);
      result.residual = std::sqrt(next[0]);
      ++result.iterations;
      if (omega == 0 || std::abs(next[1]) < 1e-30 * next[0]) {  // breakdown: start again from the present residual
        Kokkos::deep_copy(shadow_, r);
        Kokkos::deep_copy(p_, r);
        rho = next[0];
        continue;
      }
      const double beta = (next[1] / rho) * (alpha / omega);
      rho = next[1];
      KokkosBlas::update(1.0, r, -beta * omega, v_, beta, p_);
    }
  }

 private:
  Comm comm_;
  Array<double> shadow_, p_, v_, t_;
};

}  // namespace corpuscle
