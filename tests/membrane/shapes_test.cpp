// The shapes that cell types can have, and what they rest on.
#include <catch2/catch.hpp>

#include "membrane/inertia.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

constexpr double pi = 3.14159265358979323846;

CellSettings sphere(double radius_um, int vertices) {
  CellSettings cell = cell_settings(vertices);
  cell.shape = CellSettings::Shape::sphere;
  cell.radius_um = radius_um;
  return cell;
}

}  // namespace

TEST_CASE("a sphere type has the sphere's area and volume, to the second order of its edges") {
  const double R = 3;
  double area_error[2], volume_error[2];
  const int vertices[2] = {320, 1280};
  for (int n = 0; n < 2; ++n) {
    const CellReference r = make_reference(sphere(R, vertices[n]));
    CHECK(int(r.mesh.vertices.size()) == vertices[n]);
    for (const Triple& p : r.mesh.vertices) REQUIRE(std::hypot(p[0], p[1], p[2]) == Approx(R).epsilon(1e-12));
    area_error[n] = 1 - r.law.rest_area / (4 * pi * R * R);
    volume_error[n] = 1 - r.law.rest_volume / (4 * pi / 3 * R * R * R);
  }
  // Chords lie inside: for equal triangles of edge e the area lacks 5 e^2 / (24 R^2), and e^2 = 8 pi R^2 / (sqrt(3) n).
  CHECK(area_error[0] == Approx(5 * pi / (3 * std::sqrt(3.0) * 320)).epsilon(0.03));
  CHECK(area_error[0] / area_error[1] == Approx(4).epsilon(0.05));
  CHECK(volume_error[0] / volume_error[1] == Approx(4).epsilon(0.05));
}

TEST_CASE("an ellipsoid type lies along its axes") {
  CellSettings cell = cell_settings(300);
  cell.shape = CellSettings::Shape::ellipsoid;
  cell.semi_axes_um = {3, 2, 1};
  const CellReference r = make_reference(cell);
  const Triple size = extents(r.mesh);
  for (int d = 0; d < 3; ++d) CHECK(size[d] == Approx(2 * cell.semi_axes_um[d]).epsilon(0.02));  // the mesh's edges: 0.1
  CHECK(r.law.rest_volume == Approx(4 * pi / 3 * 6).epsilon(0.03));
}

TEST_CASE("a biconcave cell of another size is the same, scaled") {
  CellSettings cell = cell_settings(300);
  const CellReference usual = make_reference(cell);
  const double factor = 0.5;
  cell.diameter_um *= factor;
  const CellReference small = make_reference(cell);
  CHECK(small.mesh.triangles == usual.mesh.triangles);
  for (std::size_t i = 0; i < usual.mesh.vertices.size(); ++i)
    for (int d = 0; d < 3; ++d) REQUIRE(small.mesh.vertices[i][d] == factor * usual.mesh.vertices[i][d]);
  CHECK(small.law.rest_area == Approx(factor * factor * usual.law.rest_area).epsilon(1e-12));
  CHECK(small.law.rest_volume == Approx(factor * factor * factor * usual.law.rest_volume).epsilon(1e-12));
  for (std::size_t t = 0; t < usual.rest_angle.size(); ++t)
    for (int k = 0; k < 3; ++k) REQUIRE(small.rest_angle[t][k] == Approx(usual.rest_angle[t][k]).margin(1e-12));
  cell.reference = CellSettings::Reference::uniform;
  const CellReference uniform = make_reference(cell);
  CHECK(uniform.law.rest_area == Approx(135 * factor * factor));
  CHECK(uniform.law.rest_volume == Approx(94 * factor * factor * factor));
}

TEST_CASE("an inflated sphere carries the tension of its stretch, which its pressure balances") {
  CellSettings cell = sphere(3, 320);
  cell.law = CellSettings::Law::neo_hookean;
  cell.bending_modulus_fJ = cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
  cell.inflation = 0.05;
  Membranes m({cell});
  m.compute_forces();
  const auto x = to_host(m.surfaces().x, m.vertices()), force = to_host(m.views().force, m.vertices());
  double virial = 0, across = 0, along = 0;
  for (int i = 0; i < m.vertices(); ++i) {
    const double inward = dot(force[i], x[i]) / 3;
    virial += dot(force[i], x[i]);
    across += norm(force[i] - (inward / 3) * x[i]), along += std::abs(inward);
  }
  // -sum F.x = 2 T A for a uniform tension, and T = G (1 - 1.05^-6).
  const double tension = 6.32e-3 * (1 - std::pow(1.05, -6));
  CHECK(-virial == Approx(2 * tension * m.diagnostics()[0].area_um2).epsilon(1e-10));
  CHECK(across < 0.05 * along);  // the mesh's unevenness: 6 % of the edges
}
