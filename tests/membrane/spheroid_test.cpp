// Cells whose sheet rests on a spheroid, relaxed to the biconcave shape.
#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/spheroid_reference.hpp"
#include "membrane/surface_shape.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

constexpr double pi = 3.14159265358979323846;

CellSettings on_a_spheroid(double reduced_volume, CellSettings::Law law = CellSettings::Law::wlc_pow, int vertices = 500) {
  CellSettings cell = cell_settings(vertices);
  cell.law = law;
  if (law != CellSettings::Law::wlc_pow) cell.local_area_modulus_uN_per_m = 0;
  cell.reference = CellSettings::Reference::spheroid;
  cell.reference_reduced_volume = reduced_volume;
  return cell;
}

double side(const TriangleMesh& mesh, int t, int k) {
  const Triple &a = mesh.vertices[mesh.triangles[t][(k + 1) % 3]], &b = mesh.vertices[mesh.triangles[t][(k + 2) % 3]];
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

TEST_CASE("an oblate spheroid of given area and reduced volume") {
  for (double v : {0.65, 0.8, 0.93, 0.97, 1.0}) {
    INFO("reduced volume " << v);
    const Triple axes = oblate_semi_axes(134, v);
    CHECK(axes[0] == axes[1]);
    CHECK(axes[2] <= axes[0] * (1 + 1e-12));
    // The other side of the program has the area by summing over latitudes, to about 1e-6.
    CHECK(EllipsoidShape(axes).area() == Approx(134).epsilon(1e-5));
    const double volume = 4 * pi / 3 * axes[0] * axes[0] * axes[2];
    CHECK(6 * std::sqrt(pi) * volume / std::pow(134, 1.5) == Approx(v).epsilon(1e-9));
  }
}

TEST_CASE("the biconcave mesh goes to the spheroid by equal shares of area") {
  const TriangleMesh cell = biconcave_mesh(500), spheroid = on_spheroid(cell, 7.82, 0.95);
  CHECK(spheroid.triangles == cell.triangles);
  CHECK(area(spheroid) == Approx(area(cell)).epsilon(1e-12));
  const Triple axes = oblate_semi_axes(BiconcaveShape().area(), 0.95);
  double scale = 0;
  for (std::size_t i = 0; i < cell.vertices.size(); ++i) {
    const Triple &p = spheroid.vertices[i], &q = cell.vertices[i];
    const double r = std::hypot(p[0], p[1]);
    const double level = std::sqrt(r * r / (axes[0] * axes[0]) + p[2] * p[2] / (axes[2] * axes[2]));
    if (i == 0) scale = level;
    REQUIRE(level == Approx(scale).epsilon(1e-9));             // all on one spheroid
    REQUIRE(p[0] * q[1] == Approx(p[1] * q[0]).margin(1e-9));  // the same longitude
  }
  CHECK(scale == Approx(1).epsilon(0.01));  // triangles inside a sphere and inside the cell lack the same area but for 0.3 %
  // Each triangle has about its own area, chords aside, while sides along the equator shorten with the radius there.
  double area_change = 0, side_change = 0;
  for (int t = 0; t < int(cell.triangles.size()); ++t) {
    const auto one = [&](const TriangleMesh& m) {
      const auto& c = m.triangles[t];
      return area({{m.vertices[c[0]], m.vertices[c[1]], m.vertices[c[2]]}, {{0, 1, 2}}});
    };
    area_change = std::max(area_change, std::abs(one(spheroid) / one(cell) - 1));
    for (int k = 0; k < 3; ++k) side_change = std::max(side_change, std::abs(side(spheroid, t, k) / side(cell, t, k) - 1));
  }
  report("largest change of a triangle's area {:.3f}, of a side {:.3f}", area_change, side_change);
  CHECK(area_change < 0.03);
  CHECK(side_change == Approx(1 - axes[0] / 3.91).margin(0.02));
  // Of another size: the same, scaled.
  TriangleMesh half = cell;
  for (Triple& p : half.vertices)
    for (double& c : p) c *= 0.5;
  const TriangleMesh small = on_spheroid(half, 3.91, 0.95);
  for (std::size_t i = 0; i < small.vertices.size(); ++i)
    for (int d = 0; d < 3; ++d) REQUIRE(small.vertices[i][d] == Approx(0.5 * spheroid.vertices[i][d]).margin(1e-9));
}

TEST_CASE("a cell whose sheet rests on a spheroid is a biconcave disc at rest, of the biconcave cell's volume") {
  using Law = CellSettings::Law;
  const double v = GENERATE(0.93, 0.97);
  const Law law = GENERATE(Law::wlc_pow, Law::skalak);
  INFO("reduced volume " << v << ", law " << int(law));
  const CellSettings cell = on_a_spheroid(v, law);
  const TriangleMesh biconcave = biconcave_mesh(500), spheroid = on_spheroid(biconcave, 7.82, v);
  const CellReference r = make_reference(cell);
  for (int t : {0, 400, 995})
    for (int k = 0; k < 3; ++k) CHECK(r.rest_length[t][k] == Approx(side(spheroid, t, k)).epsilon(1e-12));
  // Equation 13, the same everywhere: 500 vertices as in forces_test.
  CHECK(r.rest_angle[7][1] == Approx(6.958 * pi / 180).epsilon(1e-4));
  CHECK(r.rest_angle[7] == r.rest_angle[800]);
  CHECK(r.law.rest_area == area(biconcave));
  CHECK(r.law.rest_volume == volume(biconcave));
  CHECK(volume(r.mesh) == Approx(r.law.rest_volume).epsilon(2e-7));
  CHECK(area(r.mesh) == Approx(r.law.rest_area).epsilon(5e-3));  // held by its modulus alone
  REQUIRE(r.relaxed);
  CHECK(r.relaxed->biconcave());
  report("v {}, law {}: {} iterations, {:.2f} um, {:.2f} at the centre, {:.2f} at most, dimples {:.2f} {:.2f}", v, int(law),
         r.relaxed->iterations, r.relaxed->diameter, r.relaxed->thickness_center, r.relaxed->thickness_max, r.relaxed->dimple[0],
         r.relaxed->dimple[1]);
  // Measured cells (Evans & Fung 1972): 7.82 +- 0.62 um wide, 0.81 +- 0.35 and 2.58 +- 0.27 um thick.
  CHECK(r.relaxed->diameter == Approx(7.82).margin(0.62));
  CHECK(r.relaxed->thickness_center == Approx(0.81).margin(0.35));
  CHECK(r.relaxed->thickness_max == Approx(2.58).margin(0.4));
  CHECK(r.relaxed->dimple[0] == Approx(r.relaxed->dimple[1]).epsilon(0.02));

  // At rest: what force is left is a pressure, which the volume answers.
  Membranes m({cell});
  m.compute_forces();
  const auto x = to_host(m.surfaces().x, m.vertices()), force = to_host(m.views().force, m.vertices());
  std::vector<Vec3> push(m.vertices());
  for (const auto& t : r.mesh.triangles)
    for (int k = 0; k < 3; ++k) push[t[k]] += (1.0 / 6) * cross(x[t[(k + 1) % 3]], x[t[(k + 2) % 3]]);  // dV/dx
  double along = 0, square = 0, most = 0;
  for (int i = 0; i < m.vertices(); ++i) along += dot(force[i], push[i]), square += dot(push[i], push[i]);
  for (int i = 0; i < m.vertices(); ++i) most = std::max(most, norm(force[i] - (along / square) * push[i]));
  CHECK(most < 2e-5 * 6.32e-3 * 0.55);  // 1e-5 of modulus x edge is left by the relaxation
  for (int n = 0; n < 20; ++n) m.advance(5);
  double moved = 0;
  const auto after = to_host(m.surfaces().x, m.vertices());
  for (int i = 0; i < m.vertices(); ++i) moved = std::max(moved, norm(after[i] - x[i]));
  CHECK(moved < 1e-3);  // um in 100 us, without any fluid to hold it
}

TEST_CASE("the relaxed cell is the same every time, and its cells share it") {
  const CellReference a = make_reference(on_a_spheroid(0.95)), b = make_reference(on_a_spheroid(0.95));
  CHECK(a.mesh.vertices == b.mesh.vertices);
  CellSettings first = on_a_spheroid(0.95), second = first;
  second.center_um = {9, 0, 0};
  CHECK(same_type(first, second));
  second.reference_reduced_volume = 0.96;
  CHECK_FALSE(same_type(first, second));
}

TEST_CASE("a cell that does not come to rest on a spheroid is refused") {
  CellSettings cell = on_a_spheroid(1, CellSettings::Law::wlc_pow, 200);
  cell.local_area_modulus_uN_per_m = 1e5;
  cell.shear_modulus_uN_per_m = 1e-3;
  CHECK_THROWS_WITH(make_reference(cell), Catch::Matchers::Contains("cells.reference = \"spheroid\"") &&
                                              Catch::Matchers::Contains("does not come to rest") &&
                                              Catch::Matchers::Contains("cells.reference_reduced_volume = 1 nearer"));
}
