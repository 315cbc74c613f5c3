// How bodies and the flow around them advance together: one interface for every way there is.
#pragma once

#include "contact/contact_report.hpp"
#include "coupling/immersed_flow.hpp"
#include "coupling/rigid_bodies.hpp"
#include "coupling/step_schedule.hpp"
#include "membrane/membranes.hpp"

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace corpuscle {

/// Stability of the coupling, estimated before a step.
struct StabilityEstimate {
  double mass_term = 0;              // M / (A dt), pg/um2/us
  double beta = 0;                   // Robin coefficient in use, pg/um2/us
  double viscous = 0, inertial = 0;  // half the largest reactions of the fluid
  double threshold() const { return viscous > inertial ? viscous : inertial; }
  double margin() const { return (mass_term + beta) / threshold(); }
};

struct StepStatistics {
  int coupling_iterations = 0, substeps = 0;
  double coupling_residual = 0;  // change of the interface velocity that one more iteration would make, relative
};

class SharedCells;
struct PackedCells;
struct PackingReport;
struct PackedShare;

/// What membranes that are forces have to do with the energy of a flow.
struct CellEnergy {
  double on_cells = 0;    // power of the fluid on the cells, nW
  double on_sides = 0;    // of the cells on sides that move, past the fluid, nW
  double unresolved = 0;  // friction beside the membranes that the grid does not show, nW
  double contact = 0;     // stored in contacts, fJ
};

class Coupling {
 public:
  virtual ~Coupling() = default;

  /// Search at the bodies' starting positions.
  /// @throws InputError  where they cannot start: outside the grid, too near to a wall or to each other, overlapping
  virtual void check_start() = 0;
  /// Place the bodies for a step from `time_us`, solve the flow, move the membranes. After FluidSolver::begin_step().
  /// @throws ComputationError  when anything breaks down; the message says what, where and why
  virtual StepStatistics advance(double time_us, double dt_us) = 0;

  /// Traction of the fluid on the bodies' vertices at the end of the last step, [vertex, 3] kPa, the same on all ranks;
  /// zero before the first step. Worked out now where the step itself did not need it.
  virtual const Components<double>& tractions_for_output() = 0;
  /// Which bodies the grid resolves coarsely, as check_start() warned of; "" if none.
  virtual std::string coarse() const { return {}; }
  /// For a step of that length; nothing where no membrane with mass is coupled.
  virtual std::optional<StabilityEstimate> stability(double) const { return std::nullopt; }
  /// What there is to say of it where there is no such estimate; "" if nothing.
  virtual std::string stability_text(double) const { return {}; }

  /// Whether a cell is so near to an outflow that the run should end before another step of that length, and which cell
  /// and where, for messages (all ranks call). Nearer, the end of the grid disturbs the flow; beyond it there is none.
  virtual bool at_outflow(double) const { return false; }
  virtual std::string nearest_outflow() const { return ""; }
  /// The limit that at_outflow() asks for, and what sets it.
  virtual std::string outflow_limit(double) const { return ""; }

  /// What the next step depends on beyond the flow and the bodies' positions and velocities, for restarts.
  virtual std::vector<double> state() const { return {}; }
  virtual void set_state(const std::vector<double>&) {}
  /// A checkpoint's state is in place, whose last step ended at `time_us`.
  virtual void resume(double /*time_us*/) {}
  /// Entries for the report's "stability".
  virtual std::map<std::string, double> report(double) const { return {}; }

  /// How far each body has been moved back by whole periods since the start, um, of cells those of membranes(); copies to the host.
  virtual std::vector<Triple> wrapped_by() const = 0;
  /// This rank's share, where no tractions tell, after a step of that length. All ranks call.
  virtual CellEnergy energy_of_cells(double /*dt_us*/) { return {}; }
  /// Of forces on the cells from outside, nW.
  virtual double power_of_pushes() { return 0; }
  /// Of cells that touch a rigid body on it, nN, and its power, nW, after a step of that length. All ranks call.
  virtual std::array<double, 4> contact_load(int /*body*/, double /*dt_us*/) { return {}; }
  /// How contacts went; nothing without [contact].
  virtual std::optional<ContactReport> contact_report() const { return std::nullopt; }
  virtual void resume_contact(const ContactReport&) {}

  /// Of the membranes if these are shared out; else of all bodies.
  virtual const SurfaceSet& surfaces() const = 0;
  /// Null where there are none.
  virtual Membranes* membranes() { return nullptr; }
  /// Where every rank has its own; null where all ranks have all cells.
  virtual SharedCells* shared_cells() { return nullptr; }
  /// Of the case's populations; null without any. And this rank's share of where they were packed, for checkpoints.
  virtual const PackingReport* packing() const { return nullptr; }
  virtual const PackedShare* packed() const { return nullptr; }
  /// A checkpoint's cells are in shared_cells(). Takes the checkpoint's time, us.
  virtual void cells_restored(double /*time_us*/) {}
  /// Of the whole scene.
  virtual int cells() { return membranes() ? membranes()->cells() : 0; }
  virtual long vertices() { return surfaces().vertices; }
  virtual RigidBodies* rigid_bodies() { return nullptr; }
  /// The search and the flow at surfaces that cut the grid, those of membranes that are shared out not among them; null where none does.
  virtual ImmersedFlow* immersed() { return nullptr; }
  /// Of cells on sides, past the fluid, nW: what spreads their forces reaches a side beside them.
  /// Takes a velocity [cell, 3], read on the sides of the block.
  virtual double power_on_sides(const Components<double>&) { return 0; }
};

/// A speed that no cell tells from rest, um/us: shear modulus over viscosity is that with which a deformed cell returns to
/// its shape. Tolerances relative to the speed of a flow at rest would ask for less than round-off.
double negligible_speed(const Case& scene, double viscosity);

/// The coupling that a case with cells or bodies asks for.
/// @param packed  cells of populations where an earlier run had packed them; null: they are packed now
/// @throws InputError  for settings that cannot work, a coupling that cannot be stable among them
std::unique_ptr<Coupling> make_coupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers,
                                        const PackedCells* packed = nullptr);

}  // namespace corpuscle
