// The kernels of the in-plane laws, behind an interface that does not know which.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "membrane/diagnostics.hpp"
#include "membrane/forces.hpp"

namespace corpuscle {

/// What depends on the laws of a scene's cells. Made once; a call is one launch for each law that the scene has.
class Elasticity {
 public:
  virtual ~Elasticity() = default;
  /// Forces of each triangle on its corners, into m.corner_force; measure_membranes must have run at the same x. Marks in
  /// m.status the cells that are strained beyond the limit.
  virtual void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const = 0;

  /// @param table  [cells, CellColumn::count]
  void measure_cells(const MembraneViews& m, const Table<double>& table) const {
    measure_membranes(m, m.surface.x);
    fill_rows(m, table);
  }

  /// Internal forces at positions x, into force [vertex, 3] nN.
  void membrane_forces(const MembraneViews& m, const Components<double>& x, const Components<double>& force) const {
    measure_membranes(m, x);
    evaluate_triangles(m, x);
    gather_forces(m, force);
  }

  virtual void fill_rows(const MembraneViews& m, const Table<double>& table) const = 0;

  /// [vertex] how many times as fast as at rest the membrane answers tangential forces per area there, about and at most.
  /// After membrane_forces().
  virtual void measure_stiffening(const MembraneViews& m, const Array<double>& stiffening) const = 0;
};

/// One law for the cells that have it.
template <class Law, class Cells>
class ElasticityOf final : public Elasticity {
 public:
  /// @param laws  [type], those of the cells
  ElasticityOf(const Array<Law>& laws, const Cells& cells) : laws_(laws), cells_(cells) {}

  void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const override {
    corpuscle::evaluate_triangles(m, laws_, cells_, x);
  }
  void fill_rows(const MembraneViews& m, const Table<double>& table) const override {
    corpuscle::measure_cells(m, laws_, cells_, table);
  }
  void measure_stiffening(const MembraneViews& m, const Array<double>& stiffening) const override {
    corpuscle::measure_stiffening(m, laws_, cells_, stiffening);
  }

 private:
  Array<Law> laws_;
  Cells cells_;
};

/// Cells of several laws: each law's in turn.
class MixedElasticity final : public Elasticity {
 public:
  explicit MixedElasticity(std::vector<std::unique_ptr<Elasticity>> parts) : parts_(std::move(parts)) {}

  void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const override {
    for (const auto& part : parts_) part->evaluate_triangles(m, x);
  }
  void fill_rows(const MembraneViews& m, const Table<double>& table) const override {
    for (const auto& part : parts_) part->fill_rows(m, table);
  }
  void measure_stiffening(const MembraneViews& m, const Array<double>& stiffening) const override {
    for (const auto& part : parts_) part->measure_stiffening(m, stiffening);
  }

 private:
  std::vector<std::unique_ptr<Elasticity>> parts_;
};

}  // namespace corpuscle
