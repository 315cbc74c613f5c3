// The levels of the geometric multigrid: which cells are joined, and what conducts between them. The pressure's and the
// velocity's cycles share them.
#pragma once

#include "fluid/multigrid.hpp"
#include "grid/grid.hpp"
#include "parallel/gathering.hpp"

#include <memory>
#include <vector>

namespace corpuscle {

/// Fine levels are cut over ranks as the grid is. Of those with few cells every rank has the whole, and does the same work
/// as all others: that takes less time than the messages that would share it out.
class MultigridHierarchy {
 public:
  struct Level {
    MultigridLevel views;                // without diagonals, which the cycles' equations differ in
    Components<CycleReal> conductances;  // those of the views, side by side
    Comm comm;                           // this rank alone, where it has the whole level
    Halo halo;
    double strength = 0;                             // sum of all ranks' conductances, without bodies
    std::unique_ptr<Gathering> cells{}, faces[3]{};  // where the level is the first of which each rank has the whole; else null
  };
  static constexpr int most_direct = 500;  // cells of a coarsest level that is solved directly

  /// @param coefficient  [cell] of the normal difference, by direction (ViscousCoefficients::normal), valid in one halo
  ///                     layer
  MultigridHierarchy(Grid& grid, const Array<double> (&coefficient)[3]);

  /// Take over which nodes have a pressure; the mask's halo must be valid.
  void update(const PressureMask& mask);
  /// The same with conductances that are larger by a viscosity, which changes.
  void update(const PressureMask& mask, const VaryingViscosity& viscosity);

  std::vector<Level>& levels() { return levels_; }
  const Comm& comm() const { return grid_->comm(); }

 private:
  void build(const Array<double> (&coefficient)[3], int most_gathered);
  bool add_coarser(int most_gathered);
  void add_level(const IndexSpace& index, const Comm& comm, const std::array<int, 3>& ranks);
  void coarsen(std::size_t number);
  void coarsen_all();

  Grid* grid_;
  Array<double> coefficient_[3];
  std::vector<Level> levels_;
};

}  // namespace corpuscle
