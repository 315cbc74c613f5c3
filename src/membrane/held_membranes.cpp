// Membranes of the cells that a rank holds at present.
#include <algorithm>

#include "cells/topology.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane/membrane_viscosity.hpp"
#include "membrane/membranes.hpp"

namespace corpuscle {

namespace {

/// Some to spare, so that arrays are seldom too small.
std::size_t roomy(std::size_t count) { return count + count / 64 + 1; }

template <class View>
bool has_room(const View& view, std::size_t rows) {
  return view.data() && view.extent(0) >= rows;
}

/// @param columns  of the view, if it has two dimensions
template <class View, class... Columns>
void grow(View& view, const char* name, std::size_t rows, Columns... columns) {
  if (has_room(view, rows)) return;
  view = View();  // free before taking more
  view = View(uninitialised(std::string("corpuscle::membrane::") + name), roomy(rows), columns...);
}

/// With its content.
template <class Real>
void extend(Components<Real>& view, const char* name, std::size_t rows) {
  if (has_room(view, rows)) return;
  const Components<Real> before = view;
  view = Components<Real>(std::string("corpuscle::membrane::") + name, roomy(rows), 3);
  if (!before.data()) return;
  const auto all = std::make_pair(std::size_t(0), before.extent(0));
  Kokkos::deep_copy(Kokkos::subview(view, all, Kokkos::ALL), before);
}

void fill(const Array<int>& view, const std::vector<int>& values) {
  const auto part = Kokkos::subview(view, std::make_pair(std::size_t(0), values.size()));
  const auto host = Kokkos::create_mirror_view(part);
  std::copy(values.begin(), values.end(), host.data());
  Kokkos::deep_copy(part, host);
}

/// At most eight, none so small that some of the threads would have nothing to do.
/// @param first_vertex    [cell + 1]
/// @param first_triangle  [cell + 1]
std::vector<CellPart> cut(int cells, const std::vector<int>& first_vertex, const std::vector<int>& first_triangle) {
  constexpr int most = 8, fewest_cells = 16, for_a_team = 8, most_teams = 128;
  const int smallest = std::max(fewest_cells, for_a_team * std::min(Exec().concurrency(), most_teams));
  const int count = std::max(1, std::min(most, cells / smallest));
  std::vector<CellPart> parts;
  for (int p = 0; p < count; ++p) {
    const int first = static_cast<int>(static_cast<long>(cells) * p / count),
              last = static_cast<int>(static_cast<long>(cells) * (p + 1) / count);
    parts.push_back({first, last - first, first_vertex[first], first_vertex[last] - first_vertex[first], first_triangle[first],
                     first_triangle[last] - first_triangle[first]});
  }
  return parts;
}

}  // namespace

void MembraneViscosity::hold(const MembraneViews& m, const std::vector<CellPart>& parts) {
  parts_ = parts;
  extend(given_, "given_vertex", m.vertices);
  extend(past_, "past_vertex", m.vertices);
  extend(taken_, "taken_vertex", m.vertices);
  grow(views_.iterations, "iterations_cell", m.cells);
  Kokkos::deep_copy(views_.iterations, 0);
}

Membranes::Membranes(const std::vector<CellReference>& types, std::shared_ptr<Workspace> workspace)
    : types_(types), workspace_(std::move(workspace)) {
  std::vector<TriangleMesh> meshes;
  for (const CellReference& type : types_) meshes.push_back(type.mesh);
  templates_ = make_surface_set(meshes);
  SurfaceSet none = make_surface_set({});
  none.place_triangle = templates_.place_triangle, none.place_neighbour = templates_.place_neighbour;
  none.place_ring_start = templates_.place_ring_start;
  none.place_ring_triangle = templates_.place_ring_triangle, none.place_ring_corner = templates_.place_ring_corner;
  views_ = make_membrane_views(none, types_, {});
  make_viscosity();
  if (viscosity_) viscosity_->prepare(types_);
  status_host_ = HostCopy(views_.status);
  hold({}, 0);
}

void Membranes::call(const CellNames& names) {
  names_ = names;
  views_.surface.names = &names_;
}

namespace {

bool type_holds_area(const CellReference& type) {
  return type.law.area > 0 || std::visit([](const auto& law) { return law.holds_area; }, type.in_plane);
}

}  // namespace

bool Membranes::any_holds_area() const { return std::any_of(types_.begin(), types_.end(), type_holds_area); }

/// What messages, the history and the sub-steps ask of each cell.
void Membranes::describe_cells(const std::vector<HeldCell>& cells, int own) {
  law_.clear(), vertex_mass_.clear(), vertex_area_.clear(), rest_area_.clear(), rest_volume_.clear(), number_.clear();
  holds_area_.clear();
  for (int c = 0; c < own; ++c) {
    const CellReference& type = types_[cells[c].type];
    law_.push_back(type.in_plane);
    vertex_mass_.push_back(type.law.vertex_mass);
    vertex_area_.push_back(type.smallest_vertex_area);
    rest_area_.push_back(type.law.rest_area);
    rest_volume_.push_back(type.law.rest_volume);
    number_.push_back(cells[c].number);
    holds_area_.push_back(type_holds_area(type));
  }
}

void Membranes::rest_at_size(double size) {
  fill_reference(views_, types_, size);
  size_ = size;
}

std::unique_ptr<Membranes> Membranes::only(const std::vector<int>& numbers) const {
  auto few = std::make_unique<Membranes>(types_, std::make_shared<Workspace>());
  const auto type = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.type);
  std::vector<HeldCell> cells;
  for (int c : cells_of(numbers)) cells.push_back({type(c), number(c)});
  few->rest_at_size(size_);
  few->make_law_ = make_law_;
  few->hold(cells, static_cast<int>(cells.size()));
  if (cells.empty()) return few;
  const Components<double> x = rows_of(numbers, views_.surface.x);
  Kokkos::deep_copy(Kokkos::subview(few->views_.surface.x, std::make_pair(std::size_t(0), x.extent(0)), Kokkos::ALL), x);
  return few;
}

Components<double> Membranes::rows_of(const std::vector<int>& numbers, const Components<double>& values) const {
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.first_vertex);
  const std::vector<int> cells = cells_of(numbers);
  std::size_t vertices = 0;
  for (int c : cells) vertices += first(c + 1) - first(c);
  const Components<double> rows(uninitialised("corpuscle::membrane::rows_vertex"), vertices, 3);
  std::size_t at = 0;
  for (int c : cells) {
    const std::size_t count = first(c + 1) - first(c);
    Kokkos::deep_copy(Kokkos::subview(rows, std::make_pair(at, at + count), Kokkos::ALL),
                      Kokkos::subview(values, std::make_pair(std::size_t(first(c)), std::size_t(first(c + 1))), Kokkos::ALL));
    at += count;
  }
  return rows;
}

void Membranes::make_room(const SurfaceSet& needed) {
  SurfaceSet& set = views_.surface;
  extend(set.x, "x_vertex", needed.vertices);
  extend(set.v, "v_vertex", needed.vertices);
  grow(set.normal, "normal_vertex", needed.vertices, 3);
  grow(set.area, "area_vertex", needed.vertices);
  grow(set.vertex_body, "vertex_body", needed.vertices + 1);
  grow(set.triangle_body, "triangle_body", needed.triangles);
  grow(set.to_place, "to_place", needed.bodies + 1, 2);
  grow(set.first_vertex, "first_vertex", needed.bodies + 1);
  grow(set.first_triangle, "first_triangle", needed.bodies + 1);
  grow(set.number, "number_body", needed.bodies);
  grow(views_.type, "type_body", needed.bodies);
  grow(views_.totals, "totals_section", std::size_t(views_.cells) * sections, 2);
  grow(views_.force, "force_vertex", needed.vertices, 3);
  grow(motion_.sums, "motion_sums_section", std::size_t(views_.cells) * sections, 2);
  grow(motion_.volume, "motion_volume_cell", std::size_t(views_.cells));
  grow(start_x_, "start_x_vertex", views_.vertices, 3);
}

/// What is only of use within a call lies where others have such things in between: forces of a part's corners, or directions. The
/// triangles' geometry is kept there from compute_forces() on, until the forces are on their way.
void Membranes::take_workspace() {
  if (!workspace_) return;
  const std::size_t triangles = views_.triangles, vertices = views_.vertices;
  std::size_t of_part = 0;
  for_parts(views_, parts_, [&](const MembraneViews& part) { of_part = std::max<std::size_t>(of_part, part.triangles); });
  workspace_->keep(4 * triangles);
  double* memory = workspace_->reserve(std::max(9 * of_part, 3 * vertices));
  views_.corner_force = Table<double>(memory, of_part, 9);
  motion_.direction = Components<double>(memory, vertices, 3);
  views_.triangle_geometry = Table<double>(workspace_->keep(4 * triangles), triangles, 4);
}

/// The triangles' geometry where it is at present, measured again if it was let go.
void Membranes::take_geometry() {
  if (!workspace_) return;
  const bool known = workspace_->kept() > 0;
  if (viscosity_) {
    workspace_->keep(4 * static_cast<std::size_t>(views_.triangles));
    viscosity_->reserve(views_, *workspace_);  // which may move it
  }
  take_workspace();
  if (!known) measure_membranes(views_, views_.surface.x);
}

void Membranes::forget_geometry() {
  if (workspace_) workspace_->release();
}

void Membranes::hold(const std::vector<HeldCell>& cells, int own) {
  SurfaceSet& set = views_.surface;
  std::vector<int> type, number, first_vertex{0}, first_triangle{0};
  for (const HeldCell& cell : cells) {
    type.push_back(cell.type);
    number.push_back(cell.number);
    first_vertex.push_back(first_vertex.back() + int(types_[cell.type].mesh.vertices.size()));
    first_triangle.push_back(first_triangle.back() + int(types_[cell.type].mesh.triangles.size()));
  }
  type_of_own_.assign(type.begin(), type.begin() + own);
  set.bodies = set.cells = int(cells.size());
  set.own_cells = own;
  set.vertices = first_vertex.back();
  set.triangles = first_triangle.back();
  set.own_vertices = first_vertex[own];
  views_.cells = own;
  views_.vertices = first_vertex[own];
  views_.triangles = first_triangle[own];
  make_room(set);
  forget_geometry();
  fill(set.first_vertex, first_vertex);
  fill(set.first_triangle, first_triangle);
  fill(set.number, number);
  fill(views_.type, type);
  if (set.bodies > 0) place_bodies(templates_, views_.type, set, 0, set.bodies);
  parts_ = cut(own, first_vertex, first_triangle);
  if (viscosity_) viscosity_->hold(views_, parts_);
  describe_cells(cells, own);
  stiffness_.clear();
  elasticity_ = make_law_(types_, type_of_own_);
}

}  // namespace corpuscle
