// V-cycles of the geometric multigrid for one equation, with a number or a vector in each cell.
#pragma once

#include "fluid/multigrid_hierarchy.hpp"
#include "fluid/small_levels.hpp"

#include <functional>

namespace corpuscle {

/// Chebyshev steps before and after a coarser level, 2 to SmallLevels::most_steps, on this part of the spectrum of D^-1 A, which ends at 2.
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
  /// b's halo need not be valid; of x's what comes from this rank itself is afterwards, as far as an operator reaches it.
  void run(int depth);

  std::vector<Level>& levels() { return levels_; }
  /// Those that are done in one go, as the last run() had them.
  const SmallLevels<Field>& small_levels() const { return small_; }
  /// The coarsest level, from now on, instead of smoothing it; together with the other small ones. Shared.
  void solve_directly(const DirectLevel& coarsest);
  /// Solves the coarsest level, x for b, where that is neither smoothed nor solved directly.
  std::function<void(Level&)> solve_coarsest;

 private:
  template <class Body>
  void pass(const char* step, std::size_t number, const Body& body, const Field& result, int layers = 0);
  void find_small_levels();
  void run_small(int depth);
  void descend(std::size_t number, int depth);
  int smooth_down(std::size_t number);
  void smooth_up(std::size_t number);
  int layers_exchanged(std::size_t number) const;

  MultigridHierarchy* hierarchy_;
  Smoothing smoothing_;
  std::vector<Level> levels_;
  std::size_t first_small_ = 0;  // from here on levels are done in one go
  SmallLevels<Field> small_;
  bool direct_ = false;
};

}  // namespace corpuscle
