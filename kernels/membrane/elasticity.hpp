// The kernels of the in-plane laws, behind an interface that does not know which.
#pragma once

#include <algorithm>
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
  /// Forces of each triangle of a part on its corners, into m.corner_force; measure_membranes must have run at the same x. Marks in
  /// m.status the cells that are strained beyond the limit.
  virtual void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const = 0;

  /// @param table  [cells, CellColumn::count]
  void measure_cells(const MembraneViews& m, const Table<double>& table) const {
    measure_membranes(m, m.surface.x);
    fill_rows(m, table);
  }

  /// Internal forces at positions x, into force [vertex, 3] nN.
  /// @param parts  into which the cells are cut, for m.corner_force; none: all at once
  void membrane_forces(const MembraneViews& m, const Components<double>& x, const Components<double>& force,
                       const std::vector<CellPart>& parts = {}) const {
    measure_membranes(m, x);
    for_parts(m, parts, [&](const MembraneViews& part) {
      evaluate_triangles(part, x);
      gather_forces(part, force);
    });
  }

  virtual void fill_rows(const MembraneViews& m, const Table<double>& table) const = 0;

  /// [vertex] how many times as fast as at rest the membrane answers tangential forces per area there, about and at most.
  /// After membrane_forces().
  virtual void measure_stiffening(const MembraneViews& m, const Array<double>& stiffening) const = 0;
};

/// Those of a part [first, last). @param listed  their numbers, rising, of ListedCells
inline AllCells cells_within(const AllCells&, const std::vector<int>&, int first, int last) { return {last - first, first}; }
inline ListedCells cells_within(const ListedCells& all, const std::vector<int>& listed, int first, int last) {
  const auto from = std::lower_bound(listed.begin(), listed.end(), first), to = std::lower_bound(from, listed.end(), last);
  return {all.cells, static_cast<int>(to - from), static_cast<int>(from - listed.begin())};
}

/// One law for the cells that have it.
template <class Law, class Cells>
class ElasticityOf final : public Elasticity {
 public:
  /// @param laws    [type], those of the cells
  /// @param listed  the same as `cells`, where it is a list
  ElasticityOf(const Array<Law>& laws, const Cells& cells, std::vector<int> listed = {})
      : laws_(laws), cells_(cells), listed_(std::move(listed)) {}

  void evaluate_triangles(const MembraneViews& m, const Components<double>& x) const override {
    corpuscle::evaluate_triangles(m, laws_, cells_within(cells_, listed_, m.first_cell, m.first_cell + m.cells), x);
  }
  void fill_rows(const MembraneViews& m, const Table<double>& table) const override { corpuscle::measure_cells(m, laws_, cells_, table); }
  void measure_stiffening(const MembraneViews& m, const Array<double>& stiffening) const override {
    corpuscle::measure_stiffening(m, laws_, cells_, stiffening);
  }

 private:
  Array<Law> laws_;
  Cells cells_;
  std::vector<int> listed_;
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
