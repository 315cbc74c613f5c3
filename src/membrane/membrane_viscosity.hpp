// Which form of membrane viscosity the cells need, decided once at set-up.
#pragma once

#include "membrane/elasticity.hpp"
#include "membrane/viscosity.hpp"

namespace corpuscle {

class MembraneViscosity {
 public:
  MembraneViscosity(const MembraneViews& membranes, bool tangential);

  template <class Load>
  void predict_velocity(const MembraneViews& m, const MotionViews& motion, const Load& load, double dt) const {
    if (tangential_) {
      predict_viscous_velocity<FullDamping>(m, motion, views_, load, dt);
    } else {
      predict_viscous_velocity<CentralDamping>(m, motion, views_, load, dt);
    }
  }

  /// See Membranes::remember_forces() and Membranes::resist(): solves (beta A + D) v = beta A U + F - F_last + q dV/dx for
  /// m.surface.v, which holds U, with the pressure q inside that keeps the volume, and takes D v off the forces F. The triangle
  /// geometry must be current; motion.direction is where the solver of q starts from.
  void remember_forces(const MembraneViews& m, const Components<double>& force);
  void resist(const MembraneViews& m, const MotionViews& motion, double beta, const Components<double>& force) const;

  /// Dissipative force for velocities v [vertex, 3] at the present positions, nN, into `force` [vertex, 3].
  void force(const MembraneViews& m, const Elasticity& elasticity, const Components<double>& v,
             const Components<double>& force) const;

  /// Power that it takes from the membranes at their present velocities, nW.
  double dissipation(const MembraneViews& m) const;

  /// Iterations of the last velocity solve, the largest over the cells. Waits for the device.
  int iterations() const;

 private:
  template <class Damping>
  void resist_with(const MembraneViews& m, const MotionViews& motion, double beta, const Components<double>& force) const;

  bool tangential_;
  Components<double> last_force_;  // [vertex, 3] nN, only for membranes that move with the fluid; after resist() what it took off
  ViscosityViews views_;
};

}  // namespace corpuscle
