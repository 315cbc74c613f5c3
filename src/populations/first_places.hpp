// Where chance puts bodies before they are packed.
#pragma once

#include <random>
#include <unordered_map>

#include "grid/generators.hpp"
#include "populations/rigid_packing.hpp"

namespace corpuscle {

/// The same numbers everywhere: what the standard library makes of its engines is not fixed.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  /// In [0, 1).
  double share() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double normal();
  /// Every direction is as likely.
  Rotation rotation();

 private:
  std::mt19937_64 engine_;
};

/// Points of a grid, every volume of it as likely.
class PointsOfGrid {
 public:
  explicit PointsOfGrid(const NodeSource& source);
  Vec3 next(Chance& chance) const;

 private:
  struct Place {
    Vec3 at;
    double stretch;  // volume over that in index space
  };
  Place place(double u, double v, double w) const;

  const NodeSource& source_;
  double largest_ = 0;
};

/// Balls that have places already, under all shifts by periods.
class Neighbourhood {
 public:
  /// @param reach  um, at least the sum of the radii of any two balls
  Neighbourhood(const std::vector<Vec3>& shifts, double reach) : shifts_(shifts), width_(reach) {}
  void add(const Vec3& center, double radius);
  bool meets(const Vec3& center, double radius) const;

 private:
  struct Ball {
    Vec3 center;
    double radius;
  };
  std::vector<Vec3> shifts_;
  double width_;
  std::unordered_map<std::int64_t, std::vector<Ball>> bins_;
};

/// Turned as CellPlace says, and back.
Rotation rotation_of(const Triple& axis, double spin_deg);
void set_direction(const Rotation& rotation, Triple& axis, double& spin_deg);

}  // namespace corpuscle
