// The sharp-interface immersed boundary: which nodes are fluid, how the others get their values, and the fluid's
// traction on the surfaces.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "immersed/classify.hpp"
#include "immersed/faces.hpp"
#include "immersed/locate.hpp"
#include "immersed/traction.hpp"
#include "immersed/wrap.hpp"

namespace corpuscle {

struct ImmersedOptions {
  std::array<bool, 6> guarded{};  // i_min, i_max, j_min, ...: sides that no surface may come near
  PeriodicFrame frame;            // of the periodic directions
  /// Where nodes of others lie beside this block's (other ranks', or its own at the other end of a periodic direction): the
  /// sum over all ranks, and the exchange of halos.
  std::function<long(long)> sum;
  std::function<void(const Array<std::int8_t>&)> exchange;
  std::function<void(const BandViews&)> exchange_band;  // keys and cut links
  std::array<bool, 6> outflow{};                        // sides through which the first `travellers` vertices, those of cells, may leave
  int travellers = 0;
  Array<unsigned char> pressure_given;  // [cell] boundary nodes where the pressure is known, those of outflow sides; empty for none
};

/// Results of the last classify() and build_stencils() on this rank's owned nodes; the caller adds up over ranks.
struct ImmersedCounts {
  int fluid = 0, immersed = 0, inside = 0;
  int cut_links = 0;  // grid links that cross a surface
  int isolated = 0;   // of the immersed: absorbed because closed in, alone or in pockets
  int uncovered = 0;  // inside at the last classification, fluid now
  int faces = 0;
  int owned_vertices = 0;
  std::vector<int> body_immersed, body_inside;
  std::array<int, row_kinds> velocity_rows{}, pressure_rows{};  // by RowKind
  int lost_vertex = -1;                                         // lowest vertex beyond a physical boundary seen here; -1: none
  double wall_spacings = 1e30;                                  // least distance to a guarded side, in local spacings
  int wall_vertex = -1;                                         // the vertex that has it
  double outflow_um = 1e30;                                     // least distance of a cell to an outflow, along the grid line
  int outflow_vertex = -1;                                      // the vertex that has it
  int crossed_links = 0;                                        // where surfaces cross, each other or themselves
  int crossed_node = -1;                                        // a node there
  double body_spacings = 1e30;  // least gap between two bodies, in spacings; what exceeds one may have escaped
  int gap_node = -1;            // a node there
};

/// A node and the bodies that its and its neighbours' closest surface points belong to.
struct NearBodies {
  Vec3 at;               // um
  int body, other = -1;  // -1: no other
  int around = -1;       // that a neighbour lies in with no triangle between; -1: none does
};

/// Owns the search band, the classification and the stencils of one rank's block. Communicates only through its options.
class ImmersedBoundary {
 public:
  /// @param surface  shared views: later changes of positions and velocities are seen. Topology is fixed.
  ImmersedBoundary(const GridViews& grid, const SurfaceSet& surface, const ImmersedOptions& options);

  /// Move bodies first <= b < last as a whole into the periodic domain; see wrap_bodies(). Nothing without one.
  void wrap(int first, int last, bool from_start);
  bool periodic() const { return images_.count > 1; }
  /// [body, 3] periods by which the bodies have been moved back; empty without a periodic direction.
  const Table<int>& laps() const { return laps_; }
  /// The same as numbers [3 * bodies], for restarts.
  std::vector<double> laps_state() const;
  void set_laps_state(const std::vector<double>& laps);
  /// Search, classify and list immersed nodes at the surfaces' present position. Halo nodes are classified too; of these
  /// the outermost layer may miss links beyond it.
  void classify();
  /// List the faces around each body. @pre classify(), and halos of nodes() exchanged
  void find_faces();
  /// Rows for velocity and pressure at the listed nodes. @pre classify()
  void build_stencils();
  /// Give fluid nodes that were inside a body at the last classification a pressure. @pre p's halos filled
  void fill_uncovered(const Array<double>& p) const;
  /// Smallest grid spacing, over directions, at the nodes nearest to the vertices that this rank owns, um.
  double smallest_spacing() const;
  /// Interpolate the surfaces' present velocities to the rows' surface points. @pre build_stencils()
  void update_surface_velocity();

  /// u at immersed nodes from the fluid and surface_velocity(); u's halos must be filled.
  void reconstruct_velocity(const Components<double>& u) const;
  /// p at immersed nodes from the fluid.
  void extend_pressure(const Array<double>& p) const;

  /// Stress at the vertices that this rank owns, zero at the others: add up over ranks, then complete_stress().
  const SurfaceStress& find_stress(const TractionInput& fields);
  const SurfaceStress& found_stress() const { return stress_; }
  /// How the last stress came about, by TractionFallback; copies to the host.
  std::vector<int> traction_fallbacks() const;
  Slip slip(const Components<double>& u) const;

  const NodeViews& nodes() const { return nodes_; }
  const BandViews& band() const { return band_; }
  const PlaceViews& places() const { return places_; }
  const Lattice& lattice() const { return lattice_; }
  const Images& images() const { return images_; }
  /// The first counts().immersed entries of the views are in use; capacity may be larger.
  const StencilViews& velocity_stencils() const { return velocity_; }
  const StencilViews& pressure_stencils() const { return pressure_; }
  const FootViews& feet() const { return feet_; }
  const Components<double>& surface_velocity() const { return u_surface_; }
  /// The first counts().faces entries are in use.
  const FaceViews& faces() const { return faces_; }
  const ImmersedCounts& counts() const { return counts_; }

  /// True where this rank owns the vertex; copies to the host. Over all ranks each vertex is owned exactly once, unless
  /// it left the grid.
  std::vector<char> owned_vertices() const;
  /// Let the next search start from nothing: vertices have been put elsewhere.
  void forget_places() { locate_.warm = false; }
  /// "bodies.2, vertex 17 at (x, y, z) um"; copies from the device.
  std::string describe_vertex(int vertex) const;
  /// The guarded side nearest to a vertex that this rank owns, -1 for others; copies from the device.
  int nearest_guarded_side(int vertex) const;
  /// The bodies beside a node of the band; copies from the device.
  NearBodies bodies_near(int node) const;

 private:
  StencilInput input() const { return {lattice_, surface_, images_, normals_, band_, nodes_, extended_}; }
  NodeBox read_places();
  void mark_nodes(const NodeBox& box);
  void classify_nodes(const NodeBox& box);
  NodeBox resolve_enclosed(const NodeBox& box);
  void read_counts(const NodeBox& box);
  int absorb_pockets(const NodeBox& box);
  void measure_gaps(const NodeBox& box);
  void allocate_rows(int rows);
  void allocate_faces(int faces);

  GridViews grid_;
  SurfaceSet surface_;
  ImmersedOptions options_;
  Lattice lattice_;
  Images images_;
  Vec3 first_node_;
  Table<int> laps_;
  LocateOptions locate_;
  PlaceViews places_;
  PseudoNormals normals_;
  BandViews band_;
  NodeViews nodes_;
  Array<NodeKind> previous_kind_;
  Array<std::int8_t> reached_;
  Array<std::int8_t> extended_;  // see StencilInput
  Array<int> node_counts_, row_counts_, traction_counts_;
  Array<Key> least_gap_;  // empty where there is only one body
  HostCopy<Array<int>> box_host_, node_counts_host_, row_counts_host_;
  HostCopy<Array<Key>> found_host_, least_gap_host_;
  StencilViews velocity_, pressure_;
  FootViews feet_;
  Components<double> u_surface_;
  FaceViews faces_;
  SurfaceStress stress_;
  NodeBox last_box_, counted_box_;
  ImmersedCounts counts_;
};

}  // namespace corpuscle
