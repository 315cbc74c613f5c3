// All cells' membranes: forces, motion, diagnostics, state.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/workspace.hpp"
#include "immersed/surface.hpp"
#include "membrane/elasticity.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane/membrane_views.hpp"
#include "membrane/mobility.hpp"
#include "membrane/motion.hpp"
#include "membrane/reference.hpp"

namespace corpuscle {

/// What the history reports of one cell.
struct CellDiagnostics {
  Triple centroid_um{};           // of the enclosed volume
  Triple velocity_um_per_us{};    // mean over the vertices, which carry equal masses
  Triple lower_um{}, upper_um{};  // extremes along x, y, z
  double area_um2 = 0, volume_um3 = 0;
  double rest_area_um2 = 0, rest_volume_um3 = 0;                                                // A0, V0
  double springs_fJ = 0, bending_fJ = 0, global_area_fJ = 0, local_area_fJ = 0, volume_fJ = 0;  // springs or another law
  double stretch = 0;  // largest strain of any triangle: of springs, length over contour length of a link, which breaks
                       // at 1; of a sheet, the larger principal stretch

  double energy_fJ() const { return springs_fJ + bending_fJ + global_area_fJ + local_area_fJ + volume_fJ; }
  Triple extent_um() const { return {upper_um[0] - lower_um[0], upper_um[1] - lower_um[1], upper_um[2] - lower_um[2]}; }
};

/// One cell of those that a rank holds.
struct HeldCell {
  int type = 0;
  int number = 0;  // of the cell in the whole scene
};

/// The types among cells, in the order in which they appear, and the type of each cell.
struct CellTypes {
  std::vector<CellReference> references;
  std::vector<int> of_cell;
};
/// @throws InputError  for settings out of range or meshes that are not closed
CellTypes find_cell_types(const std::vector<CellSettings>& cells);

class MembraneViscosity;

/// Makes the elasticity of a rank's cells, of the types and the type of each; see ElasticityOf for one of a law of one's own.
using ElasticityMaker =
    std::function<std::unique_ptr<Elasticity>(const std::vector<CellReference>& types, const std::vector<int>& type_of_cell)>;

class Membranes {
 public:
  /// Build the cells' meshes and references, and one surface set that holds the cells first and then `rigid_bodies`.
  /// @throws InputError  for settings out of range or meshes that are not closed
  explicit Membranes(const std::vector<CellSettings>& cells, const std::vector<TriangleMesh>& rigid_bodies = {});
  /// None yet: hold() says which. @param workspace  shared with others that do not use it in the calls below
  Membranes(const std::vector<CellReference>& types, std::shared_ptr<Workspace> workspace);
  ~Membranes();
  Membranes(const Membranes&) = delete;
  Membranes& operator=(const Membranes&) = delete;

  /// Hold these cells, of which the first `own` are this rank's: only those have forces and move here, the others are surfaces.
  /// Allocates where there is no room, with some to spare. Arrays of what vertices carry keep their content, row by row; what
  /// does not belong there any more is for the caller to replace.
  void hold(const std::vector<HeldCell>& cells, int own);
  /// Rest states as if all cells were `size` times as large as their types are.
  void rest_at_size(double size);
  /// What belongs to the own cells' vertices from one step to the next, and travels with them: [vertex, 3] each.
  std::vector<Components<double>> carried() const;
  const std::vector<CellReference>& types() const { return types_; }
  /// One body for each type, as it is made or read; only with hold().
  const SurfaceSet& templates() const { return templates_; }

  /// The surfaces as the fluid sees them; x and v are the membranes' own arrays. Normals and areas are refreshed by
  /// update_surface_geometry, not here.
  SurfaceSet& surfaces() { return views_.surface; }
  const SurfaceSet& surfaces() const { return views_.surface; }
  const MembraneViews& views() const { return views_; }
  const Elasticity& elasticity() const { return *elasticity_; }
  /// From now on the cells' in-plane law is what `make` makes of it, in place of those that a case can name. Called at once, and
  /// whenever cells come or go. What was estimated of stiffness before is forgotten; what set-up took from it, such as the longest stable
  /// step of membranes that are forces, is of the case's own law. Before set_state().
  void take_law(ElasticityMaker make);
  /// In the plane of a cell's membrane.
  const MembraneLaw& law(int cell) const { return law_[cell]; }
  /// Of a cell in the whole scene.
  int number(int cell) const { return number_[cell]; }
  /// As the case file addresses it.
  std::string name(int cell) const { return name_of(number_[cell]); }
  /// Of the cell with that number, on whatever rank it is.
  std::string name_of(int number) const { return names_.of(number); }
  void call(const CellNames& names);
  /// Whether anything but its in-plane law answers a change of a cell's area.
  bool holds_area(int cell) const { return holds_area_[cell]; }
  /// Of all types of cells.
  bool any_holds_area() const;
  int cells() const { return views_.cells; }
  int vertices() const { return views_.vertices; }

  /// 0.3 times the largest stable undamped step at the present shape, over all cells, us. Costs about 240 kernels.
  double stable_step_us();

  /// Largest eigenvalue of any cell's Hessian at the present shape, nN/um. Costs as much.
  double largest_stiffness_nN_per_um();

  /// Internal forces at the present positions into views().force [vertex, 3] nN.
  /// @throws ComputationError  if a triangle is strained beyond the limit of its law
  void compute_forces();
  /// Of membranes that move with a fluid, once `force` holds all that acts on the fluid but membrane viscosity (views().force, or
  /// that and what else acts), [vertex, 3] nN: take what that resists, as the fluid will move them, off `force` and views().force.
  /// Uses the workspace. surfaces().v is the fluid's answer to the force of the last step, and becomes an estimate of that to this one.
  /// @param beta   mPa s/um: how the force changes with the velocity, per area, as the fluid answers to the largest and slowest
  ///               deformations; twice that is too much
  /// @param ahead  how much of what changed in the last step is carried on to this one: a share of the step over the last one; 0 to
  ///               take what the last one left
  void resist(double beta, double ahead, const Components<double>& force);
  /// The next resist() takes what the fluid did in the last step, whatever it is told: cells had no viscosity in that before.
  void resist_anew() { resists_anew_ = true; }
  /// Of membrane viscosity, in what resist() takes for the fluid's answer to short waves: see largest_resistance(). None at first.
  void take_share_of_resistance(double share);
  /// The workspace no longer holds the triangles' geometry: where it is wanted after all, it is measured again.
  void forget_geometry();

  /// Membranes break when their area has grown by 2 to 4 % (Evans, Waugh and Melnik, Biophys. J. 16, 1976): beyond the first
  /// a run warns at its end, beyond the second it is stopped.
  static constexpr double lysis_area = 0.04, senseless_area = 0.1;
  /// From now on a cell whose area should be held and changes by more than `share` stops a step as an overstretched one does.
  void limit_area(double share) { views_.most_area = share; }
  static constexpr double senseless_volume = 0.05;
  /// The same of a cell whose volume is off V0 by more than `share`, and by more than shapes are that start away from it.
  void limit_volume(double share);

  /// [vertex] how many times as fast as at rest the membrane answers tangential forces per area there, about and at most.
  /// After compute_forces().
  void measure_stiffening(const Array<double>& stiffening);

  /// Sub-steps that advance() takes for a step of `dt_us`, from the stiffness last estimated.
  int substeps(double dt_us, double beta) const;

  /// The implicit membrane viscosity, or null if no cell has any.
  const MembraneViscosity* viscosity() const { return viscosity_.get(); }

  /// Advance all cells by `dt_us` with symplectic Euler in equal sub-steps dt_s, each of which solves
  ///   (M/dt_s + beta A + D) v = M v/dt_s + F(x) + F_fluid(x) + beta A v_star,
  /// projects v so that the volume stays V0, and moves x += dt_s v. D, the membrane viscosity, is implicit.
  /// The sub-step is that of a vertex whose mass and drag see a stiffness 1/0.09 times the largest estimated: without
  /// beta this is 0.3 x 2/omega_max, and where beta dominates 0.18 beta A/k, which resolves the fastest relaxation.
  /// The stiffness is estimated anew every 100th call. A step that overstretches a triangle is tried again from the start
  /// with 2, 4, 8 and 16 times as many sub-steps.
  /// The level of the pressure has no effect.
  /// @param stress    of the fluid at the vertices, or without values
  /// @param beta      pg/um2/us, 0 for none
  /// @param v_star    [vertex, 3] um/us, read only if beta > 0
  /// @return the number of sub-steps taken
  /// @throws ComputationError  naming the cell, the quantity, the likely cause and the setting to change; positions and
  ///         velocities are then those from before the call
  int advance(double dt_us, const SurfaceStress& stress = {}, double beta = 0, const Components<double>& v_star = {});

  /// Begin a step of membranes that move with the fluid: put them where their last velocities bring them in `ahead_us`, the whole
  /// step or nothing.
  void set_out(double ahead_us);
  /// End it: move all cells by `dt_us`, from where they were, with the velocities that surfaces().v holds, of the fluid around, once
  /// these are projected so that they change no volume; where the step set out ahead, with the mean of them and the last ones.
  /// Volumes are V0 then. After compute_forces() at the present positions.
  /// @throws ComputationError  if a position is not finite
  void drift(double dt_us);
  /// The largest share of its volume that a cell has lost or gained since drift(), to what has moved vertices besides, and the way back,
  /// all over its surface.
  double volume_taken();
  void give_volume_back();

  /// Those of this rank's own cells that are in `numbers`, at the present shape and size, by themselves: what is asked of a few takes no
  /// longer the more there are beside them. Only with hold(). The normals and areas of their surfaces are not yet known.
  std::unique_ptr<Membranes> only(const std::vector<int>& numbers) const;
  /// Of `values` [vertex, 3] the rows of those cells, one after the other.
  Components<double> rows_of(const std::vector<int>& numbers, const Components<double>& values) const;

  /// Fastest rate at which a membrane that moves with the fluid relaxes at the present shape, over those cells, 1/us; 0 without any.
  /// Normals and areas of the surfaces must be current. Takes as many operations as a cell has pairs of vertices.
  /// @param numbers  of the cells that stand for their types; those that other ranks have are passed over
  /// @param beta     of resist(), for membranes whose viscosity slows them down, but for hold() not at all; before the first step
  double fastest_relaxation_per_us(const MobilityModel& model, const std::vector<int>& numbers, double beta = 0);

  /// Fastest rate at which a membrane relaxes against its own viscosity and what resist() takes for the fluid's resistance, times the
  /// square of the former's share in what resists, 1/us; 0 without viscosity. As above.
  double fastest_held_relaxation_per_us(const std::vector<int>& numbers, double beta);

  /// Largest ratio of membrane viscosity to what the fluid answers to a wave along a membrane; 0 without cells or viscosity. As above.
  double largest_resistance(const MobilityModel& model, const std::vector<int>& numbers);

  /// Remember the present state on the device, or return to it. The copy is allocated at the first save.
  void save_state();
  void restore_state();

  /// One entry for each of this rank's cells. Copies from the device: for output, not for every sub-step.
  std::vector<CellDiagnostics> diagnostics();

  /// Estimate the stiffness anew at the next advance(): the cells' constants are not those of the state.
  void forget_stiffness() { stiffness_.clear(); }

  /// Kinetic energy of all cells' membranes, fJ, and the power that membrane viscosity takes from them, nW.
  double kinetic_energy_fJ() const;
  double dissipation_nW() const;

  /// Everything that a restart needs for the same bits as without the stop.
  std::vector<double> state() const;
  /// @throws InputError  if the length does not fit these cells
  void set_state(const std::vector<double>& state);

 private:
  struct Snapshot {
    Components<double> x, v;  // [vertex, 3] of the cells
    std::vector<double> stiffness;
    long calls = 0;
  };

  void make_viscosity();
  void describe_cells(const std::vector<HeldCell>& cells, int own);
  void make_room(const SurfaceSet& needed);
  void take_workspace();
  void take_geometry();
  void estimate_stiffness();
  void take_substeps(int count, double dt, const SurfaceStress& stress, double beta, const Components<double>& v_star);
  template <class Load>
  void take_substeps(int count, double dt, const Load& load);
  int trouble();
  std::vector<int> cells_of(const std::vector<int>& numbers) const;
  template <class Answer, class Response>
  double largest_response(const std::vector<int>& cells, const Answer& answer, const Response& respond);
  void elastic_answer(const MembraneViews& m, const StiffnessViews& work);
  double fastest_relaxation(const MobilityModel& model, const std::vector<int>& cells, double beta);
  [[noreturn]] void explain(int cell, double dt);
  [[noreturn]] void explain_area(int cell, double drift) const;
  [[noreturn]] void explain_volume(int cell, double drift) const;

  MembraneViews views_;
  ElasticityMaker make_law_ = make_elasticity;
  std::vector<int> type_of_own_;
  std::unique_ptr<Elasticity> elasticity_;
  MotionViews motion_;
  HostCopy<Array<int>> status_host_;
  std::vector<CellReference> types_;
  SurfaceSet templates_;                  // one body for each type; only with hold()
  std::shared_ptr<Workspace> workspace_;  // of corner forces and directions; only with hold()
  std::vector<CellPart> parts_;           // for what takes memory for one part at a time; only with hold()
  std::vector<int> number_;               // [cell] in the whole scene
  CellNames names_;
  std::vector<bool> holds_area_;                 // [cell]
  Components<double> start_x_, start_v_;         // [vertex, 3] at the start of a call to advance
  std::vector<MembraneLaw> law_;                 // [cell]
  std::vector<double> vertex_mass_;              // [cell] pg
  std::vector<double> vertex_area_;              // [cell] smallest at rest, um2
  std::vector<double> stiffness_;                // [cell] largest eigenvalue, nN/um; empty before the first estimate
  std::vector<double> rest_area_, rest_volume_;  // [cell]
  long calls_ = 0;                               // of advance
  double size_ = 1;                              // of the cells at rest: see rest_at_size()
  double share_ahead_ = 0;                       // of the last velocities, in the present step's move
  bool resists_anew_ = false;
  bool drifts_ = false;  // set_out() and drift() move the membranes, not advance()
  std::unique_ptr<Snapshot> saved_;
  std::unique_ptr<MembraneViscosity> viscosity_;  // only if a cell has any
};

}  // namespace corpuscle
