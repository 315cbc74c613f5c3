// Chebyshev iteration for a system whose eigenvalues lie between two positive bounds (Saad, Iterative Methods for Sparse
// Linear Systems, 2nd ed., section 12.3). It needs no inner products, so a step is one pass over the fields.
#pragma once

namespace corpuscle {

/// Coefficients of x[k+1] = x[k] + momentum (x[k] - x[k-1]) + weight (b - A x[k]), one step after the other.
class ChebyshevSteps {
 public:
  struct Step {
    double momentum, weight;
  };

  /// @param lowest, highest  bounds of the eigenvalues, 0 < lowest < highest
  ChebyshevSteps(double lowest, double highest) : centre_((highest + lowest) / 2), radius_((highest - lowest) / 2), rho_(0) {}

  Step next() {
    if (rho_ == 0) {
      rho_ = radius_ / centre_;
      return {0, 1 / centre_};
    }
    const double rho = 1 / (2 * centre_ / radius_ - rho_);
    const Step step{rho * rho_, 2 * rho / radius_};
    rho_ = rho;
    return step;
  }

 private:
  double centre_, radius_, rho_;
};

}  // namespace corpuscle
