// Membranes and rigid bodies as one set of surfaces.
#include <catch2/catch.hpp>

#include "contact/joined_surfaces.hpp"
#include "surfaces.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

template <class View>
void require_same(const View& a, const View& b, int rows, int columns) {
  const auto of_a = on_host(a), of_b = on_host(b);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      if constexpr (View::rank == 1)
        REQUIRE(of_a(r) == of_b(r));
      else
        REQUIRE(of_a(r, c) == of_b(r, c));
}

/// All that tells how vertices and triangles hang together.
Array<int> connections(const SurfaceSet& set) {
  const SurfaceSet s = set;
  const int rings = 12 * s.triangles;
  const Array<int> all("corpuscle::test::connections", rings + s.vertices + 1);
  Kokkos::parallel_for(
      "corpuscle::test::of_triangles", Policy(0, s.triangles), KOKKOS_LAMBDA(int t) {
        for (int k = 0; k < 3; ++k) {
          const int entry = 3 * t + k;
          all(12 * t + k) = s.triangle(t, k);
          all(12 * t + 3 + k) = s.neighbour(t, k);
          all(12 * t + 6 + k) = s.ring_triangle(entry);
          all(12 * t + 9 + k) = s.ring_corner(entry);
        }
      });
  Kokkos::parallel_for(
      "corpuscle::test::of_vertices", Policy(0, s.vertices + 1), KOKKOS_LAMBDA(int v) { all(rings + v) = s.ring_start(v); });
  return all;
}

}  // namespace

TEST_CASE("cells and the images of rigid bodies are joined as if made together", "[contact][bodies]") {
  const TriangleMesh one = sphere_mesh(1, {0, 0, 0}, 0.5), other = sphere_mesh(2, {5, 0, 0}, 0.9);
  const TriangleMesh rock = sphere_mesh(1.5, {0, 4, 0}, 0.7), stone = sphere_mesh(0.9, {3, 3, 3}, 0.4);
  const auto moved = [](TriangleMesh mesh, const Vec3& by) {
    for (auto& x : mesh.vertices)
      for (int d = 0; d < 3; ++d) x[d] += by[d];
    return mesh;
  };
  const Vec3 shift{0, 0, 12};
  const SurfaceSet templates = make_surface_set({one, other}), cells = cells_of({other, one, other}),
                   rigid = make_surface_set({rock, stone});
  const SurfaceSet together = make_surface_set({other, one, other, rock, stone, moved(rock, shift)}, 3);
  const Array<int> type("corpuscle::test::type", 3);
  const auto host = Kokkos::create_mirror_view(type);
  host(0) = 1, host(1) = 0, host(2) = 1;
  Kokkos::deep_copy(type, host);
  const Table<int> laps("corpuscle::test::laps", 2, 3);
  const Vec3 period[3] = {{}, {}, shift};
  JoinedSurfaces joined(rigid, {{0, {}}, {1, {}}, {0, shift}}, laps, period);
  joined.take_up(cells, templates, type);
  const SurfaceSet& set = joined.set();
  REQUIRE(set.bodies == 6);
  REQUIRE(set.cells == 3);
  REQUIRE(set.vertices == together.vertices);
  REQUIRE(set.triangles == together.triangles);
  require_same(set.x, together.x, set.vertices, 3);
  require_same(set.vertex_body, together.vertex_body, set.vertices, 1);
  require_same(set.triangle_body, together.triangle_body, set.triangles, 1);
  require_same(set.first_vertex, together.first_vertex, set.bodies + 1, 1);
  require_same(set.first_triangle, together.first_triangle, set.bodies + 1, 1);
  require_same(connections(set), connections(together), 12 * set.triangles + set.vertices + 1, 1);
  CHECK(body_name(set, 4) == "bodies.1");
  CHECK(body_name(set, 5) == "bodies.0");

  // What moves later follows; what contact moves goes back to the cells.
  move_vertices(rigid, [](int, const Vec3& x) { return x + Vec3{0.5, 0, 0}; });
  joined.update(cells);
  const auto x = on_host(set.x), first = on_host(together.x);
  CHECK(load(x, set.vertices - 1).x == Approx(load(first, set.vertices - 1).x + 0.5));
  CHECK(load(x, set.vertices - 1).z == load(first, set.vertices - 1).z);

  // A body that comes back at the other end goes on here, until the images are taken up anew.
  move_vertices(rigid, [](int body, const Vec3& at) { return body == 0 ? at - Vec3{0, 0, 12} : at; });
  const auto turns = Kokkos::create_mirror_view(laps);
  turns(0, 2) = 1;
  Kokkos::deep_copy(laps, turns);
  CHECK(joined.turned());
  joined.update(cells);
  CHECK(load(on_host(set.x), set.vertices - 1).z == Approx(load(first, set.vertices - 1).z));
  joined.take_up(cells, templates, type);
  CHECK_FALSE(joined.turned());
  CHECK(load(on_host(set.x), set.vertices - 1).z == Approx(load(first, set.vertices - 1).z - 12));
}
