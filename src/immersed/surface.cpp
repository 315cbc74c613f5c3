#include "immersed/surface.hpp"

#include <fmt/format.h>

#include "immersed/surface_geometry.hpp"

namespace corpuscle {

namespace {

void allocate(SurfaceSet& set, const std::vector<TriangleMesh>& bodies, int cells) {
  set.bodies = int(bodies.size());
  set.cells = set.own_cells = cells;
  for (const TriangleMesh& mesh : bodies) {
    set.vertices += int(mesh.vertices.size());
    set.triangles += int(mesh.triangles.size());
  }
  for (int c = 0; c < cells; ++c) set.own_vertices += int(bodies[c].vertices.size());
  const auto label = [](const char* name) { return uninitialised(std::string("corpuscle::surface::") + name); };
  set.x = Components<double>(label("x_vertex"), set.vertices, 3);
  set.v = Components<double>("corpuscle::surface::v_vertex", set.vertices, 3);
  set.normal = Components<double>(label("normal_vertex"), set.vertices, 3);
  set.area = Array<double>(label("area_vertex"), set.vertices);
  set.place_triangle = Table<int>(label("place_triangle"), set.triangles, 3);
  set.place_neighbour = Table<int>(label("place_neighbour"), set.triangles, 3);
  set.vertex_body = Array<int>(label("vertex_body"), set.vertices + 1);
  set.triangle_body = Array<int>(label("triangle_body"), set.triangles);
  set.first_vertex = Array<int>(label("first_vertex"), set.bodies + 1);
  set.first_triangle = Array<int>(label("first_triangle"), set.bodies + 1);
  set.to_place = Table<int>("corpuscle::surface::to_place", set.bodies + 1, 2);  // numbers are places
  set.place_ring_start = Array<int>(label("place_ring_start"), set.vertices + 1);
  set.place_ring_triangle = Array<int>(label("place_ring_triangle"), 3 * set.triangles);
  set.place_ring_corner = Array<std::int8_t>(label("place_ring_corner"), 3 * set.triangles);
  set.number = Array<int>(label("number_body"), set.bodies);
}

/// Host images of a set's arrays, filled body by body and then copied to the device.
struct HostSet {
  template <class View>
  static auto mirror(const View& view) {
    return Kokkos::create_mirror_view(view);
  }
  explicit HostSet(const SurfaceSet& set)
      : x(mirror(set.x)),
        triangle(mirror(set.place_triangle)),
        neighbour(mirror(set.place_neighbour)),
        vertex_body(mirror(set.vertex_body)),
        triangle_body(mirror(set.triangle_body)),
        first_vertex(mirror(set.first_vertex)),
        first_triangle(mirror(set.first_triangle)),
        ring_start(mirror(set.place_ring_start)),
        ring_triangle(mirror(set.place_ring_triangle)),
        ring_corner(mirror(set.place_ring_corner)),
        number(mirror(set.number)),
        cells(set.cells) {}

  void add(const TriangleMesh& mesh, int body) {
    const int v0 = vertices, t0 = triangles;
    number(body) = body < cells ? body : body - cells;
    first_vertex(body) = v0;
    first_triangle(body) = t0;
    const auto neighbours = triangle_neighbours(mesh);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t, ++triangles) {
      for (int k = 0; k < 3; ++k) {
        triangle(triangles, k) = v0 + mesh.triangles[t][k];
        neighbour(triangles, k) = t0 + neighbours[t][k];
      }
      triangle_body(triangles) = body;
    }
    const auto rings = vertex_rings(mesh, neighbours);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i, ++vertices) {
      for (int d = 0; d < 3; ++d) x(vertices, d) = mesh.vertices[i][d];
      vertex_body(vertices) = body;
      ring_start(vertices) = entries;
      for (int t : rings[i]) {
        const auto& c = mesh.triangles[t];
        ring_triangle(entries) = t0 + t;
        ring_corner(entries++) = static_cast<std::int8_t>(c[0] == int(i) ? 0 : (c[1] == int(i) ? 1 : 2));
      }
    }
    ring_start(vertices) = entries;
    vertex_body(vertices) = body + 1;
    first_vertex(body + 1) = vertices;
    first_triangle(body + 1) = triangles;
  }

  void copy_to(const SurfaceSet& set) const {
    Kokkos::deep_copy(set.x, x);
    Kokkos::deep_copy(set.place_triangle, triangle);
    Kokkos::deep_copy(set.place_neighbour, neighbour);
    Kokkos::deep_copy(set.vertex_body, vertex_body);
    Kokkos::deep_copy(set.triangle_body, triangle_body);
    Kokkos::deep_copy(set.first_vertex, first_vertex);
    Kokkos::deep_copy(set.first_triangle, first_triangle);
    Kokkos::deep_copy(set.place_ring_start, ring_start);
    Kokkos::deep_copy(set.place_ring_triangle, ring_triangle);
    Kokkos::deep_copy(set.place_ring_corner, ring_corner);
    Kokkos::deep_copy(set.number, number);
  }

  int vertices = 0, triangles = 0, entries = 0;
  HostMirror<Components<double>> x;
  HostMirror<Table<int>> triangle, neighbour;
  HostMirror<Array<int>> vertex_body, triangle_body, first_vertex, first_triangle, ring_start, ring_triangle;
  HostMirror<Array<std::int8_t>> ring_corner;
  HostMirror<Array<int>> number;
  int cells;
};

}  // namespace

SurfaceSet make_surface_set(const std::vector<TriangleMesh>& bodies, int cells) {
  for (std::size_t b = 0; b < bodies.size(); ++b) check_closed_surface(bodies[b], fmt::format("of body {}", b));
  SurfaceSet set;
  allocate(set, bodies, cells);
  if (bodies.empty()) {
    Kokkos::deep_copy(set.first_vertex, 0);
    Kokkos::deep_copy(set.first_triangle, 0);
    Kokkos::deep_copy(set.place_ring_start, 0);
    Kokkos::deep_copy(set.vertex_body, 0);
    return set;
  }
  HostSet host(set);
  for (std::size_t b = 0; b < bodies.size(); ++b) host.add(bodies[b], int(b));
  host.copy_to(set);
  update_surface_geometry(set);
  return set;
}

std::string CellNames::of(int number) const {
  int within = number - listed;
  for (std::size_t p = 0; p < count.size() && within >= 0; ++p) {
    if (within < count[p]) return fmt::format("populations.{} cell {}", p, within);
    within -= count[p];
  }
  return fmt::format("cells.{}", number);
}

std::string body_name(const SurfaceSet& surfaces, int body) {
  const auto number = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.number);
  if (body < surfaces.cells && surfaces.names) return surfaces.names->of(number(body));
  return (body < surfaces.cells ? "cells." : "bodies.") + std::to_string(number(body));
}

HostMirror<Table<int>> triangles_on_host(const SurfaceSet& set) {
  const SurfaceSet s = set;
  const Table<int> vertices(uninitialised("corpuscle::surface::triangles"), s.triangles, 3);
  Kokkos::parallel_for(
      "corpuscle::surface::triangles", Policy(0, s.triangles), KOKKOS_LAMBDA(int t) {
        for (int k = 0; k < 3; ++k) vertices(t, k) = s.triangle(t, k);
      });
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), vertices);
}

TriangleMesh body_mesh(const SurfaceSet& surfaces, int body) {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.x);
  const auto triangle = triangles_on_host(surfaces);
  const auto first_vertex = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.first_vertex);
  const auto first_triangle = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.first_triangle);
  TriangleMesh mesh;
  const int v0 = first_vertex(body);
  for (int i = v0; i < first_vertex(body + 1); ++i) mesh.vertices.push_back({x(i, 0), x(i, 1), x(i, 2)});
  for (int t = first_triangle(body); t < first_triangle(body + 1); ++t) {
    mesh.triangles.push_back({triangle(t, 0) - v0, triangle(t, 1) - v0, triangle(t, 2) - v0});
  }
  return mesh;
}

}  // namespace corpuscle
