// Membranes brought to rest under given forces, quasi-statically.
#pragma once

#include <functional>

#include "membrane/relaxation.hpp"

namespace corpuscle {

class RestSearch {
 public:
  /// @param edge       typical edge of the mesh, um
  /// @param stiffness  largest eigenvalue of any cell's Hessian at the present shape, nN/um; asked for now and then
  RestSearch(const MembraneViews& membranes, const Elasticity& elasticity, double edge, std::function<double()> stiffness);

  /// Forces from outside, [vertex, 3] nN; none at first.
  const Components<double>& applied() const { return work_.applied; }

  struct Outcome {
    int iterations = 0;
    double force = 0;  // the largest left on any vertex, nN; not a number if any is not
    bool at_rest = false;
  };
  /// Move the vertices until none carries more than `force` nN, or give up. The velocities end at zero.
  Outcome run(double force, int max_iterations);

 private:
  RelaxationLimits limits() const;

  const MembraneViews& membranes_;
  const Elasticity& elasticity_;
  double edge_;
  std::function<double()> stiffness_;
  RelaxationViews work_;
};

/// Edge of an even mesh of that area, um.
double typical_edge(double area_um2, int triangles);

}  // namespace corpuscle
