// The membranes at hand and the rigid bodies of a scene as one set of surfaces, as contact sees them. Every rank has all rigid bodies,
// and images of them beyond periodic sides, as it has copies of cells there: so contact knows neither of ranks nor of images.
#pragma once

#include <utility>
#include <vector>

#include "contact/join_positions.hpp"

namespace corpuscle {

class JoinedSurfaces {
 public:
  /// @param rigid   rigid bodies alone; they move on
  /// @param images  which of them are seen, and by how much each is shifted, um
  /// @param laps    [rigid body, 3] periods by which each has been moved back, which changes; may be empty
  /// @param period  um; zero along directions that are not periodic
  JoinedSurfaces(const SurfaceSet& rigid, const std::vector<std::pair<int, Vec3>>& images, const Table<int>& laps, const Vec3 (&period)[3]);

  /// The cells are others from now on: those of `cells`, of the types `type` [body] in `templates`.
  void take_up(const SurfaceSet& cells, const SurfaceSet& templates, const Array<int>& type);
  /// Whether a rigid body has come back through a periodic side since then: its images are then to be taken up anew.
  bool turned() const;
  /// Positions and velocities as they are at present.
  void update(const SurfaceSet& cells) const;
  /// Positions of this rank's own cells, as contact has left them.
  void give_back(const SurfaceSet& cells) const;

  /// Cells first; a rigid body's number is that among the rigid bodies.
  const SurfaceSet& set() const { return set_; }
  const SurfaceSet& rigid() const { return rigid_; }

 private:
  void make_room();

  SurfaceSet rigid_, set_;
  std::vector<int> body_;                              // [image]
  std::vector<int> rigid_vertices_, rigid_triangles_;  // [rigid body]
  RigidImages images_;
  Array<int> type_;  // [body] of a cell; of a rigid body its number
};

}  // namespace corpuscle
