// Bodies that cut the grid: the flow sees them as moving boundaries. On its own, rigid bodies held or moved as prescribed.
#pragma once

#include "coupling/coupling.hpp"

namespace corpuscle {

class SharpCoupling : public Coupling {
 public:
  /// @param membranes  null for a scene of rigid bodies alone
  SharpCoupling(const Case& scene, FluidSolver& fluid, Timers& timers, std::unique_ptr<Membranes> membranes);

  void check_start() override;
  StepStatistics advance(double time_us, double dt_us) override;
  /// What advance() does one after the other, without membranes: bodies that move go to where they are then, and the flow is solved.
  void move_bodies(double time_us);
  void solve_flow(double time_us);
  void resume(double time_us) override;
  const Components<double>& tractions_for_output() override;
  std::string coarse() const override { return coarse_; }
  std::vector<Triple> wrapped_by() const override { return immersed_->wrapped_by(); }

  const SurfaceSet& surfaces() const override { return *surfaces_; }
  Membranes* membranes() override { return membranes_.get(); }
  RigidBodies* rigid_bodies() override { return rigid_bodies_.get(); }
  ImmersedFlow* immersed() override { return immersed_.get(); }

  /// A vertex must keep this many grid spacings from walls: at the start, and later.
  static constexpr double starting_gap = 1.0, smallest_gap = 0.75;

 protected:
  void check_body_steps();
  void move_rigid_bodies(double time_us);

  Case scene_;
  FluidSolver& fluid_;
  Timers& timers_;
  std::unique_ptr<Membranes> membranes_;
  std::unique_ptr<SurfaceSet> surfaces_;
  std::unique_ptr<RigidBodies> rigid_bodies_;
  std::unique_ptr<ImmersedFlow> immersed_;

 private:
  std::string coarse_;
  bool has_flow_ = false;  // a step has been made: there are tractions to be had
};

/// The surfaces of a case's rigid bodies at their start.
std::vector<TriangleMesh> body_meshes(const Case& scene, const Grid& grid);

}  // namespace corpuscle
