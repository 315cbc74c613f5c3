#include "membrane/motion.hpp"

#include <catch2/catch.hpp>

#include "common/extremes.hpp"
#include "core/error.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;
using Catch::Matchers::Contains;

namespace {

void shake(Membranes& m, double noise_um) {
  Noise noise;
  auto x = to_host(m.surfaces().x, m.vertices());
  for (Vec3& p : x) p += noise_um * noise.vec();
  to_device(x, m.surfaces().x);
}

double kinetic(Membranes& m, double mass_pg) {
  double sum = 0;
  for (const Vec3& v : to_host(m.surfaces().v, m.vertices())) sum += dot(v, v);
  return 0.5 * mass_pg / m.vertices() * sum;
}

/// Whether a slightly shaken cell keeps its energy over 400 raw steps of dt.
bool stable(double mass_pg, double dt) {
  Membranes m({cell_settings(500, mass_pg)});
  const double rest = m.diagnostics()[0].energy_fJ();
  shake(m, 1e-4);
  const double start = m.diagnostics()[0].energy_fJ() - rest;
  const MotionViews work = make_motion_views(m.views());
  for (int i = 0; i < 400; ++i) {
    measure_membranes(m.views(), m.surfaces().x);
    m.elasticity().evaluate_triangles(m.views(), m.surfaces().x);
    predict_velocity(m.views(), work, NoLoad{}, dt);
    project_and_move(m.views(), work, dt, 1e-3);
  }
  const double energy = m.diagnostics()[0].energy_fJ() - rest + kinetic(m, mass_pg);
  return std::isfinite(energy) && energy < 100 * start;
}

/// A rough traction of the given size, kPa, the same for the same vertices.
std::vector<Vec3> rough_field(const Membranes& m, double size) {
  std::vector<Vec3> t;
  for (const Vec3& p : to_host(m.surfaces().x, m.vertices())) {
    t.push_back(size * Vec3{std::sin(1.3 * p.x + p.y), std::cos(2.1 * p.y), std::sin(1.7 * p.x * p.y)});
  }
  return t;
}

SurfaceStress rough_traction(const Membranes& m, double size) { return make_stress(rough_field(m, size)); }

Components<double> uniform_field(const Membranes& m, const Vec3& value) { return make_field(std::vector<Vec3>(m.vertices(), value)); }

SurfaceStress uniform_traction(const Membranes& m, const Vec3& value) { return make_stress(std::vector<Vec3>(m.vertices(), value)); }

}  // namespace

TEST_CASE("largest stable step of symplectic Euler") {
  const struct { double mass_pg, expected_us; } cases[] = {{7200, 21.3}, {100, 2.5}};
  for (const auto& c : cases) {
    double low = 0.4 * c.expected_us, high = 2.5 * c.expected_us;
    REQUIRE(stable(c.mass_pg, low));
    REQUIRE_FALSE(stable(c.mass_pg, high));
    for (int i = 0; i < 7; ++i) {
      const double middle = 0.5 * (low + high);
      (stable(c.mass_pg, middle) ? low : high) = middle;
    }
    Membranes m({cell_settings(500, c.mass_pg)});
    const double estimate = m.stable_step_us() / 0.3;
    INFO("mass " << c.mass_pg << " pg: measured " << low << " us, estimated " << estimate);
    // Meshes differ; the independent figures hold within a factor of two.
    CHECK(low > c.expected_us / 2);
    CHECK(low < c.expected_us * 2);
    // The estimate is a power iteration of 30 steps, a few per cent below the eigenvalue, and bisection is to 2 %.
    CHECK(estimate == Approx(low).epsilon(0.1));
    report("{} pg: largest stable step {:.2f} us, estimated {:.2f} us", c.mass_pg, low, estimate);
  }
}

TEST_CASE("a free cell keeps its energy") {
  Membranes m({cell_settings(500)});
  const double rest = m.diagnostics()[0].energy_fJ();
  shake(m, 0.01);
  m.advance(1.0);
  const double start = m.diagnostics()[0].energy_fJ() - rest + kinetic(m, 100);
  for (int i = 0; i < 300; ++i) m.advance(1.0);
  const double end = m.diagnostics()[0].energy_fJ() - rest + kinetic(m, 100);
  // Symplectic Euler's energy swings by omega dt / 2, which the margin of 0.3 keeps below 0.3 for the stiffest mode.
  CHECK(end == Approx(start).epsilon(0.3));
}

TEST_CASE("volume is kept in a violently forced run") {
  const double mass = GENERATE(100.0, 7200.0);
  Membranes m({cell_settings(500, mass)});
  const auto still = uniform_field(m, {});
  const double rest = m.diagnostics()[0].volume_um3;
  double worst = 0, moved = 0;
  // 30 Pa in patches of alternating direction: five times the largest traction on a cell at 2 mm/s in a capillary.
  const auto traction = rough_traction(m, 0.03);
  for (int i = 0; i < 100; ++i) {
    m.advance(1.0, traction, 10, still);
    const auto d = m.diagnostics()[0];
    worst = larger(worst, std::abs(d.volume_um3 / rest - 1));
    moved = larger(moved, d.stretch);
  }
  INFO("worst volume error " << worst << ", largest stretch " << moved);
  CHECK(moved > 0.6);   // violent indeed: links start at 0.455 of their contour length
  CHECK(worst < 1e-5);  // the bound asked for
  report("{} pg: worst volume error {:.1e}, largest stretch {:.2f}", mass, worst, moved);
}

TEST_CASE("the level of the pressure has no effect") {
  CellSettings settings = cell_settings(300);
  settings.membrane_viscosity_N_s_per_m = GENERATE(0.0, 1e-8);
  const bool bent = GENERATE(false, true);
  const double beta = GENERATE(0.0, 10.0);
  const auto moved = [&](double level_kPa) {
    Membranes m({settings});
    auto x = to_host(m.surfaces().x, m.vertices());
    if (bent) {
      x = deformed(x, 0.02);
      for (Vec3& p : x) p.z += 0.15 * p.x * p.x;  // a deep cup
      to_device(x, m.surfaces().x);
    }
    std::vector<double> pressure;
    for (const Vec3& t : rough_field(m, 0.003)) pressure.push_back(level_kPa + t.x);
    const auto stress = make_stress(pressure, rough_field(m, 0.003));
    const auto still = uniform_field(m, {});
    for (int i = 0; i < 10; ++i) m.advance(1.0, stress, beta, still);
    return to_host(m.surfaces().x, m.vertices());
  };
  const auto none = moved(0), high = moved(10);
  double worst = 0;
  for (std::size_t i = 0; i < none.size(); ++i) worst = std::max(worst, norm(high[i] - none[i]));
  // Pressures of 10 kPa are rounded to 2e-15 kPa, whose force moves a vertex of 0.3 pg by 1e-13 um in 10 us; the shape's
  // own instability takes that up. 10 kPa along the vertex normals move vertices by more than 1 um.
  CHECK(worst < 1e-9);
}

TEST_CASE("a pressure that is linear in space pushes a cell with its gradient times the volume") {
  Membranes m({cell_settings(300, 7200)});
  const auto x = deformed(to_host(m.surfaces().x, m.vertices()), 0.02);
  to_device(x, m.surfaces().x);
  const double volume = m.diagnostics()[0].volume_um3;
  const Vec3 slope{1e-4, -2e-4, 3e-4};
  std::vector<double> pressure;
  for (const Vec3& p : x) pressure.push_back(5 + dot(slope, p));
  measure_membranes(m.views(), m.surfaces().x);
  m.elasticity().evaluate_triangles(m.views(), m.surfaces().x);
  const MotionViews work = make_motion_views(m.views());
  const double dt = 1e-3;
  predict_velocity(m.views(), work, FluidLoad{make_stress(pressure, std::vector<Vec3>(x.size()))}, dt);
  Vec3 momentum;
  for (const Vec3& v : to_host(m.surfaces().v, m.vertices())) momentum += (7200.0 / m.vertices()) * v;
  // Round-off: internal forces of 0.1 nN on 300 vertices cancel in the sum.
  CHECK(norm((1 / dt) * momentum + volume * slope) < 1e-12 * volume * norm(slope) + 1e-13);
}

TEST_CASE("a uniform traction accelerates the whole cell") {
  Membranes m({cell_settings(500, 7200)});
  const auto traction = uniform_traction(m, {0, 1e-3, 0});
  for (int i = 0; i < 10; ++i) m.advance(1.0, traction);
  const auto d = m.diagnostics()[0];
  // Newton's law with the area at rest; the area changes by less than 1e-4 in that time.
  CHECK(d.velocity_um_per_us[1] == Approx(1e-3 * d.area_um2 * 10 / 7200).epsilon(1e-4));
  CHECK(std::abs(d.velocity_um_per_us[0]) < 1e-9);
}

TEST_CASE("the anticipated reaction carries the cell along") {
  Membranes m({cell_settings(500)});
  const Vec3 wind{1e-3, -2e-3, 5e-4};
  const auto calm = uniform_traction(m, {});
  const auto v_star = uniform_field(m, wind);
  for (int i = 0; i < 400; ++i) m.advance(1.0, calm, 10, v_star);
  // Drag overcomes the mass within M / (beta A) = 0.07 us; the shape, barely disturbed, relaxes meanwhile.
  for (const Vec3& v : to_host(m.surfaces().v, m.vertices())) REQUIRE(norm(v - wind) < 1e-6);
}

TEST_CASE("sub-steps follow mass, drag and step") {
  Membranes heavy({cell_settings(500, 7200)}), light({cell_settings(500, 100)});
  const double limit = light.stable_step_us();
  heavy.stable_step_us();
  CHECK(heavy.substeps(1, 0) == 1);
  CHECK(light.substeps(1, 0) == int(std::ceil(1 / limit)));
  CHECK(light.substeps(1, 10) == 1);  // drag damps what mass would let ring
  CHECK(light.substeps(10, 0) == int(std::ceil(10 / limit)));
}

TEST_CASE("two identical cells move as one does, to the bit") {
  CellSettings viscous = cell_settings(300);
  viscous.membrane_viscosity_N_s_per_m = GENERATE(0.0, 1e-8);
  Membranes one({viscous}), two({viscous, viscous});
  const int n = one.vertices();
  shake(one, 0.01);
  auto x = to_host(one.surfaces().x, n);
  x.insert(x.end(), x.begin(), x.begin() + n);
  to_device(x, two.surfaces().x);
  const auto traction_one = rough_traction(one, 0.01), traction_two = rough_traction(two, 0.01);
  for (int i = 0; i < 20; ++i) {
    one.advance(1.0, traction_one);
    two.advance(1.0, traction_two);
  }
  const auto a = to_host(one.surfaces().x, n), b = to_host(two.surfaces().x, 2 * n);
  for (int i = 0; i < n; ++i) {
    for (int d = 0; d < 3; ++d) {
      REQUIRE(a[i][d] == b[i][d]);
      REQUIRE(a[i][d] == b[i + n][d]);
    }
  }
}

TEST_CASE("cells of different types live side by side") {
  CellSettings soft = cell_settings(300), stiff = cell_settings(200);
  stiff.shear_modulus_uN_per_m = 12;
  stiff.center_um = {20, 0, 0};
  Membranes both({soft, stiff}), alone({stiff});
  const auto field = rough_field(both, 0.01);
  const auto t_both = make_stress(field), t_alone = make_stress({field.begin() + 300, field.end()});
  for (int i = 0; i < 10; ++i) {
    both.advance(1.0, t_both);
    alone.advance(1.0, t_alone);
  }
  const auto x = to_host(both.surfaces().x, both.vertices()), y = to_host(alone.surfaces().x, alone.vertices());
  // The sub-steps may differ in number: both are resolved to far better than this.
  for (int i = 0; i < alone.vertices(); ++i) REQUIRE(norm(x[300 + i] - y[i]) < 1e-4);
}

TEST_CASE("saved states and checkpoints give the same bits") {
  CellSettings settings = cell_settings(200);
  Membranes m({settings});
  const auto traction = rough_traction(m, 0.01);
  for (int i = 0; i < 60; ++i) m.advance(1.0, traction);
  const auto checkpoint = m.state();
  m.save_state();
  for (int i = 0; i < 70; ++i) m.advance(1.0, traction);  // over the next estimate of the stiffness
  const auto reached = m.state();
  m.restore_state();
  CHECK(m.state() == checkpoint);
  for (int i = 0; i < 70; ++i) m.advance(1.0, traction);
  CHECK(m.state() == reached);
  Membranes restarted({settings});
  restarted.set_state(checkpoint);
  for (int i = 0; i < 70; ++i) restarted.advance(1.0, traction);
  CHECK(restarted.state() == reached);
  CHECK_THROWS_AS(restarted.set_state(std::vector<double>(7)), InputError);
}

TEST_CASE("a cell that cannot hold stops the run and stays where it was") {
  Membranes m({cell_settings(200)});
  const auto before = m.state();
  const auto same_place = [&] {
    const auto now = m.state();
    return std::equal(now.begin() + 2, now.end(), before.begin() + 2);  // after calls and stiffness
  };
  SECTION("overstretched") {
    std::vector<Vec3> pull;
    for (const Vec3& p : to_host(m.surfaces().x, m.vertices())) pull.push_back({100 * p.x, 0, 0});
    CHECK_THROWS_WITH(m.advance(1.0, make_stress(pull)), Contains("cells.0") && Contains("overstretched") && Contains("time.step_us"));
    CHECK(same_place());
  }
  SECTION("not a number") {
    std::vector<Vec3> pull(m.vertices());
    pull[5].y = NAN;
    CHECK_THROWS_WITH(m.advance(1.0, make_stress(pull)), Contains("cells.0") && Contains("not finite"));
    CHECK(same_place());
  }
}

TEST_CASE("rigid bodies follow the cells and are left alone") {
  const CellReference other = make_reference(cell_settings(200));
  Membranes m({cell_settings(300)}, {transform(other.mesh, {1, 0, 0}, 0, {30, 0, 0})});
  CHECK(m.surfaces().bodies == 2);
  CHECK(m.surfaces().vertices == 500);
  CHECK(m.vertices() == 300);
  const auto before = to_host(m.surfaces().x, 500);
  m.advance(1.0, uniform_traction(m, {1e-2, 0, 0}));
  const auto after = to_host(m.surfaces().x, 500);
  CHECK(after[0].x > before[0].x);
  for (int i = 300; i < 500; ++i) REQUIRE(norm(after[i] - before[i]) == 0);
}

TEST_CASE("a uniform reference grows to its volume gradually") {
  CellSettings settings = cell_settings(500);
  settings.reference = CellSettings::Reference::uniform;
  Membranes m({settings});
  const auto still = uniform_field(m, {});
  const auto calm = uniform_traction(m, {});
  double previous = m.diagnostics()[0].volume_um3;
  for (int i = 0; i < 30; ++i) {
    m.advance(1.0, calm, 10, still);
    const double now = m.diagnostics()[0].volume_um3;
    REQUIRE(std::abs(now - previous) < 1.1e-3 * 94);  // at most 0.1 % a us, and second order
    previous = now;
  }
  CHECK(previous == Approx(94).epsilon(1e-5));
}
