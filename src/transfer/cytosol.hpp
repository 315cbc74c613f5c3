// The viscosity of a fluid that is another inside cells than outside.
#pragma once

#include <memory>
#include <vector>

#include "grid/grid.hpp"
#include "immersed/surface_views.hpp"
#include "parallel/rank_row.hpp"
#include "transfer/inside.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle {

/// What a surface set does not say of its bodies.
struct BodyKinds {
  Array<int> type;   // [body]
  Table<int> turns;  // [body, 3] periods by which a copy of a body is shifted
};

class Cytosol {
 public:
  /// @param ratio  [type] inner over outer viscosity; one of them at least is not 1
  Cytosol(Grid& grid, const std::vector<double>& ratio);

  /// The viscosity with the surfaces where the transfer has placed their vertices.
  void update(const Transfer& transfer, const SurfaceSet& surfaces, const BodyKinds& kinds);
  /// Over that outside, [cell] with valid halos, 1 on the sides: shared with the fluid.
  const Array<double>& relative_viscosity() const { return viscosity_.relative; }
  /// The mean of its inverse, [cell]: more than the inverse of that where a cell holds two fluids.
  const Array<double>& fluidity() const { return viscosity_.fluidity; }
  /// No value of it is below.
  double least() const { return least_; }
  /// Whether, at the last update, a grid line left a surface more often than it came in (all ranks call): a mesh with
  /// triangles too large for this grid.
  bool broken() const;

 private:
  void join_rows(int d);

  Grid* grid_;
  std::vector<double> ratios_;  // those there are but 1
  double least_ = 1;
  Array<int> material_;  // [type] into ratios_; -1 for 1
  InsideViews inside_;
  Array<double> share_;
  CellAround around_;
  CytosolViews viscosity_;
  std::vector<std::unique_ptr<RankRow>> row_;  // [direction]
  Array<int> ends_, broken_;
  HostCopy<Array<int>> ends_host_, broken_host_;
};

}  // namespace corpuscle
