// What the run's energy balance takes from membranes, and which cell's figures are whose.
#include <catch2/catch.hpp>

#include "core/units.hpp"
#include "membrane/membrane_viscosity.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

/// Two cells of different kinds, apart from each other.
std::vector<CellSettings> two_cells(CellSettings::Dissipation form) {
  CellSettings first = cell_settings(200, 100), second = cell_settings(300, 7200);
  first.membrane_viscosity_N_s_per_m = 1e-7;
  second.membrane_viscosity_N_s_per_m = 3e-7;
  first.dissipation = second.dissipation = form;
  second.center_um = {9, 2, -3};
  return {first, second};
}

std::vector<Vec3> rough_velocity(int vertices) {
  Noise noise;
  std::vector<Vec3> v;
  for (int i = 0; i < vertices; ++i) v.push_back(noise.vec());
  return v;
}

}  // namespace

TEST_CASE("a membrane's dissipation is the power of its dissipative forces") {
  const auto form = GENERATE(CellSettings::Dissipation::central, CellSettings::Dissipation::full);
  Membranes m(two_cells(form));
  const auto v = rough_velocity(m.vertices());
  to_device(v, m.surfaces().v);
  const Components<double> force("corpuscle::test::force", m.vertices(), 3);
  m.viscosity()->force(m.views(), m.elasticity(), m.surfaces().v, force);
  double power = 0;
  const auto f = to_host(force, m.vertices());
  for (int i = 0; i < m.vertices(); ++i) power -= dot(f[i], v[i]);
  CHECK(power > 0);
  CHECK(m.dissipation_nW() == Approx(power).epsilon(1e-12));  // sums in another order
}

TEST_CASE("kinetic energy, centroid, extent and velocity are those of each cell") {
  Membranes m(two_cells(CellSettings::Dissipation::central));
  auto v = rough_velocity(m.vertices());
  for (int i = 0; i < m.vertices(); ++i) v[i] += i < 200 ? Vec3{1, 2, 3} : Vec3{-4, 0.5, 6};
  to_device(v, m.surfaces().v);
  double energy = 0;
  Vec3 mean[2];
  for (int i = 0; i < m.vertices(); ++i) {
    energy += 0.5 * (i < 200 ? 100.0 / 200 : 7200.0 / 300) * dot(v[i], v[i]);
    mean[i < 200 ? 0 : 1] += (i < 200 ? 1.0 / 200 : 1.0 / 300) * v[i];
  }
  CHECK(m.kinetic_energy_fJ() == Approx(energy).epsilon(1e-12));
  const auto cells = m.diagnostics();
  const Triple centre[2] = {{0, 0, 0}, {9, 2, -3}};
  const auto x = to_host(m.surfaces().x, m.vertices());
  for (int c = 0; c < 2; ++c) {
    INFO("cell " << c);
    for (int d = 0; d < 3; ++d) {
      CHECK(cells[c].velocity_um_per_us[d] == Approx(mean[c][d]).epsilon(1e-12));
      // Of the volume; the mesh is symmetric about its centre to a few thousandths of its radius.
      CHECK(cells[c].centroid_um[d] == Approx(centre[c][d]).margin(0.02));
      double low = 1e300, high = -1e300;
      for (int i = c == 0 ? 0 : 200; i < (c == 0 ? 200 : 500); ++i) low = std::min(low, x[i][d]), high = std::max(high, x[i][d]);
      CHECK(cells[c].lower_um[d] == low);
      CHECK(cells[c].upper_um[d] == high);
    }
  }
}

TEST_CASE("the centroid of a lopsided cell is that of its volume") {
  // A half of the cell drawn out: the volume's centroid by tetrahedra from a corner far away.
  Membranes m({cell_settings(300)});
  auto x = to_host(m.surfaces().x, m.vertices());
  for (Vec3& p : x) p = Vec3{p.x > 0 ? 1.5 * p.x : p.x, p.y, p.z + 0.1 * p.x * p.x};
  to_device(x, m.surfaces().x);
  const auto triangle = triangles_on_host(m.surfaces());
  const Vec3 far{-20, 30, 10};
  double volume = 0;
  Vec3 moment;
  for (int t = 0; t < m.surfaces().triangles; ++t) {
    const Vec3 a = x[triangle(t, 0)], b = x[triangle(t, 1)], c = x[triangle(t, 2)];
    const double part = dot(a - far, cross(b - far, c - far)) / 6;
    volume += part;
    moment += (part / 4) * (a + b + c + far);
  }
  const auto cell = m.diagnostics()[0];
  CHECK(cell.volume_um3 == Approx(volume).epsilon(1e-11));
  for (int d = 0; d < 3; ++d) CHECK(cell.centroid_um[d] == Approx(moment[d] / volume).margin(1e-10));
  CHECK(cell.centroid_um[0] > 0.5);
}

TEST_CASE("steps that are taken back leave nothing behind") {
  // An iterated coupling repeats each step; every hundredth step estimates the stiffness anew.
  Membranes once({cell_settings(200)}), again({cell_settings(200)});
  for (int n = 0; n < 130; ++n) {
    once.advance(0.5);
    again.save_state();
    again.advance(0.5);
    again.restore_state();
    again.advance(0.5);
  }
  const auto a = once.state(), b = again.state();
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    INFO("number " << i);
    REQUIRE(a[i] == b[i]);
  }
}
