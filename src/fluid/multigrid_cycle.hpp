// V-cycles of the geometric multigrid for one equation, with a number or a vector in each cell.
#pragma once

#include "fluid/multigrid_hierarchy.hpp"

#include <functional>

namespace corpuscle {

/// Chebyshev steps before and after a coarser level, at least 2, on this part of the spectrum of D^-1 A, which ends at 2.
struct Smoothing {
  int steps;
  double from, to;
};

/// @tparam Field  Array<CycleReal> or Components<CycleReal>
template <class Field>
class MultigridCycle {
 public:
  /// Vectors [cell] of one level, and its operator: the hierarchy's conductances with a diagonal of its own.
  struct Level {
    MultigridLevel views;
    Array<CycleReal> own;  // part of the diagonal that no face conducts
    Field b, x, y;
  };

  MultigridCycle(MultigridHierarchy& hierarchy, const Smoothing& smoothing);

  /// Diagonals of all levels from the finest one's `own`, after the hierarchy's update.
  void update();
  /// x = one cycle for b, on the finest level, with `depth` coarser ones at most; x must be zero beyond physical sides.
  /// b's halo need not be valid, and x's is not afterwards.
  void run(int depth) { descend(0, depth); }

  std::vector<Level>& levels() { return levels_; }
  /// Solves the coarsest level, x for b; smoothing does while there is none.
  std::function<void(Level&)> solve_coarsest;

 private:
  void descend(std::size_t number, int depth);
  void smooth_down(std::size_t number);
  void smooth_up(std::size_t number);

  MultigridHierarchy* hierarchy_;
  Smoothing smoothing_;
  std::vector<Level> levels_;
};

}  // namespace corpuscle
