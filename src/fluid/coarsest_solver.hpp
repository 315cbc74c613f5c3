// The coarsest level of the pressure's multigrid cycle.
#pragma once

#include "fluid/algebraic_multigrid.hpp"
#include "fluid/multigrid_hierarchy.hpp"
#include "fluid/small_levels.hpp"

#include <memory>

namespace corpuscle {

class CoarsestSolver {
 public:
  virtual ~CoarsestSolver() = default;
  /// Take over the level's operator. @throws ComputationError  on all ranks, when that fails on any
  virtual void update(const MultigridLevel& level) = 0;
  /// What solves it together with the other small levels, with the same arrays ever after; null where solve() does.
  virtual const DirectLevel* direct() const { return nullptr; }
  /// x close to the solution for b, [cell] of the level: a symmetric operator.
  virtual void solve(const MultigridLevel&, const Array<CycleReal>&, const Array<CycleReal>&) {}
  /// On all ranks together. @throws ComputationError  on all of them, if solve() has failed on any since the last update()
  virtual void raise() {}
};

/// Direct, for a level of which each rank has the whole: it costs less than setting BoomerAMG up, which has to be done whenever
/// bodies move, and a cycle of it.
class BandCoarsest : public CoarsestSolver {
 public:
  explicit BandCoarsest(MultigridHierarchy& hierarchy);
  void update(const MultigridLevel& level) override;
  const DirectLevel* direct() const override { return &direct_; }

 protected:
  DirectLevel direct_;
};

/// The same, by the inverse: for devices, where one sweep after the other through a band, row by row, waits for memory all the
/// time, but as many sweeps as there are rows take no longer than one.
class InverseCoarsest : public BandCoarsest {
 public:
  explicit InverseCoarsest(MultigridHierarchy& hierarchy);
  void update(const MultigridLevel& level) override;
};

/// One cycle of BoomerAMG, for levels of many cells.
class AmgCoarsest : public CoarsestSolver {
 public:
  explicit AmgCoarsest(MultigridHierarchy& hierarchy);
  void update(const MultigridLevel& level) override;
  void solve(const MultigridLevel& level, const Array<CycleReal>& b, const Array<CycleReal>& x) override;
  void raise() override { system_.errors().raise(system_.comm()); }

 private:
  HypreSystem system_;
  AlgebraicMultigrid amg_;
  Array<double> rhs_, x_;
};

std::unique_ptr<CoarsestSolver> make_coarsest_solver(MultigridHierarchy& hierarchy);

}  // namespace corpuscle
