// The flow around immersed surfaces: geometry, one fluid solve, tractions; summed over ranks.
#pragma once

#include "core/timers.hpp"
#include "fluid/flow_balances.hpp"
#include "immersed/immersed_boundary.hpp"

#include <array>
#include <memory>
#include <optional>
#include <string>

namespace corpuscle {

/// Worst counts over a run, for the report; of all ranks together.
struct ImmersedReport {
  long classifications = 0;
  long immersed = 0, inside = 0, isolated = 0;
  long uncovered = 0;           // nodes that came out of a body, over the run
  long velocity_fallbacks = 0;  // rows worse than one probe, over the run
  double least_wall_spacings = 1e30;
  double least_body_spacings = 1e30;  // between two bodies
};

/// Who may leave the grid where: the first vertices, those of cells, through sides that flow leaves by.
struct Leaving {
  std::array<bool, 6> sides{};
  int vertices = 0;
};

struct NearOutflow {
  double distance_um;
  std::string vertex;  // "cells.0, vertex 17 at (x, y, z) um"
};

class ImmersedFlow {
 public:
  ImmersedFlow(FluidSolver& fluid, const SurfaceSet& surfaces, const Leaving& leaving, Timers& timers);

  /// Classify nodes and build all stencils at the surfaces' present positions.
  /// @param smallest_gap  refuse surfaces nearer to a wall or to each other than this many local spacings
  /// @throws ComputationError  vertex outside the grid or too near to a wall, surfaces that cross or are too near to each
  ///                           other, body too small for the grid
  void update_geometry(double smallest_gap);
  /// Solve the flow with the surfaces' present velocities.
  void solve(double time_us);
  /// Stress of the fluid at every vertex, the same on all ranks.
  const SurfaceStress& tractions();
  /// Lowest vertex in a film without fluid nodes, to a second body, at the last tractions; no_vertex for none. Its pressure,
  /// and those of all its neighbours, are not known. The same on all ranks.
  int unseen_vertex() const { return unseen_vertex_; }
  std::string vertex_text(int vertex) const { return boundary_->describe_vertex(vertex); }

  /// As before the first step: tractions() only to see whether it can tell them leaves none.
  void forget_tractions();

  /// The last of these, zero before the first, and as tractions -p n + viscous part, [vertex, 3] kPa.
  const SurfaceStress& last_stress() const { return stress_; }
  const Components<double>& last_tractions() const { return traction_; }

  /// Force and torque (about `centre`, [body], where the body would be had it not been moved back by periods) of each body
  /// from the last tractions, nN and nN um.
  std::vector<std::array<Triple, 2>> loads(const std::vector<Triple>& centre);
  /// The same forces from the fluid's momentum balance over the faces around each body.
  std::vector<Triple> balance_forces() { return body_forces(fluid_, bodies_); }
  /// Largest and rms difference between the fluid's velocity carried to the surface and the surface's own, um/us.
  std::array<double, 2> slip();

  /// Smallest grid spacing, over directions and the surfaces' present vertices, um.
  double smallest_spacing_at_surfaces() { return fluid_.grid().comm().min(boundary_->smallest_spacing()); }
  /// How far each body has been moved back by whole periods since the start, um; copies to the host.
  std::vector<Triple> wrapped_by() const;

  /// Counts so far. All ranks call.
  const ImmersedReport& report();
  /// How near to an outflow a cell was at the last classification, um along the grid line.
  double outflow_um() const { return outflow_um_; }
  /// The same with the vertex's name and place, for messages; none without cells or outflow. All ranks call.
  std::optional<NearOutflow> nearest_outflow() const;
  /// How the last tractions came about, by TractionFallback, over all ranks. All ranks call.
  std::vector<long> traction_fits() const;

  /// Where the vertices were when nodes were classified last, three numbers each: with it, a restarted run classifies as
  /// the stopped one had.
  std::vector<double> classified_positions() const;
  /// Classify as a stopped run had. Leaves the surfaces there: their state comes after.
  void resume(const std::vector<double>& positions);
  /// Go on counting from those of a stopped run.
  void resume(const ImmersedReport& counts) { report_ = counts; }
  FluidSolver& fluid() { return fluid_; }
  /// Those that cut the grid.
  const SurfaceSet& surfaces() const { return surfaces_; }
  ImmersedBoundary& boundary() { return *boundary_; }
  const EmbeddedBodies& bodies() const { return bodies_; }

 private:
  int first_unowned_vertex();
  void check_positions(double smallest_gap);
  void check_clearance(int crossed, double between, double smallest_gap);
  std::array<std::string, 4> describe_bodies(int node);
  void check_resolution();

  FluidSolver& fluid_;
  SurfaceSet surfaces_;
  Timers& timers_;
  std::unique_ptr<ImmersedBoundary> boundary_;
  EmbeddedBodies bodies_;
  Table<double> mean_velocity_;  // [body, 3] um/us
  SurfaceStress stress_;
  Components<double> traction_;
  HostCopy<Components<double>> found_host_;
  Components<double> x_classified_;  // [vertex, 3] um, at the last classification
  double outflow_um_ = 1e30;         // of all ranks
  int outflow_vertex_ = -1;          // if it is this rank that sees it
  int unseen_vertex_ = no_vertex;
  ImmersedReport report_;
  bool any_uncovered_ = false;       // on any rank, at the last classification
  long own_velocity_fallbacks_ = 0;  // of this rank, not yet in report_
};

}  // namespace corpuscle
