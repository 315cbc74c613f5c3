// Rigid bodies held or moved as the case prescribes.
#pragma once

#include "immersed/surface.hpp"
#include "input/case.hpp"

namespace corpuscle {

/// Surface of a body at its starting position.
/// @param spacing_um  grid spacing, for `vertices` = 0
/// @throws InputError  for a file that is missing, damaged or not a closed surface
TriangleMesh make_body_mesh(const BodySettings& body, double spacing_um);

class RigidBodies {
 public:
  /// @param first_body  number of the first rigid body in `surfaces`: cells come before
  RigidBodies(const std::vector<BodySettings>& bodies, const SurfaceSet& surfaces, int first_body);

  /// Positions and velocities at time t, us.
  void move_to(double time_us);
  /// Centre of body b at the time last moved to, um.
  const Triple& centre(int b) const { return centre_[b]; }
  Triple velocity(int b) const { return settings_[b].velocity_um_per_us; }
  Triple angular_velocity(int b) const { return settings_[b].angular_velocity_rad_per_us; }
  int count() const { return static_cast<int>(settings_.size()); }
  /// Largest speed of any vertex, um/us.
  double largest_speed() const;
  bool moving() const { return largest_speed() > 0; }

 private:
  std::vector<BodySettings> settings_;
  SurfaceSet surfaces_;
  std::vector<int> first_vertex_;
  std::vector<double> reach_;  // largest distance of a vertex from the centre
  std::vector<Triple> centre_;
  Components<double> reference_;
};

}  // namespace corpuscle
