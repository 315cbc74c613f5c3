// The levels of the geometric multigrid: which cells are joined, and what conducts between them. The pressure's and the
// velocity's cycles share them.
#pragma once

#include "fluid/multigrid.hpp"
#include "grid/grid.hpp"

namespace corpuscle {

class MultigridHierarchy {
 public:
  struct Level {
    MultigridLevel views;  // without diagonals, which the cycles' equations differ in
    Halo halo;
    double strength;       // sum of all ranks' conductances, without bodies
  };

  /// @param coefficient  [cell] of the normal difference, by direction (ViscousCoefficients::normal), valid in one halo
  ///                     layer
  MultigridHierarchy(Grid& grid, const Array<double> (&coefficient)[3]);

  /// Take over which nodes have a pressure; the mask's halo must be valid.
  void update(const PressureMask& mask);

  std::vector<Level>& levels() { return levels_; }
  const Comm& comm() const { return grid_->comm(); }

 private:
  bool add_coarser();
  void coarsen(std::size_t number);

  Grid* grid_;
  Array<double> coefficient_[3];
  std::vector<Level> levels_;
};

}  // namespace corpuscle
