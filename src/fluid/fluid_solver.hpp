// Incompressible Navier-Stokes on one curvilinear block: second-order backward differences in time, viscous terms
// implicit, rotational incremental fractional step.
#pragma once

#include "common/extremes.hpp"
#include "core/timers.hpp"
#include "fluid/boundary_conditions.hpp"
#include "fluid/embedded.hpp"
#include "fluid/fluid_state.hpp"
#include "fluid/momentum.hpp"
#include "fluid/pressure_acceleration.hpp"
#include "fluid/pressure_krylov.hpp"
#include "fluid/pressure_multigrid.hpp"

#include <algorithm>
#include <functional>
#include <optional>

namespace corpuscle {

/// What one step needed and how well it did.
struct FluidStatistics {
  int momentum_iterations = 0, pressure_iterations = 0, solves = 0, projections = 0;
  double divergence = 0;       // largest net flux out of a fluid cell, um3/us
  double reference_speed = 0;  // um/us: the largest prescribed or computed so far, or a scale that the caller raised it to
  double speed = 0;            // um/us: the largest at a node in the last solve
  double flux_correction = 0;  // largest correction of a body's net flux over (reference speed x area of its faces)
};

class FluidSolver {
 public:
  /// @param shape   of the built-in grid, for inlet profiles; null for others
  /// @param timers  where the time of each part is counted; null for nowhere
  FluidSolver(Grid& grid, const FluidSettings& settings, const std::vector<BoundarySettings>& boundaries,
              const GridSettings* shape = nullptr, Timers* timers = nullptr);

  /// Start a step: the present solution becomes history. Steps may differ in length; second order, but for the first.
  void begin_step(double dt_us);
  /// Solve for the velocity and pressure at `time_us`; may be called again within the same step with other surface
  /// velocities: the answer depends on those alone, the previous one is a first guess.
  /// @throws ComputationError  when a linear solver does not converge or the velocity is not finite
  void solve(double time_us, const EmbeddedBodies* bodies);

  /// Node kinds after bodies have moved; the halo layers must be up to date. Without bodies this is never called.
  void set_kinds(const Array<NodeKind>& kind);
  /// Change the pressure that the step starts from at some owned nodes. On all ranks.
  void mend_pressure(const std::function<void(const Array<double>&)>& change);
  /// For set-up and failures: floods the grid, with temporary arrays.
  /// @throws ComputationError  when bodies cut fluid nodes off from where the pressure is given
  void check_connected();

  Grid& grid() { return *grid_; }
  /// Whether some halo nodes of this block are owned elsewhere: by another rank, or at the other end of a periodic direction.
  bool shares_nodes() const {
    const auto& periodic = grid_->index().periodic;
    return grid_->comm().size() > 1 || periodic[0] || periodic[1] || periodic[2];
  }
  BoundaryConditions& boundaries() { return boundaries_; }
  const FluidSettings& settings() const { return settings_; }
  const FluidStatistics& statistics() const { return statistics_; }
  double viscosity() const { return mu_; }
  /// The present step over the one before, 0 for a first step.
  double step_ratio() const { return ratio_; }
  /// Velocity scale of tolerances: never below the largest speed seen.
  void raise_reference_speed(double speed) { statistics_.reference_speed = larger(statistics_.reference_speed, speed); }
  /// Imposed mean pressure gradient, kPa/um.
  const Vec3& imposed_gradient() const { return imposed_gradient_; }

  /// Velocity [cell, 3] um/us and pressure [cell] kPa with valid halos; node kinds.
  const Components<double>& velocity() const { return u_; }
  const Array<double>& pressure() const { return p_; }
  const Array<NodeKind>& kind() const { return kind_; }
  const Array<double> (&flux() const)[3] { return flux_; }
  /// Where the pressure has a value, and the coefficients of viscous face fluxes: with cross ones if skewed().
  const PressureMask& pressure_mask() const { return mask_; }
  const ViscousCoefficients& coefficients() const { return g_; }
  bool skewed() const { return skewed_; }

  /// A viscosity that varies in space: `relative` [cell] is its ratio to viscosity(), with valid halos and, at boundary nodes,
  /// the boundary's. Shared: what is written into it counts from the next solve. Without this call there is one viscosity.
  /// @param least     not above any value that it will have, nor above 1
  /// @param fluidity  [cell] where cells hold two fluids, the mean of the inverse of what `relative` is the mean of; shared
  void set_viscosity(const Array<double>& relative, double least = 1, const Array<double>& fluidity = {});
  /// Without values where there is one viscosity.
  const Array<double>& relative_viscosity() const { return relative_viscosity_; }
  /// Calls `use` with the viscosity if it varies.
  template <class Use>
  void visit_varying_viscosity(const Use& use) const {
    const GridViews& grid = grid_->views();
    if (relative_viscosity_.data())
      use(VaryingViscosity{relative_viscosity_,
                           least_viscosity_,
                           has_bodies_,
                           fluidity_,
                           smooth_viscosity_,
                           grid.x,
                           {grid.face_area[0], grid.face_area[1], grid.face_area[2]},
                           excess_marks_,
                           {excess_[0], excess_[1], excess_[2]},
                           excess_force_});
  }

  /// Force density [cell, 3], kPa/um, added to the momentum equation, and a hook that is called with the time of every
  /// solve, to set it and the given boundary velocities. For manufactured solutions and user forces.
  void set_body_force(const Components<double>& force, std::function<void(double)> update);

  /// A force on faces, in every solve from now on: what is written into the shared arrays counts. Without this call, or with
  /// nothing, there is none and nothing is spent on it.
  void set_face_force(const std::optional<FaceForce>& force) { face_force_ = force; }

  /// Residual of the momentum equation that the last projection left, over the velocity (both 2-norms): the splitting.
  /// Right after solve() only.
  double splitting();

  /// Owned cells of the multigrid's levels, finest first.
  std::vector<int> multigrid_cells() const;
  /// How many of them the velocity's cycle uses with the present step.
  int velocity_levels() const { return std::min(momentum_->depth + 1, static_cast<int>(hierarchy_->levels().size())); }

  /// Views share the solver's memory; the time is left for the caller to fill in.
  FluidState state() const;
  /// Continue from a state: fields of owned cells are taken, halos are refilled.
  void restore(const FluidState& state);

 private:
  void make_momentum(MultigridHierarchy& hierarchy);
  void update_pressure_equation();
  void update_diagonal();
  void fill_halos(const Components<double>& u);
  void assemble_history(double time_us);
  double momentum_residual();
  double residual_target(double size);
  void solve_momentum(const EmbeddedBodies* bodies, double residual);
  void project(const EmbeddedBodies* bodies);
  void solve_and_project(const EmbeddedBodies* bodies, double residual);
  void repeat_projection(const EmbeddedBodies* bodies);
  long cut_off_nodes();
  [[noreturn]] void fail_projection(double before, double target, bool attempted);
  void apply_potential();
  KrylovResult solve_pressure(double target);
  void make_flux(const EmbeddedBodies* bodies);
  double give_bodies_their_flux(const EmbeddedBodies& bodies);
  void note_correction(double speed);
  class Correction;
  template <class Use>
  void with_viscosity(const Use& use) const {
    if (!relative_viscosity_.data()) return use(UniformViscosity());
    visit_varying_viscosity(use);
  }
  template <class Use>
  void with_face_force(const Use& use) const {
    if (face_force_) return use(*face_force_);
    use(NoFaceForce());
  }
  template <class Use>
  void with_operator(const Use& use) const;
  template <class Viscosity, class Use>
  void with_operator(const Viscosity& viscosity, const Use& use) const;
  std::array<double, 2> two_sums();
  std::array<double, 2> residual_squares();
  void update_momentum_cycle();
  int momentum_depth() const;
  template <class Velocity>
  void exchange_immersed(const Velocity& u);
  void complete_velocity(const EmbeddedBodies* bodies);

  Grid* grid_;
  Timers own_timers_;
  Timers* timers_;
  FluidSettings settings_;
  BoundaryConditions boundaries_;
  double mu_ = 0, mass_ = 0, mass1_ = 0, mass2_ = 0;
  double last_step_ = 0, ratio_ = 0;  // us; the present step over the one before, 0 for a first step
  Vec3 imposed_gradient_;
  bool skewed_ = false;
  int history_levels_ = 0;
  int pinned_ = -1;

  Components<double> u_, u_old_, u_older_, work_, history_, grad_p_;  // grad_p_: less the force on faces
  Array<double> p_, p_old_, psi_field_, diagonal_;
  Array<double> flux_[3], flux_old_[3], flux_extrapolated_[3];
  Array<NodeKind> kind_;
  PressureMask mask_;
  Array<double> relative_viscosity_;   // empty: one viscosity
  Array<double> fluidity_;             // empty: no cell holds two fluids
  Array<double> smooth_viscosity_;     // where some do
  Array<unsigned char> excess_marks_;  // [cell] of a viscosity that varies, and only then, as the next two
  Components<double> excess_[3];       // [cell, 3] on faces, um2/us times the viscosity
  Components<double> excess_force_;    // [cell, 3]
  double least_viscosity_ = 1;
  bool has_bodies_ = true;  // until a solve knows
  ViscousCoefficients g_;
  double residual_norm_ = 0, velocity_norm_ = 0;        // um/us, 2-norms over all nodes, at the last momentum_residual()
  std::unique_ptr<PressureAcceleration> acceleration_;  // once a step has needed it
  Array<double> negative_divergence_, psi_;             // compact scalars (psi_ on skewed grids only)
  Table<double> body_sums_;
  HostCopy<Table<double>> body_sums_host_;
  HostCopy<Array<double>> growth_host_;
  std::unique_ptr<MultigridHierarchy> hierarchy_, viscous_hierarchy_;  // the velocity's own, if its viscosity varies
  /// What the momentum equation's corrections need, [cell, 3] in single precision: implicit convection, cross terms and
  /// immersed rows make the operator unsymmetric, so BiCGStab, preconditioned by a multigrid cycle.
  struct Momentum {
    Momentum(MultigridHierarchy& hierarchy, int nodes) : cycle(hierarchy, {2, 0.5, 2.0}) {  // as good as three steps from 0.2, and cheaper
      for (auto* field : {&r, &shadow, &p, &v, &t}) *field = Components<float>("corpuscle::fluid::krylov", nodes, 3);
    }
    MultigridCycle<Components<CycleReal>> cycle;
    int depth = 0;      // coarser levels in use
    double mass = -1;   // of the present step
    bool stale = true;  // the cycle is of another step's mass or other node kinds
    Components<float> r, shadow, p, v, t;
    Kokkos::View<Sums<2>, Memory> two{"corpuscle::fluid::sums"};
    HostCopy<Kokkos::View<Sums<2>, Memory>> two_host{two};
  };
  std::unique_ptr<Momentum> momentum_;
  std::unique_ptr<PressureCycle> pressure_cycle_;  // preconditioner of both
  std::unique_ptr<PressureMultigrid> multigrid_;   // orthogonal grids
  std::unique_ptr<HypreSystem> pressure_system_;   // skewed ones
  std::unique_ptr<PressureKrylov> pressure_krylov_;
  Components<double> body_force_;
  std::function<void(double)> update_force_;
  std::optional<FaceForce> face_force_;
  FluidStatistics statistics_;
};

}  // namespace corpuscle
