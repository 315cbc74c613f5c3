// The kernels of one in-plane law, behind an interface that does not know which.
#pragma once

#include "membrane/diagnostics.hpp"
#include "membrane/forces.hpp"

namespace corpuscle {

/// What depends on the law of a scene's cells. Made once; a call is one or two launches.
class Elasticity {
 public:
  virtual ~Elasticity() = default;
  /// Forces of each triangle on its corners, into m.corner_force; measure_membranes must have run at the same x. Marks in
  /// m.status the cells that are strained beyond the limit.
  virtual void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const = 0;
  /// @param table  [cells, CellColumn::count]
  virtual void measure_cells(const MembraneViews& m, const Table<double>& table) const = 0;
  /// Of the strain at which a step is refused.
  virtual double limit() const = 0;

  /// Internal forces at positions x, into force [vertex, 3] nN.
  void membrane_forces(const MembraneViews& m, const Components<double>& x, const Components<double>& force) const {
    measure_membranes(m, x);
    evaluate_triangles(m, x);
    gather_forces(m, force);
  }
};

template <class Law>
class ElasticityOf final : public Elasticity {
 public:
  /// @param laws  [type]
  explicit ElasticityOf(const Array<Law>& laws) : laws_(laws) {}

  void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const override {
    corpuscle::evaluate_triangles(m, laws_, x);
  }
  void measure_cells(const MembraneViews& m, const Table<double>& table) const override {
    corpuscle::measure_cells(m, laws_, table);
  }
  double limit() const override { return Law::limit; }

 private:
  Array<Law> laws_;
};

}  // namespace corpuscle
