// Where populations put their cells: clear of everything, the same on any number of ranks, and refused with a figure that holds.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "cells/rank_blocks.hpp"
#include "core/error.hpp"
#include "immersed/triangle.hpp"
#include "populations/first_places.hpp"
#include "populations/populations.hpp"

using namespace corpuscle;
using Generator = GridSettings::Generator;

namespace {

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

CellTypeSettings red_cell(double diameter_um = 7.82) {
  CellTypeSettings type;
  type.name = "rbc";
  type.cell.type = 0;
  type.cell.vertices = 200;
  type.cell.diameter_um = diameter_um;
  return type;
}

/// A box with one population of small red cells, 3.91 um wide, which have 11.6 um3.
Case box_of(const Triple& size, double hematocrit) {
  Case scene;
  GridSettings grid;
  grid.nodes = {9, 9, 9};
  grid.upper_um = size;
  scene.grid = grid;
  scene.cell_types = {red_cell(3.91)};
  PopulationSettings population;
  population.hematocrit = hematocrit;
  scene.populations = {population};
  return scene;
}

struct Packed {
  Grid grid;
  CellPlaces places;
  std::vector<TriangleMesh> meshes;

  Packed(const Case& scene, const std::array<bool, 3>& periodic, const Comm& comm = Comm())
      : grid(comm, make_node_source(*scene.grid), periodic), places(find_places(scene, grid)) {
    for (const CellPlace& cell : places.cells)
      meshes.push_back(transform(places.types[cell.type].mesh, cell.axis, cell.spin_deg, cell.center_um));
  }
  std::size_t cells() const { return meshes.size(); }

  /// Least distance of any vertex of one cell to any triangle of another or of an image, um.
  double smallest_gap() const {
    double least = 1e300;
    for (std::size_t a = 0; a < meshes.size(); ++a)
      for (std::size_t b = 0; b < meshes.size(); ++b)
        for (const Vec3& shift : period_shifts(grid)) {
          const Vec3 apart = vec(places.cells[a].center_um) - vec(places.cells[b].center_um) - shift;
          const double distance = norm(apart);
          if (distance < 1e-12 || distance > radius(meshes[a], a) + radius(meshes[b], b) + 0.3) continue;
          least = std::min(least, gap(meshes[a], meshes[b], shift));
        }
    return least;
  }

 private:
  double radius(const TriangleMesh& mesh, std::size_t cell) const {
    double most = 0;
    for (const Triple& x : mesh.vertices) most = std::max(most, norm(vec(x) - vec(places.cells[cell].center_um)));
    return most;
  }
  static double gap(const TriangleMesh& a, const TriangleMesh& b, const Vec3& shift) {
    double least = 1e300;
    for (const Triple& vertex : a.vertices)
      for (const auto& t : b.triangles) {
        const Vec3 p = vec(vertex) - shift, x = vec(b.vertices[t[0]]), y = vec(b.vertices[t[1]]), z = vec(b.vertices[t[2]]);
        const TrianglePoint at = closest_on_triangle(p, x, y, z);
        least = std::min(least, norm(p - (at.weight[0] * x + at.weight[1] * y + at.weight[2] * z)));
      }
    return least;
  }
};

/// Whether a point lies inside a mesh: its winding number.
bool inside(const TriangleMesh& mesh, const Vec3& p) {
  double angle = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = vec(mesh.vertices[t[0]]) - p, b = vec(mesh.vertices[t[1]]) - p, c = vec(mesh.vertices[t[2]]) - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    angle += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return angle > 2 * std::acos(-1.0);
}

void check_none_inside(const Packed& packed) {
  for (std::size_t a = 0; a < packed.cells(); ++a)
    for (std::size_t b = 0; b < packed.cells(); ++b)
      for (const Vec3& shift : period_shifts(packed.grid))
        if (a != b) CHECK_FALSE(inside(packed.meshes[b], vec(packed.meshes[a].vertices[0]) - shift));
}

std::string refusal(const Case& scene, const std::array<bool, 3>& periodic) {
  try {
    Packed packed(scene, periodic);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a population of 45 % lies clear of itself through periodic sides and of walls") {
  for (const int periodic : {3, 2, 1, 0}) {
    INFO(periodic << " periodic directions");
    const Triple size{7.6, 7.2, 7.4};
    Case scene = box_of(size, periodic > 1 ? 0.45 : 0.35);  // corners take room
    const Packed packed(scene, {periodic > 0, periodic > 1, periodic > 2});
    const double share = packed.cells() * packed.places.types[0].law.rest_volume / packed.grid.total_volume();
    CHECK(share == Approx(scene.populations[0].hematocrit).margin(0.5 * 11.6 / packed.grid.total_volume()));
    CHECK(packed.smallest_gap() >= 0.1);
    check_none_inside(packed);
    for (const auto& mesh : packed.meshes)
      for (const Triple& x : mesh.vertices)
        for (int d = periodic; d < 3; ++d) {
          CHECK(x[d] >= 0.1);
          CHECK(x[d] <= size[d] - 0.1);
        }
  }
}

TEST_CASE("cells stay inside tubes, straight and bent") {
  Case scene = box_of({}, 0.3);
  GridSettings& grid = *scene.grid;
  grid.nodes = {17, 17, 25};
  grid.diameter_um = 7;
  SECTION("straight, periodic") {
    grid.generator = Generator::straight_tube;
    grid.length_um = 12;
    const Packed packed(scene, {false, false, true});
    CHECK(packed.cells() == 12);
    CHECK(packed.smallest_gap() >= 0.1);
    for (const auto& mesh : packed.meshes)
      for (const Triple& x : mesh.vertices) CHECK(std::hypot(x[0], x[1]) <= 3.5 - 0.1);
  }
  SECTION("a quarter of a ring, closed at both ends") {
    grid.generator = Generator::swept_tube;
    grid.centerline = GridSettings::Centerline::arc;
    grid.arc_radius_um = 10;
    grid.arc_angle_deg = 90;
    const Packed packed(scene, {false, false, false});
    CHECK(packed.cells() > 10);
    CHECK(packed.smallest_gap() >= 0.1);
    for (const auto& mesh : packed.meshes)
      for (const Triple& x : mesh.vertices) {
        const double in_plane = std::hypot(10 - x[0], x[2]);
        CHECK(std::hypot(in_plane - 10, x[1]) <= 3.5 - 0.1);
        CHECK(x[2] >= 0.1);  // the first end is the plane z = 0, the last one x = 10
        CHECK(x[0] <= 10 - 0.1);
      }
  }
}

TEST_CASE("populations share a scene with placed cells, each within its box and with its directions") {
  Case scene = box_of({12, 10, 10}, 0.12);
  CellSettings placed = red_cell().cell;  // 7.82 um wide
  placed.type = -1;
  placed.center_um = {6, 5, 5};
  placed.axis = {1, 1, 0};
  scene.cells = {placed};
  scene.populations[0].upper_um = Triple{6, 10, 10};
  CellTypeSettings ball;
  ball.name = "ball";
  ball.cell.type = 1;
  ball.cell.shape = CellSettings::Shape::sphere;
  ball.cell.radius_um = 0.9;
  ball.cell.vertices = 60;
  scene.cell_types.push_back(ball);
  PopulationSettings aligned;
  aligned.type = 0;
  aligned.count = 6;
  aligned.orientation = PopulationSettings::Orientation::aligned;
  aligned.axis = {0, 3, 4};
  PopulationSettings balls;
  balls.type = 1;
  balls.count = 10;
  balls.gap_um = 0.3;
  scene.populations.push_back(aligned);
  scene.populations.push_back(balls);
  const Packed packed(scene, {true, true, true});
  const auto& count = packed.places.names.count;
  REQUIRE(count.size() == 3);
  CHECK(count[1] == 6);
  CHECK(packed.cells() == 1u + count[0] + 16u);
  CHECK(packed.smallest_gap() >= 0.1);
  check_none_inside(packed);
  CHECK(packed.places.cells[0].center_um == placed.center_um);
  for (int c = 1; c <= count[0]; ++c)
    for (const Triple& x : packed.meshes[c].vertices) CHECK(x[0] <= 6);
  for (int c = 1 + count[0]; c <= count[0] + 6; ++c) {
    CHECK(packed.places.cells[c].axis[1] == Approx(0.6));
    CHECK(packed.places.cells[c].axis[2] == Approx(0.8));
  }
  CHECK(packed.places.names.of(0) == "cells.0");
  CHECK(packed.places.names.of(1) == "populations.0 cell 0");
  CHECK(packed.places.names.of(2 + count[0]) == "populations.1 cell 1");
}

TEST_CASE("cells are packed the same on any number of ranks, and by the seed", "[ranks]") {
  Case scene = box_of({8.1, 9.3, 10.7}, 0.3);  // volumes of its cells add up differently on different ranks
  const Packed one(scene, {true, true, false}, Comm::alone()), all(scene, {true, true, false});
  REQUIRE(one.cells() == all.cells());
  const auto same = [](const CellPlace& a, const CellPlace& b) {
    return a.center_um == b.center_um && a.axis == b.axis && a.spin_deg == b.spin_deg;
  };
  for (std::size_t c = 0; c < one.cells(); ++c) CHECK(same(one.places.cells[c], all.places.cells[c]));
  scene.populations[0].seed = 2;
  const Packed other(scene, {true, true, false});
  REQUIRE(other.cells() == all.cells());
  CHECK_FALSE(same(other.places.cells[0], all.places.cells[0]));
}

TEST_CASE("what does not fit is refused with what does") {
  Case scene = box_of({7, 7, 7}, 0.68);
  const std::string text = refusal(scene, {false, false, false});
  CHECK_THAT(text, Catch::Contains("populations.0.hematocrit = 0.68") && Catch::Contains("do not fit") && Catch::Contains("gap_um"));
  const auto at = text.find("do not fit, ");
  REQUIRE(at != std::string::npos);
  const int fits = std::atoi(text.c_str() + at + 12);
  CHECK(fits >= 6);
  CHECK(fits < 20);
  scene.populations[0].hematocrit = 0;
  scene.populations[0].count = fits - 1;  // found another way, so one less
  CHECK(refusal(scene, {false, false, false}) == "accepted");
  scene.populations[0].count = 0;
  scene.populations[0].hematocrit = 0.01;
  CHECK_THAT(refusal(scene, {false, false, false}), Catch::Contains("less than half a cell"));
  scene.populations[0].hematocrit = 0.8;
  CHECK_THAT(refusal(scene, {false, false, false}), Catch::Contains("more than fit"));
}

TEST_CASE("a rotation is one of [[cells]] and back") {
  Chance chance(3);
  for (int n = 0; n < 50; ++n) {
    const Rotation before = chance.rotation();
    Triple axis;
    double spin;
    set_direction(before, axis, spin);
    const Rotation after = rotation_of(axis, spin);
    const double same = before.w * after.w + before.x * after.x + before.y * after.y + before.z * after.z;
    CHECK(std::abs(same) == Approx(1).margin(1e-12));
  }
}

TEST_CASE("the distance from a packed shape is that from its surface") {
  CellSettings cell = red_cell().cell;
  const TriangleMesh mesh = make_reference(cell).mesh;
  const PackingShape shape(mesh, 0.4);
  Chance chance(5);
  int outside = 0;
  for (int n = 0; n < 3000; ++n) {
    const Vec3 p{10 * chance.share() - 5, 10 * chance.share() - 5, 4 * chance.share() - 2};
    double exact = 1e300;
    for (const auto& t : mesh.triangles) {
      const Vec3 x = vec(mesh.vertices[t[0]]), y = vec(mesh.vertices[t[1]]), z = vec(mesh.vertices[t[2]]);
      const TrianglePoint at = closest_on_triangle(p, x, y, z);
      exact = std::min(exact, norm(p - (at.weight[0] * x + at.weight[1] * y + at.weight[2] * z)));
    }
    const bool in = inside(mesh, p);
    double found;
    Vec3 gradient;
    if (!shape.distance(p, found, gradient)) {
      CHECK((!in && exact > 0.35));
      continue;
    }
    ++outside;
    // Linear between nodes 0.08 um apart: h^2 / (8 R) on the rim, R = 0.6 um, is 0.001, and more at the edges of the mesh.
    // Deep inside the surfaces of both sides meet, and nothing depends on it.
    if (exact < (in ? 0.1 : 0.4)) CHECK(found == Approx(in ? -exact : exact).margin(0.015));
    CHECK((found < 0.03) >= in);
  }
  CHECK(outside > 300);
}
