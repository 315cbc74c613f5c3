// What acts on membranes besides their own forces: contact, walls, and pushes from outside.
#pragma once

#include <map>
#include <optional>

#include "cells/shared_cells.hpp"
#include "contact/contact.hpp"
#include "contact/joined_surfaces.hpp"
#include "contact/wall_contact.hpp"
#include "coupling/immersed_flow.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle {

class CellLoads {
 public:
  /// @param viscosity  mPa s, of the fluid between cells
  /// @param workspace  shared with others that do not use it in the calls below
  /// @param rigid      with the rigid bodies that cells meet, where they are at the start; null for none
  /// @throws InputError  where walls act beyond the blocks beside them
  CellLoads(const Case& scene, SharedCells& cells, const Transfer& transfer, const Grid& grid, double viscosity,
            std::shared_ptr<Workspace> workspace, ImmersedFlow* rigid = nullptr);
  /// Whether a case has any.
  static bool wanted(const Case& scene);

  /// The cells at hand are others from now on. look() must follow, with valid copies.
  void take_up();
  /// Whether they have come back through periodic sides: take_up() must follow.
  bool bodies_turned() const { return joined_ && bodies_move_ && joined_->turned(); }
  /// The rigid bodies have moved.
  void follow_bodies();
  /// Membranes and rigid bodies; null where there are none of these.
  const SurfaceSet* joined() const { return joined_ ? &joined_->set() : nullptr; }
  /// Of contacts on a rigid body, nN and nW.
  std::array<double, 4> load_on_rigid(double dt_us, int body) const { return contact_->load_on_rigid(dt_us, body); }
  /// After Transfer::place().
  /// @throws InputError  if cells cross where they start
  void look_at_start(double dt_us);
  /// After a step's move: who is near whom for the next one of that length. Crossings are told and undone.
  /// @throws ComputationError  if they cannot be
  void look(double time_us, double dt_us);
  /// After a move of cells that were placed before it.
  void note_wall_gap();
  /// After a move: gaps must not close.
  /// @returns whether anything was moved, on any rank
  bool limit_approach(double time_us);
  /// The same for positions that are only looked ahead to.
  void limit_ahead();

  /// The sum of all forces on the fluid, [vertex, 3] nN. After Transfer::place().
  /// @param ahead  the membranes are ahead of where look() saw them
  void gather(double dt_us, bool ahead);
  const Components<double>& force() const { return force_; }
  /// [vertex] um to the nearest other cell; without values where there is no contact.
  Array<double> gaps() const { return contact_ ? contact_->gaps() : Array<double>(); }

  /// Of the pushes, nW, on membranes of the present velocity.
  double power_of_pushes() const;
  /// fJ, on this rank, of the contacts between cells as look() saw them and with walls at present. After Transfer::place(), or
  /// a move since then.
  double contact_energy(double dt_us) const;
  /// um, where the repulsion of steps of that length goes on as its tangent; 0 without contact.
  double knee_um(double dt_us) const { return contact_ ? contact_->law(dt_us).knee : 0; }
  double fastest_relaxation_per_us() const { return contact_ ? contact_->fastest_relaxation_per_us() : 0; }
  std::optional<ContactReport> report() const;
  void resume(const ContactReport& report);

 private:
  void add_walls(double dt_us);
  void refuse_thin_blocks(double range_um) const;
  /// @param reach_um  to which walls are looked for
  WallContacts at_walls(double reach_um) const;

  SharedCells& cells_;
  const Membranes& membranes_;
  const Comm comm_;
  const Transfer& transfer_;
  std::shared_ptr<Workspace> workspace_;
  std::unique_ptr<Contact> contact_;        // only with [contact]
  std::unique_ptr<JoinedSurfaces> joined_;  // and rigid bodies
  bool bodies_move_ = false;                // through periodic sides
  WallSides walls_;
  WallLinks links_;                  // of this block
  Components<double> force_;         // [vertex, 3] nN
  double smallest_wall_gap_ = 1e30;  // um
  std::map<int, Triple> push_;       // nN, by the cell's number; of those that are pushed
  Table<double> share_;              // [own cell, 3] nN; only if any is pushed
};

}  // namespace corpuscle
