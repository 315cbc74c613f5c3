// Forces from vertices to the grid's faces and velocities back, with one kernel and its transpose.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/workspace.hpp"
#include "fluid/masked_gradient.hpp"
#include "grid/grid.hpp"
#include "immersed/surface_views.hpp"
#include "transfer/find_markers.hpp"
#include "transfer/slip.hpp"

namespace corpuscle {

class Transfer {
 public:
  /// @param boundaries  one entry per side
  /// @param vertices    how many place() is called with
  /// @param workspace   shared with others that do not use it in the calls below
  Transfer(Grid& grid, const std::vector<BoundarySettings>& boundaries, CouplingSettings::Kernel kernel, int vertices,
           std::shared_ptr<Workspace> workspace = std::make_shared<Workspace>());

  /// The vertices are others from now on.
  void take_up(const SurfaceSet& set);
  /// Find the vertices' positions x [vertex, 3], um, in the grid. Must precede the calls below.
  /// @returns the lowest vertex that is beyond a side of this rank's block by about a cell at most, or -1: outside the grid,
  ///          unless another part of it, which may be near where it bends, has the vertex at home
  int place(const Components<double>& x);
  /// The forces [vertex, 3], nN, onto faces().
  /// @param slip  as for interpolate(): what takes kinks off where there are two fluids; null for none
  void spread(const Components<double>& force, const SlipViews* slip = nullptr);
  /// The same with what is normal to the surface that they act on as a jump of the pressure across it. After sharpen_pressure().
  void spread(const Components<double>& force, const SurfaceSet& surface, const SlipViews* slip = nullptr);
  /// From now on vertices are found where they are up to a link beyond the nodes that this rank knows: they are corners of triangles that
  /// reach into it.
  void find_corners();
  /// From now on there is memory for that.
  void sharpen_pressure();
  /// Membranes of those types [type] have fluids so many times as viscous inside as outside: their slip is another from now on.
  void slip_between(const std::vector<double>& ratios);
  /// Whether triangles reach farther than this rank's block knows of vertices: then some jumps would be missing. After place().
  bool reach_too_far(const SurfaceSet& surface) const;
  /// The force on faces, with valid halos: shared with the fluid.
  const FaceForce& faces() const { return faces_; }
  /// Velocity of the vertices [vertex, 3], um/us, from fluxes through faces and velocities on the sides of the block: this
  /// rank's part.
  /// @param slip  null for none
  void interpolate(const Array<double> (&flux)[3], const Components<double>& u, const SlipViews* slip, const Components<double>& velocity);
  /// Power that forces [vertex, 3] give to sides that move: the part of a kernel that is folded back pushes the side itself. This
  /// rank's part, nW. Finds all weights anew: for reports. @param slip  as for spread()
  double power_on_sides(const Components<double>& force, const Components<double>& u, const SlipViews* slip = nullptr);
  /// What the slip of a membrane depends on, with this kernel's law.
  /// @param type  [body] as for slip_between(); without values there is but one fluid
  /// @param gap  [vertex] um to the nearest other surface; without values nothing is near
  /// @param followed  [vertex, 1] share of the force that the slip follows; without values all of it
  SlipViews slip(const SurfaceSet& surface, const Components<double>& force, double viscosity, const Array<int>& type = {},
                 const Array<double>& gap = {}, const Components<double>& followed = {}) const;
  /// How far dipoles that take off kinks move a membrane, times the viscosity outside over the force per area and the spacing: the square
  /// of what velocity and force each take along of a shear, which both fluids resist half.
  double largest_dipole() const;

  /// Vertices that lie in this rank's own cells, after place(). Over all ranks and copies every vertex does once.
  int at_home() const;
  /// Adds one to the first component of each of them in `count` [vertex, 3].
  void mark_at_home(const Components<double>& count) const;
  /// The widest spacing of this rank's block, um.
  double largest_spacing() const { return largest_spacing_; }
  int markers() const { return markers_.count; }
  /// Of the sphere that moves as a vertex alone, spacings.
  double marker_radius() const;
  const MarkerViews& views() const { return markers_; }
  const TransferBlock& block() const { return block_; }
  const MarkerSearch& search() const { return search_; }
  const VertexPlaces& places() const { return places_; }

 private:
  SlipLaw law_of_slip() const;
  void prepare_sharpening();
  void add_pressure_jumps(const SurfaceSet& surface);
  void spread_rest(const Components<double>& force, const SurfaceSet* surface, const SlipViews* slip);
  void make_places(int vertices);
  void make_room(int markers);
  int planes_at_once() const;
  template <class Delta, class Use>
  void for_planes(const Use& use);
  template <class Use>
  void with_kernel(const Use& use) const;

  Grid* grid_;
  CouplingSettings::Kernel kernel_;
  TransferBlock block_;
  MarkerSearch search_;
  bool corners_ = false;  // are found
  VertexPlaces places_;
  HostCopy<Array<int>> beyond_host_;
  MarkerViews markers_;
  std::shared_ptr<Workspace> workspace_;
  int room_ = 0;
  bool marked_ = false;  // cells near markers are, and the planes' first markers known
  Array<int> first_of_plane_;
  HostCopy<Array<int>> first_of_plane_host_;
  double largest_spacing_ = 0;
  FaceForce faces_;
  std::vector<double> ratios_;            // of slip_between()
  Array<double> ratio_;                   // the same for kernels
  double moment_ = 0;                     // that sharpen_faces() takes back; 0: nothing
  Array<double> raw_[3], sharp_flux_[3];  // [cell] at faces, before and after; only then
  /// Of a pressure that jumps.
  struct Jump {
    Array<double> jump;       // [vertex] kPa, and as much room again
    Components<double> rest;  // [vertex, 3] nN
    Array<std::int64_t> sum;  // [cell]
  };
  std::optional<Jump> jump_;
};

}  // namespace corpuscle
