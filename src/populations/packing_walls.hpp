// The sides of a grid that cells must keep clear of: all but periodic ones, as triangles with a normal into the fluid.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "grid/generators.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

class PackingWalls {
 public:
  /// @param source  of the whole grid, so that every rank has the same
  /// @param reach   um, of the distances that are wanted
  PackingWalls(const GridSettings& grid, const NodeSource& source, const PeriodicFrame& frame, double reach);

  bool none() const { return triangles_.empty(); }
  /// um from the nearest side, negative beyond it, and its gradient. @returns false farther away than the reach
  bool distance(const Vec3& p, double& value, Vec3& gradient) const;
  /// Whether a side may be within `radius` of a point.
  bool near(const Vec3& p, double radius) const;
  std::size_t triangles() const { return triangles_.size(); }

 private:
  struct Triangle {
    Vec3 a, b, c, normal;
  };
  using Key = std::int64_t;
  void add_side(const NodeSource& source, int d, int end, double patch);
  void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& inward);
  void sort();
  int along(double x) const;
  Vec3 home(const Vec3& p) const;
  static Key key(int i, int j, int k) { return (Key(i + (1 << 20)) << 42) | (Key(j + (1 << 20)) << 21) | Key(k + (1 << 20)); }

  PeriodicFrame frame_;
  double reach_, width_;
  std::vector<Triangle> triangles_;
  std::unordered_map<Key, std::vector<int>> bins_;  // triangles within the reach of any point of a cube
};

}  // namespace corpuscle
