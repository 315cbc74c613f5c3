// Cells that are shared out over ranks: each belongs to the rank in whose block it is, and every rank whose block or halo it
// reaches into has a copy, shifted through periodic sides to where that block sees it. So kernels know neither of ranks nor of
// images.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "cells/cell_places.hpp"
#include "cells/copy_messages.hpp"
#include "cells/rank_blocks.hpp"
#include "membrane/membranes.hpp"
#include "parallel/parcels.hpp"

namespace corpuscle {

/// What a rank knows of a cell of its own beside what its vertices carry.
struct CellRecord {
  int type = 0, number = 0;       // of the cell in the whole scene
  int laps[3] = {0, 0, 0};        // periods taken off since the start
  std::int64_t first_vertex = 0;  // in files, which have the cells in the order of their numbers
  std::int64_t first_triangle = 0;
};

class SharedCells {
 public:
  /// Every rank calls, with all cells.
  /// @param layers      cells around a rank's own in which it must know of surfaces
  /// @param contact_um  a rank has copies of cells that are so near to its own; 0: only those that reach into its block
  /// @throws InputError        as Membranes
  /// @throws ComputationError  as begin_step()
  SharedCells(const CellPlaces& places, const Grid& grid, int layers, double contact_um,
              std::shared_ptr<Workspace> workspace = std::make_shared<Workspace>());

  const Comm& comm() const { return comm_; }
  Membranes& membranes() { return *membranes_; }
  const Membranes& membranes() const { return *membranes_; }
  const SurfaceSet& surfaces() const { return membranes_->surfaces(); }
  /// [body, 3] periods along each direction by which a copy is shifted; 0 of own cells.
  const Table<int>& turns() const { return turns_; }
  /// This rank's own, in the order of their numbers, as in membranes().
  const std::vector<CellRecord>& own() const { return own_; }
  /// Of the whole scene.
  int total() const { return total_; }
  std::int64_t total_vertices() const { return total_vertices_; }
  std::int64_t total_triangles() const { return total_triangles_; }
  /// um, by which an own cell has been moved back through periodic sides since the start.
  Triple wrapped_by(const CellRecord& cell) const;

  /// Before a step that may look at positions up to `ahead_us` on: cells that have left the domain come back at its other
  /// end, or go to other ranks, and the copies are those that the step needs. Every rank calls.
  /// @returns whether vertices are others than before
  /// @throws ComputationError  for a cell that reaches over so many periods that it is not known under all its images
  bool begin_step(double ahead_us);
  /// Values of a field [vertex, 3] from the own cells to all copies; positions are shifted.
  void to_copies(const Components<double>& field, bool positions = false);
  /// Values of own cells become the sums over them and all their copies, in an order that depends on places alone.
  void add_copies(const Components<double>& field);

  /// For checkpoints: steps begun so far, on which it depends when cells change their ranks.
  long steps() const { return steps_; }
  /// Go on with these cells, whichever rank they are read by. Every rank calls.
  /// @param carried  [vertex][field of Membranes::carried()][3] of the cells, one after the other
  /// @param owners   [cell] rank, or empty: by their places
  void restore(const std::vector<CellRecord>& cells, const std::vector<double>& carried, const std::vector<int>& owners, long steps);
  /// What restore() takes, of the own cells.
  std::vector<double> carried() const;

  /// Times that cells went to other ranks or came back through sides, and that copies were made anew.
  long moves() const { return moves_; }
  long renewals() const { return renewals_; }
  int copies() const { return surfaces().cells - surfaces().own_cells; }

 private:
  void start(const CellPlaces& places);
  int vertices_of(int type) const { return static_cast<int>(membranes_->types()[type].mesh.vertices.size()); }
  int triangles_of(int type) const { return static_cast<int>(membranes_->types()[type].mesh.triangles.size()); }
  void measure(double ahead_us);
  bool wrap(double share);
  void settle(const std::vector<int>& owners);
  void distribute(const std::vector<int>& owners);
  void set_own(const std::vector<double>& carried);
  void renew_copies();
  void note_turns(const std::vector<CopyMessages::Copy>& received);
  std::vector<SpaceBox> find_reach() const;
  std::string unseen_images(const SpaceBox& around, int cell) const;
  std::vector<int> owners() const;

  Comm comm_;
  RankBlocks blocks_;
  std::vector<std::array<int, 3>> shift_turns_;
  std::vector<Vec3> shifts_;
  PeriodicFrame frame_;
  double skin_, contact_;  // um
  std::unique_ptr<Membranes> membranes_;
  std::vector<CellRecord> own_;
  CopyMessages messages_;
  Table<double> boxes_, before_;  // [cell, BoxColumn::count] now, and when copies were made
  HostMirror<Table<double>> boxes_host_;
  Table<int> turns_;
  int total_ = 0;
  std::int64_t total_vertices_ = 0, total_triangles_ = 0;
  long steps_ = 0, moves_ = 0, renewals_ = 0;
};

}  // namespace corpuscle
