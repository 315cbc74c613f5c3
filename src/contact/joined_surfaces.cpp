#include "contact/joined_surfaces.hpp"

#include <algorithm>
#include <string>

#include "cells/topology.hpp"
#include "membrane/interface.hpp"

namespace corpuscle {

namespace {

std::vector<int> values_of(const Array<int>& view, int count) {
  const auto part = Kokkos::subview(view, std::make_pair(0, count));
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), part);
  return {host.data(), host.data() + count};
}

void fill(const Array<int>& view, const std::vector<int>& values) {
  const auto part = Kokkos::subview(view, std::make_pair(std::size_t(0), values.size()));
  const auto host = Kokkos::create_mirror_view(part);
  std::copy(values.begin(), values.end(), host.data());
  Kokkos::deep_copy(part, host);
}

/// Some to spare, so that arrays are seldom too small.
template <class View, class... Columns>
void grow(View& view, const char* name, std::size_t rows, Columns... columns) {
  if (view.data() && view.extent(0) >= rows) return;
  view = View();  // free before taking more
  view = View(uninitialised(std::string("corpuscle::contact::joined_") + name), rows + rows / 64 + 1, columns...);
}

/// In `joined` the tables of cells' types, and behind them those of rigid bodies.
void join_tables(const SurfaceSet& types, const SurfaceSet& rigid, SurfaceSet& joined) {
  const std::size_t triangles = types.triangles + rigid.triangles, vertices = types.vertices + rigid.vertices;
  grow(joined.place_triangle, "place_triangle", triangles, 3);
  grow(joined.place_neighbour, "place_neighbour", triangles, 3);
  grow(joined.place_ring_start, "place_ring_start", vertices + 1);
  grow(joined.place_ring_triangle, "place_ring_triangle", 3 * triangles);
  grow(joined.place_ring_corner, "place_ring_corner", 3 * triangles);
  append_tables(types, 0, 0, joined);
  append_tables(rigid, types.vertices, types.triangles, joined);
}

std::vector<int> differences(const std::vector<int>& first) {
  std::vector<int> counts;
  for (std::size_t b = 0; b + 1 < first.size(); ++b) counts.push_back(first[b + 1] - first[b]);
  return counts;
}

}  // namespace

JoinedSurfaces::JoinedSurfaces(const SurfaceSet& rigid, const std::vector<std::pair<int, Vec3>>& images, const Table<int>& laps,
                               const Vec3 (&period)[3])
    : rigid_(rigid) {
  rigid_vertices_ = differences(values_of(rigid.first_vertex, rigid.bodies + 1));
  rigid_triangles_ = differences(values_of(rigid.first_triangle, rigid.bodies + 1));
  images_.body = Array<int>("corpuscle::contact::image_body", images.size() + 1);
  images_.shift = Table<double>("corpuscle::contact::image_shift", images.size() + 1, 3);
  images_.laps = laps.data() ? laps : Table<int>("corpuscle::contact::no_laps", rigid.bodies, 3);
  images_.laps_then = Table<int>("corpuscle::contact::laps_then", rigid.bodies, 3);
  for (int d = 0; d < 3; ++d) images_.period[d] = period[d];
  const auto shift = Kokkos::create_mirror_view(images_.shift);
  for (std::size_t m = 0; m < images.size(); ++m) {
    body_.push_back(images[m].first);
    for (int d = 0; d < 3; ++d) shift(m, d) = images[m].second[d];
  }
  Kokkos::deep_copy(images_.shift, shift);
  fill(images_.body, body_);
}

void JoinedSurfaces::make_room() {
  const std::size_t vertices = set_.vertices, triangles = set_.triangles, bodies = set_.bodies;
  grow(set_.x, "x", vertices, 3);
  grow(set_.v, "v", vertices, 3);
  grow(set_.vertex_body, "vertex_body", vertices + 1);
  grow(set_.triangle_body, "triangle_body", triangles);
  grow(set_.to_place, "to_place", bodies + 1, 2);
  grow(set_.first_vertex, "first_vertex", bodies + 1);
  grow(set_.first_triangle, "first_triangle", bodies + 1);
  grow(set_.number, "number", bodies);
  grow(type_, "type", bodies);
}

void JoinedSurfaces::take_up(const SurfaceSet& cells, const SurfaceSet& templates, const Array<int>& type) {
  std::vector<int> first_vertex = values_of(cells.first_vertex, cells.bodies + 1),
                   first_triangle = values_of(cells.first_triangle, cells.bodies + 1), number = values_of(cells.number, cells.bodies),
                   types = values_of(type, cells.bodies);
  for (const int body : body_) {
    first_vertex.push_back(first_vertex.back() + rigid_vertices_[body]);
    first_triangle.push_back(first_triangle.back() + rigid_triangles_[body]);
    number.push_back(body);
    types.push_back(body);
  }
  set_.bodies = static_cast<int>(number.size());
  set_.cells = cells.cells;
  set_.own_cells = cells.own_cells;
  set_.own_vertices = cells.own_vertices;
  set_.vertices = first_vertex.back();
  set_.triangles = first_triangle.back();
  set_.names = cells.names;
  make_room();
  fill(set_.first_vertex, first_vertex);
  fill(set_.first_triangle, first_triangle);
  fill(set_.number, number);
  fill(type_, types);
  if (!set_.place_triangle.data()) join_tables(templates, rigid_, set_);
  if (set_.cells > 0) place_bodies(templates, type_, set_, 0, set_.cells);
  if (set_.bodies > set_.cells) place_bodies(rigid_, type_, set_, set_.cells, set_.bodies, {templates.vertices, templates.triangles});
  Kokkos::deep_copy(images_.laps_then, images_.laps);
  update(cells);
}

bool JoinedSurfaces::turned() const {
  const auto now = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), images_.laps);
  const auto then = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), images_.laps_then);
  for (int body = 0; body < rigid_.bodies; ++body)
    for (int d = 0; d < 3; ++d)
      if (now(body, d) != then(body, d)) return true;
  return false;
}

void JoinedSurfaces::update(const SurfaceSet& cells) const { join_positions(cells, rigid_, images_, set_); }

void JoinedSurfaces::give_back(const SurfaceSet& cells) const { copy_vertices(cells.own_vertices, set_.x, cells.x); }

}  // namespace corpuscle
