// The membranes at hand and the rigid bodies of a scene as one set of surfaces, as contact sees them. Every rank has all rigid bodies,
// and images of them beyond periodic sides, as it has copies of cells there: so contact knows neither of ranks nor of images.
#pragma once

#include <utility>
#include <vector>

#include "common/vec3.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

class JoinedSurfaces {
 public:
  /// @param rigid   rigid bodies alone; they move on
  /// @param images  which of them are seen, and by how much each is shifted, um
  JoinedSurfaces(const SurfaceSet& rigid, const std::vector<std::pair<int, Vec3>>& images);

  /// The cells are others from now on: those of `cells`, of the types `type` [body] in `templates`.
  void take_up(const SurfaceSet& cells, const SurfaceSet& templates, const Array<int>& type);
  /// Positions and velocities as they are at present.
  void update(const SurfaceSet& cells) const;
  /// Positions of this rank's own cells, as contact has left them.
  void give_back(const SurfaceSet& cells) const;

  /// Cells first; a rigid body's number is that among the rigid bodies.
  const SurfaceSet& set() const { return set_; }
  const SurfaceSet& rigid() const { return rigid_; }
  /// [body] of set(): the type of a cell, the number of a rigid body.
  const Array<int>& type() const { return type_; }

 private:
  void make_room();

  SurfaceSet rigid_, set_;
  std::vector<int> body_;                        // [image]
  std::vector<int> rigid_vertices_, rigid_triangles_;  // [rigid body]
  Array<int> image_body_;
  Table<double> image_shift_;
  Array<int> type_;
};

}  // namespace corpuscle
