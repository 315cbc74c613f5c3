// Packing of rigid shapes: they grow from small where chance has put them, and push each other away until they have their size.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "populations/packing_shape.hpp"
#include "populations/packing_walls.hpp"

namespace corpuscle {

/// A unit quaternion.
struct Rotation {
  double w = 1, x = 0, y = 0, z = 0;
  /// [row] of its matrix.
  void matrix(Vec3 (&rows)[3]) const;
  /// Turned on by a small angle, rad, about the axes of space.
  Rotation turned(const Vec3& by) const;
};

struct PackedBody {
  int shape = 0;
  bool movable = true, turns = true;
  int group = 0;   // of limits
  double gap = 0;  // um, least to any other surface
  Vec3 center;     // um
  Rotation rotation;
};

/// Boxes that bodies stay within, um.
struct PackingLimits {
  Vec3 lower{-1e300, -1e300, -1e300}, upper{1e300, 1e300, 1e300};
  bool any() const {
    return lower.x > -1e299 || lower.y > -1e299 || lower.z > -1e299 || upper.x < 1e299 || upper.y < 1e299 || upper.z < 1e299;
  }
};

/// What all bodies have to do with.
struct PackingSpace {
  PeriodicFrame frame;
  std::vector<Vec3> shifts;  // by periods under which bodies are seen, none first
  const PackingWalls* walls = nullptr;
  std::vector<PackingLimits> limits;  // [group]
  /// um, beyond a body's gap, up to which distances must be known.
  static constexpr double spare = 0.04;
};

class RigidPacking {
 public:
  /// Movable bodies begin at `scale` of their size, others have all of it.
  RigidPacking(const std::vector<PackingShape>& shapes, std::vector<PackedBody> bodies, const PackingSpace& space, double scale);

  /// Until all have their size and gap, or no more comes of it.
  /// @returns whether they have
  bool grow();
  /// A little smaller, until there is room. @returns whether there is before they are `least`
  bool shrink(double least);
  /// All of full size; those that are most in each other's way are taken out until the rest fits.
  void thin_out();

  const std::vector<PackedBody>& bodies() const { return bodies_; }
  double scale() const { return scale_; }
  long iterations() const { return iterations_; }

 private:
  struct Near {
    int body, other, shift;
  };
  double scale_of(int body) const { return bodies_[body].movable ? scale_ : 1; }
  /// To which gaps are pushed, while they grow with the bodies.
  double gap_of(int body) const { return (bodies_[body].gap + PackingSpace::spare) * scale_; }
  double radius_of(int body) const { return shapes_[bodies_[body].shape].radius() * scale_of(body); }
  void make_lists();
  bool lists_hold() const;
  double find_forces();
  void see(const PackingPoints& points, const Vec3 (&turn)[3], const Vec3& start, const Vec3& low, const Vec3& high);
  void push_pair(const Near& near);
  void push_from_outside(int body);
  void add_push(int body, const Vec3& arm, const Vec3& force, double weight);
  void move(double largest_rate);
  void rest();
  bool settle(int most, bool growing);

  const std::vector<PackingShape>& shapes_;
  std::vector<PackedBody> bodies_;
  const PackingSpace& space_;
  double scale_, largest_gap_ = 0, skin_ = 0;
  bool fine_ = false;
  std::vector<Near> near_;
  std::vector<Vec3> listed_;  // [body] centres when lists were made
  double listed_scale_ = 0;
  std::vector<Vec3> velocity_, spin_, force_, torque_;
  std::vector<double> stiffness_, overlap_;  // [body]
  std::vector<double> seen_;                 // [3 * point, point] places in another's frame, and how far beyond its box
  std::vector<Vec3> rows_;                   // [body * 3] of the rotations' matrices
  double step_ = 0.1, mixing_ = 0.1;
  int downhill_ = 0;
  long iterations_ = 0;
};

}  // namespace corpuscle
