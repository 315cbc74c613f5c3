#include "immersed/immersed_boundary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "immersed/surface.hpp"
#include "immersed/uncovered.hpp"

namespace corpuscle {

namespace {

constexpr const char* label_prefix = "corpuscle::immersed::";

template <class View, class... Extents>
View make(const char* name, Extents... extents) {
  return View(uninitialised(std::string(label_prefix) + name), extents...);
}

template <class View>
auto to_host(const View& view) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
}

/// All shifts by -1, 0 or +1 period, in the order that Images states; the identity first, so that it wins ties.
Images make_images(const IndexSpace& index, const Vec3 (&period)[3]) {
  Images images;
  images.count = 0;
  for (int k = 0; k < 27; ++k) {
    const int step[3] = {(k % 3 + 1) % 3 - 1, (k / 3 % 3 + 1) % 3 - 1, (k / 9 + 1) % 3 - 1};
    Vec3 shift;
    bool allowed = true;
    for (int d = 0; d < 3; ++d) {
      allowed = allowed && (step[d] == 0 || index.periodic[d]);
      shift += static_cast<double>(step[d]) * period[d];
    }
    if (allowed) images.shift[images.count++] = shift;
  }
  return images;
}

/// Bounds of the lattice in space, widened by the reach of extrapolation.
void find_bounds(const Lattice& lattice, LocateOptions& options) {
  const auto x = to_host(lattice.x);
  double link = 0;
  options.lower = {1e300, 1e300, 1e300};
  options.upper = {-1e300, -1e300, -1e300};
  for (int k = lattice.lower[2]; k <= lattice.upper[2]; ++k) {
    for (int j = lattice.lower[1]; j <= lattice.upper[1]; ++j) {
      for (int i = lattice.lower[0]; i <= lattice.upper[0]; ++i) {
        const int at[3] = {i, j, k}, c = lattice.node(i, j, k);
        const Vec3 p = load(x, c);
        for (int d = 0; d < 3; ++d) {
          options.lower[d] = std::min(options.lower[d], p[d]);
          options.upper[d] = std::max(options.upper[d], p[d]);
          if (at[d] < lattice.upper[d]) link = std::max(link, norm(load(x, c + lattice.index.stride(d)) - p));
        }
      }
    }
  }
  const double margin = 0.5 * Lattice::reach * link;
  options.lower -= {margin, margin, margin};
  options.upper += {margin, margin, margin};
}

}  // namespace

ImmersedBoundary::ImmersedBoundary(const GridViews& grid, const SurfaceSet& surface, const ImmersedOptions& options)
    : grid_(grid), surface_(surface), options_(options), lattice_(make_lattice(grid)) {
  for (int d = 0; d < 3; ++d) {
    if (grid.index.periodic[d] && norm(options.frame.period[d]) == 0) {
      throw InputError(fmt::format("immersed boundary: index direction {} is periodic but its period is zero", d));
    }
  }
  images_ = make_images(grid.index, options.frame.period);
  find_bounds(lattice_, locate_);
  std::copy(options.guarded.begin(), options.guarded.end(), locate_.guarded);
  std::copy(options.outflow.begin(), options.outflow.end(), locate_.outflow);
  locate_.travellers = options.travellers;

  first_node_ = load(to_host(grid.x), grid.index.cell(0, 0, 0));

  const int cells = grid.index.size(), items = surface.vertices * images_.count;
  places_ = {make<Table<double>>("vertex_xi", items, 3),
             make<Array<Located>>("vertex_status", items),
             make<Table<double>>("vertex_pad", items, 3),
             make<Array<double>>("vertex_band_width", items),
             make<Array<int>>("vertex_image", surface.vertices),
             make<Array<int>>("node_boxes", 6 * (surface.bodies + 1)),
             make<Array<Key>>("vertex_findings", 4)};
  normals_ = {make<Components<double>>("face_normal", surface.triangles, 3), make<Components<double>>("angle_normal", surface.vertices, 3)};
  band_ = {make<Array<Key>>("closest", cells), make<Array<int>>("cut_links", cells), make<Array<double>>("distance", cells),
           make<Components<double>>("foot", cells, 3)};
  nodes_ = {make<Array<NodeKind>>("kind", cells), make<Array<int>>("body", cells)};
  previous_kind_ = make<Array<NodeKind>>("previous_kind", cells);
  reached_ = make<Array<std::int8_t>>("reached", cells);
  extended_ = make<Array<std::int8_t>>("extended", cells);
  node_counts_ = make<Array<int>>("node_counts", count_slots + 2 * surface.bodies);
  row_counts_ = make<Array<int>>("row_counts", 2 * row_kinds);
  traction_counts_ = make<Array<int>>("traction_counts", static_cast<int>(traction_counts));
  faces_.start = make<Array<int>>("face_start", surface.bodies + 1);
  stress_ = make_surface_stress("corpuscle::immersed::stress_vertex", surface.vertices);
  if (periodic()) laps_ = Table<int>("corpuscle::immersed::laps", surface.bodies, 3);
  Kokkos::deep_copy(places_.status, Located::failed);
  Kokkos::deep_copy(extended_, std::int8_t{0});
  if (options.pressure_given.data()) mark_known_pressure(options.pressure_given, extended_);
  if (surface.bodies * images_.count > 1) least_gap_ = make<Array<Key>>("least_gap", 1);
  box_host_ = HostCopy(places_.box);
  found_host_ = HostCopy(places_.found);
  node_counts_host_ = HostCopy(node_counts_);
  row_counts_host_ = HostCopy(row_counts_);
  least_gap_host_ = HostCopy(least_gap_);
  allocate_rows(0);
  allocate_faces(0);

  Kokkos::deep_copy(nodes_.kind, grid.base_kind);
  Kokkos::deep_copy(nodes_.body, -1);
  Kokkos::deep_copy(band_.key, no_key);
  Kokkos::deep_copy(band_.cut, 0);
}

void ImmersedBoundary::allocate_rows(int rows) {
  const auto stencils = [&](const char* name) {
    const std::string prefix = std::string(name) + "_";
    return StencilViews{velocity_.node,
                        make<Table<int>>((prefix + "column").c_str(), rows, stencil_width),
                        make<Table<double>>((prefix + "weight").c_str(), rows, stencil_width),
                        make<Array<int>>((prefix + "columns").c_str(), rows),
                        make<Array<double>>((prefix + "surface_weight").c_str(), rows),
                        make<Array<RowKind>>((prefix + "kind").c_str(), rows)};
  };
  velocity_.node = make<Array<int>>("immersed_node", rows);
  velocity_ = stencils("velocity_row");
  pressure_ = stencils("pressure_row");
  feet_ = {make<Array<int>>("foot_triangle", rows), make<Table<double>>("foot_weight", rows, 3)};
  u_surface_ = make<Components<double>>("u_surface", rows, 3);
}

void ImmersedBoundary::allocate_faces(int faces) {
  faces_.cell = make<Array<int>>("face_cell", faces);
  faces_.direction = make<Array<std::int8_t>>("face_direction", faces);
  faces_.sign = make<Array<std::int8_t>>("face_sign", faces);
  faces_.counted = make<Array<std::int8_t>>("face_counted", faces);
  faces_.image = make<Array<std::int8_t>>("face_image", faces);
  faces_.body = make<Array<int>>("face_body", faces);
}

NodeBox ImmersedBoundary::read_places() {
  const auto& box = box_host_.read();
  const auto& found = found_host_.read();
  counts_.lost_vertex = found(0) == no_key ? -1 : static_cast<int>(found(0));
  counts_.owned_vertices = static_cast<int>(found(2));
  counts_.wall_spacings = 1e30;
  counts_.wall_vertex = -1;
  if (found(1) != no_key) {
    counts_.wall_spacings = key_value(found(1));
    counts_.wall_vertex = static_cast<int>(key_item(found(1)));
  }
  counts_.outflow_um = found(3) == no_key ? 1e30 : key_value(found(3));
  counts_.outflow_vertex = found(3) == no_key ? -1 : static_cast<int>(key_item(found(3)));
  NodeBox all;
  for (int d = 0; d < 3; ++d) {
    all.lower[d] = box(d);
    all.upper[d] = box(3 + d);
  }
  return all.clipped(lattice_.lower, lattice_.upper);
}

void ImmersedBoundary::classify() {
  locate_vertices(lattice_, surface_, images_, locate_, places_);
  locate_.warm = true;
  const NodeBox present = read_places(), box = merged(present, last_box_);
  clear_band(lattice_, box, band_);
  Kokkos::deep_copy(Exec(), previous_kind_, nodes_.kind);
  pseudo_normals(surface_, normals_);
  mark_nodes(box);
  last_box_ = present;
  counted_box_ = box;
  classify_nodes(box);

  if (list_immersed(grid_.index, box, nodes_.kind, velocity_.node) != counts_.immersed ||
      counts_.immersed > static_cast<int>(velocity_.node.extent(0))) {
    allocate_rows(counts_.immersed + counts_.immersed / 2);
    list_immersed(grid_.index, box, nodes_.kind, velocity_.node);
  }
}

/// Of the halo, what others have marked is taken over from them: it is as much as a rank's own where a cell lies across the
/// plane between two.
void ImmersedBoundary::mark_nodes(const NodeBox& box) {
  NodeBox all, own;
  std::copy(lattice_.lower, lattice_.lower + 3, all.lower);
  std::copy(lattice_.upper, lattice_.upper + 3, all.upper);
  own = options_.exchange_band ? marked_nodes(lattice_) : all;
  mark_band(lattice_, own, surface_, images_, places_, band_);
  mark_cut_links(lattice_, own.grown(1).clipped(all.lower, all.upper), surface_, images_, places_, band_);
  if (options_.exchange_band) {
    options_.exchange_band(band_);
    if (periodic()) turn_images(lattice_, surface_.triangles, band_.key);
  }
  measure_band(lattice_, options_.exchange_band ? all : box, surface_, images_, normals_, band_);
}

void ImmersedBoundary::wrap(int first, int last, bool from_start) {
  if (periodic() && last > first) wrap_bodies(surface_, first, last, options_.frame, from_start, images_.count, places_.status, laps_);
}

std::vector<double> ImmersedBoundary::laps_state() const {
  const auto host = to_host(laps_);
  return {host.data(), host.data() + host.size()};
}

void ImmersedBoundary::set_laps_state(const std::vector<double>& laps) {
  auto host = to_host(laps_);
  for (std::size_t e = 0; e < laps.size(); ++e) host.data()[e] = static_cast<int>(laps[e]);
  Kokkos::deep_copy(laps_, host);
}

void ImmersedBoundary::fill_uncovered(const Array<double>& p) const {
  corpuscle::fill_uncovered(lattice_, counted_box_, nodes_.kind, previous_kind_, p);
}

double ImmersedBoundary::smallest_spacing() const { return smallest_spacing_at(lattice_, surface_.vertices, places_); }

void ImmersedBoundary::find_faces() {
  counts_.faces = count_faces(grid_.index, places_.box, surface_.bodies, nodes_, faces_);
  if (counts_.faces > static_cast<int>(faces_.cell.extent(0))) allocate_faces(counts_.faces + counts_.faces / 2);
  list_faces(grid_.index, places_.box, surface_.bodies, surface_.triangles, nodes_, band_.key, faces_);
}

void ImmersedBoundary::classify_nodes(const NodeBox& box) {
  classify_band(grid_, box, surface_, band_, nodes_);
  NodeBox interior = box;
  for (int d = 0; d < 3; ++d) {
    interior.lower[d] = std::max(box.lower[d], lattice_.lower[d] + (lattice_.boundary_below[d] ? 1 : 0));
    interior.upper[d] = std::min(box.upper[d], lattice_.upper[d] - (lattice_.boundary_above[d] ? 1 : 0));
  }
  for (int d = 0; d < 3; ++d) fill_lines(grid_.index, interior, d, nodes_);
  mark_immersed(lattice_, box, surface_, band_, nodes_);
  counts_.isolated = absorb_isolated(lattice_, box, surface_, images_, normals_, band_, nodes_);
  counts_.isolated += absorb_pockets(box);
  count_nodes(lattice_, box, band_, nodes_, previous_kind_, node_counts_);
  read_counts(box);
  if (least_gap_.extent(0) > 0) measure_gaps(box);
}

/// A pocket may be cut by the planes between ranks or astride a periodic side: only what no rank reaches is one.
int ImmersedBoundary::absorb_pockets(const NodeBox& box) {
  OpenFaces faces;
  for (int d = 0; d < 3; ++d) {
    faces.open[d][0] = box.lower[d] > lattice_.lower[d];
    faces.open[d][1] = box.upper[d] < lattice_.upper[d];
  }
  const IndexSpace& index = grid_.index;
  const auto left = [&] {
    const long own = reach_all(index, box, nodes_, reached_);
    return options_.sum ? options_.sum(own) : own;
  };
  if (options_.exchange) Kokkos::deep_copy(Exec(), reached_, std::int8_t{1});  // beyond the box, which another rank's may overlap
  seed_open_fluid(index, box, faces, band_, nodes_, reached_);
  long unreached = left();
  // Owned nodes alone tell the end: what a rank has reached in its halo is gone with the next exchange.
  for (long before = unreached + 1; unreached > 0 && unreached < before && options_.exchange;) {
    before = unreached;
    options_.exchange(reached_);
    unreached = left();
  }
  return unreached > 0 ? absorb_unreached(index, box, surface_, band_, nodes_, reached_) : 0;
}

void ImmersedBoundary::measure_gaps(const NodeBox& box) {
  find_least_gap(lattice_, box, surface_, images_, band_, least_gap_);
  const Key found = least_gap_host_.read()(0);
  counts_.body_spacings = found == no_key ? 1e30 : key_value(found);
  counts_.gap_node = found == no_key ? -1 : static_cast<int>(key_item(found));
}

void ImmersedBoundary::read_counts(const NodeBox& box) {
  const auto& counts = node_counts_host_.read();
  if (counts(count_band) == 0) {
    const NodeBox all = resolve_enclosed(box);
    count_nodes(lattice_, all, band_, nodes_, previous_kind_, node_counts_);
    node_counts_host_.read();
  }
  counts_.immersed = counts(count_immersed);
  counts_.inside = counts(count_inside);
  counts_.fluid = grid_.index.owned() - counts_.immersed - counts_.inside;
  counts_.cut_links = counts(count_cut);
  counts_.uncovered = counts(count_uncovered);
  counts_.crossed_links = counts(count_crossed);
  counts_.crossed_node = counts(crossed_node) - 1;
  counts_.body_immersed.resize(surface_.bodies);
  counts_.body_inside.resize(surface_.bodies);
  for (int b = 0; b < surface_.bodies; ++b) {
    counts_.body_immersed[b] = counts(count_slots + 2 * b);
    counts_.body_inside[b] = counts(count_slots + 2 * b + 1);
  }
}

/// No surface passes through the block: all of it lies outside, or inside one body that encloses it.
NodeBox ImmersedBoundary::resolve_enclosed(const NodeBox& box) {
  const Vec3& p = first_node_;
  if (winding_number(surface_, images_, 0, surface_.triangles, p) < 0.5) {
    decide_rest(grid_.index, box, NodeKind::fluid, -1, nodes_);
    return box;
  }
  const auto first = to_host(surface_.first_triangle);
  int body = 0;
  while (body + 1 < surface_.bodies && winding_number(surface_, images_, first(body), first(body + 1), p) < 0.5) {
    ++body;
  }
  NodeBox all;
  std::copy(lattice_.lower, lattice_.lower + 3, all.lower);
  std::copy(lattice_.upper, lattice_.upper + 3, all.upper);
  classify_band(grid_, all, surface_, band_, nodes_);
  decide_rest(grid_.index, all, NodeKind::inside, body, nodes_);
  last_box_ = all;
  return all;
}

void ImmersedBoundary::build_stencils() {
  Kokkos::deep_copy(Exec(), row_counts_, 0);
  build_velocity_rows(input(), counts_.immersed, velocity_, feet_, row_counts_);
  build_pressure_rows(input(), counts_.immersed, pressure_, row_counts_);
  if (options_.exchange) options_.exchange(extended_);
  const auto& counts = row_counts_host_.read();
  for (int k = 0; k < row_kinds; ++k) {
    counts_.velocity_rows[k] = counts(k);
    counts_.pressure_rows[k] = counts(row_kinds + k);
  }
  update_surface_velocity();
}

void ImmersedBoundary::update_surface_velocity() { interpolate_surface_velocity(surface_, feet_, counts_.immersed, u_surface_); }

void ImmersedBoundary::reconstruct_velocity(const Components<double>& u) const {
  apply_velocity_rows(velocity_, counts_.immersed, u_surface_, u);
}

void ImmersedBoundary::extend_pressure(const Array<double>& p) const { apply_pressure_rows(pressure_, counts_.immersed, p); }

const SurfaceStress& ImmersedBoundary::find_stress(const TractionInput& fields) {
  tractions(input(), places_, fields, stress_, traction_counts_);
  return stress_;
}

std::vector<int> ImmersedBoundary::traction_fallbacks() const {
  const auto counts = to_host(traction_counts_);
  return {counts.data(), counts.data() + counts.extent(0)};
}

Slip ImmersedBoundary::slip(const Components<double>& u) const { return surface_slip(input(), places_, u); }

std::vector<char> ImmersedBoundary::owned_vertices() const {
  const auto image = to_host(places_.image);
  std::vector<char> owned(image.extent(0));
  for (std::size_t v = 0; v < owned.size(); ++v) owned[v] = image(v) >= 0;
  return owned;
}

std::string ImmersedBoundary::describe_vertex(int vertex) const {
  const Vec3 x = load(to_host(surface_.x), vertex);
  const int body = to_host(surface_.vertex_body)(vertex), first = to_host(surface_.first_vertex)(body);
  return fmt::format("{}, vertex {} at ({:.4g}, {:.4g}, {:.4g}) um", body_name(surface_, body), vertex - first, x.x, x.y, x.z);
}

int ImmersedBoundary::nearest_guarded_side(int vertex) const {
  const int image = to_host(places_.image)(vertex);
  if (image < 0) return -1;
  const auto places = to_host(places_.xi);
  const int item = image * surface_.vertices + vertex;
  const double xi[3] = {places(item, 0), places(item, 1), places(item, 2)};
  int nearest = -1;
  double least = 1e300;
  for (int side = 0; side < 6; ++side) {
    const bool here = side % 2 == 0 ? lattice_.boundary_below[side / 2] : lattice_.boundary_above[side / 2];
    const double gap = spacings_to_side(lattice_, xi, side);
    if (here && options_.guarded[side] && gap < least) least = gap, nearest = side;
  }
  return nearest;
}

NearBodies ImmersedBoundary::bodies_near(int node) const {
  const auto x = to_host(lattice_.x);
  const auto key = to_host(band_.key);
  const auto triangle_body = to_host(surface_.triangle_body);
  const auto body = [&](int c) { return key_body(triangle_body, key(c)); };
  const auto kind = to_host(nodes_.kind);
  const auto cut = to_host(band_.cut);
  NearBodies near{load(x, node), body(node)};
  for (int side = 0; side < 6; ++side) {
    const int other = node + (side % 2 == 0 ? 1 : -1) * grid_.index.stride(side / 2);
    if (key(other) == no_key) continue;
    if (near.other < 0 && body(other) != near.body) near.other = body(other);
    const bool between = cut(side % 2 == 0 ? node : other) & (1 << side / 2);
    if (near.around < 0 && !between && kind(other) == NodeKind::inside) near.around = body(other);
  }
  return near;
}

}  // namespace corpuscle
