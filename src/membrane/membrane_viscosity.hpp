// Which form of membrane viscosity the cells need, decided once at set-up.
#pragma once

#include <array>
#include <vector>

#include "core/workspace.hpp"
#include "membrane/elasticity.hpp"
#include "membrane/reference.hpp"
#include "membrane/stiffness.hpp"
#include "membrane/viscous_band.hpp"

namespace corpuscle {

class MembraneViscosity {
 public:
  explicit MembraneViscosity(bool tangential);
  /// Memory for these membranes.
  void make_room(const MembraneViews& m);
  /// The same for those that a rank holds at present, which move with the fluid.
  /// @param parts  of the cells, which are dealt with one after the other
  void hold(const MembraneViews& m, const std::vector<CellPart>& parts);
  /// Before hold(): matrices of these are factorised, unless they are too large for that.
  void prepare(const std::vector<CellReference>& types);
  /// [vertex, 3] nN, that membranes which move with the fluid gave it in their last step, and what FluidReaction needs of the one
  /// before; zero before the first.
  std::array<Components<double>, 2> carried() const { return {given_, past_}; }
  /// Of D, in what the fluid's reaction to short waves is taken for; none at first.
  void take_share(double share) { share_ = share; }

  template <class Load>
  void predict_velocity(const MembraneViews& m, const MotionViews& motion, const Load& load, double dt) const {
    if (tangential_) {
      predict_viscous_velocity<FullDamping>(m, motion, views_, load, dt);
    } else {
      predict_viscous_velocity<CentralDamping>(m, motion, views_, load, dt);
    }
  }

  /// See Membranes::resist(): solves (R + D) v = (R U - given) carried on + F + q dV/dx for m.surface.v, which holds U, with the
  /// pressure q inside that keeps the volume, and takes D v off the forces F, which are given then; see FluidReaction. The triangle
  /// geometry must be current.
  void resist(const MembraneViews& m, Workspace& workspace, double beta, double ahead, const Components<double>& force);

  /// What a step leaves of the forces mode [vertex, 3] of membranes that were at rest and gave none: takes D v off them, where
  /// (R + D) v = mode + q dV/dx. The other arrays are overwritten. Only with hold(); otherwise as resist().
  void relieve(const MembraneViews& m, Workspace& workspace, double beta, const StiffnessViews& work);

  /// The forces by which D resists the unit mode, into work.mode; the other arrays are overwritten. As relieve().
  void damp(const MembraneViews& m, Workspace& workspace, const StiffnessViews& work);
  /// So that resist() and relieve() find room in the workspace as it is.
  void reserve(const MembraneViews& m, Workspace& workspace) const { workspace.reserve(scratch_numbers(m)); }

  /// Dissipative force for velocities v [vertex, 3] at the present positions, nN, into `force` [vertex, 3].
  void force(const MembraneViews& m, const Elasticity& elasticity, const Components<double>& v, const Components<double>& force) const;

  /// Power that it takes from the membranes at their present velocities, nW.
  double dissipation(const MembraneViews& m) const;

  /// Iterations of the last velocity solve, the largest over the cells. Waits for the device.
  int iterations() const;

 private:
  /// Of the largest part.
  std::size_t scratch_numbers(const MembraneViews& m) const;
  void divide_scratch(const MembraneViews& m, double* memory);
  /// @param m  whose velocities are U and become v  @param damping  [vertex, 3] becomes D v
  template <class Damping, class Taken>
  void resist_with(const MembraneViews& m, const FluidReaction& fluid, const Taken& damping) const;
  template <class Taken>
  void resist_with(const MembraneViews& m, const FluidReaction& fluid, const Taken& damping) const;

  template <class Damping>
  void damp_with(const MembraneViews& part, const StiffnessViews& work) const;

  bool tangential_;
  double share_ = 0;
  Components<double> given_, past_;  // [vertex, 3] nN; only with hold()
  Components<float> taken_;          // [vertex, 3] nN, what the last resist() took off, of which only the power is told; only with hold()
  std::vector<CellPart> parts_;      // only with hold(): else all cells at once
  Array<double> scratch_;            // without hold(): else it lies in the workspace
  ViscosityViews views_;
  ViscousBand band_;  // without teams: conjugate gradients
};

}  // namespace corpuscle
