// The shapes of cells in a flow, and how their membranes have turned: for the history.
#pragma once

#include <string>
#include <vector>

#include "blood/cell_shape.hpp"
#include "membrane/reference.hpp"

namespace corpuscle {

class CellShapes {
 public:
  /// @param frame  for angles; null where the flow has no direction across
  CellShapes(const std::vector<CellReference>& types, const FlowFrame* frame);

  /// Names of the columns, with units.
  const std::vector<std::string>& columns() const { return columns_; }
  /// [cell][column] of the first cells of a set, at their present positions. Copies from the device: for output.
  /// @param type  [cell]
  const std::vector<std::vector<double>>& measure(const SurfaceSet& set, int cells, const Array<int>& type);

 private:
  MaterialViews material_;
  FlowFrame frame_;
  std::vector<std::string> columns_;
  Table<double> table_;  // room for some more cells than there are
  HostCopy<Table<double>> host_;
  std::vector<std::vector<double>> rows_;
};

}  // namespace corpuscle
