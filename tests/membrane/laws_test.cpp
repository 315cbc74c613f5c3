// In-plane laws against closed forms, and cells of several laws in one scene.
#include "membrane/laws.hpp"

#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "core/units.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

using Law = CellSettings::Law;

CellSettings with_law(Law law, double skalak_c = 1, int vertices = 200) {
  CellSettings cell = cell_settings(vertices);
  cell.law = law;
  cell.skalak_c = skalak_c;
  return cell;
}

struct Deformation {
  double xx, xy, yx, yy;
  Vec3 operator()(const Vec3& p) const { return {xx * p.x + xy * p.y, yx * p.x + yy * p.y, 0}; }
};

/// Tension (Cauchy, nN/um) of a flat sheet of the cell's law under a uniform deformation: xx, xy, yy.
std::array<double, 3> tension(const CellSettings& settings, const Deformation& deformation, double turn = 0.2) {
  static std::map<std::pair<Law, double>, CellReference> references;
  const auto key = std::pair{settings.law, settings.skalak_c};
  if (!references.count(key)) references.emplace(key, make_reference(settings));
  const CellReference& reference = references.at(key);
  CellLaw law = reference.law;
  law.local_area = 0;  // the in-plane law alone
  // Six triangles around a vertex; the lattice may lie at any angle.
  const double edge = 0.5, height = std::sqrt(3.0) / 2 * edge;
  const TriangleRest rest{{edge, edge, edge}, {1, 1, 1}, {0, 0, 0}, 0.5 * edge * height};
  std::array<double, 3> sum{};
  double area = 0;
  for (int t = 0; t < 6; ++t) {
    TriangleState state;
    for (int k = 0; k < 2; ++k) {
      const double phi = turn + (t + k) * 60 * units::degree;
      state.corner[k + 1] = deformation({edge * std::cos(phi), edge * std::sin(phi), 0});
    }
    state.normal = {0, 0, 1};
    for (Vec3& n : state.other_normal) n = {0, 0, 1};
    state.area = 0.5 * cross(state.corner[1], state.corner[2]).z;
    Vec3 force[3];
    std::visit([&](const auto& in_plane) { triangle_forces(state, rest, law, in_plane, {0, 0}, force); }, reference.in_plane);
    for (int k = 0; k < 3; ++k) {
      sum[0] -= force[k].x * state.corner[k].x;
      sum[1] -= force[k].x * state.corner[k].y;
      sum[2] -= force[k].y * state.corner[k].y;
    }
    area += state.area;
  }
  for (double& s : sum) s /= area;
  return sum;
}

const double G = 6.32 * units::uN_per_m;

std::vector<Vec3> forces_of(const std::vector<CellSettings>& cells) {
  Membranes m(cells);
  auto x = to_host(m.surfaces().x, m.vertices());
  // The same change of shape for each cell, whatever number it has.
  for (Vec3& p : x) p += 0.03 * Vec3{std::sin(3 * p.y), std::sin(2 * p.z), std::sin(4 * p.x)};
  to_device(x, m.surfaces().x);
  m.compute_forces();
  return to_host(m.views().force, m.vertices());
}

}  // namespace

TEST_CASE("the shear modulus asked for is that of every law at small strains") {
  for (Law law : {Law::wlc_pow, Law::neo_hookean, Law::skalak})
    for (double turn : {0.0, 0.2, 0.5}) {
      const double strain = 1e-5;
      INFO("law " << int(law) << ", lattice at " << turn);
      // The error is of the order of the strain.
      CHECK(tension(with_law(law, 5), {1, strain, 0, 1}, turn)[1] / strain == Approx(G).epsilon(1e-4));
      // Pure shear: stretched along x as much as shortened along y.
      const auto pure = tension(with_law(law, 5), {1 + strain, 0, 0, 1 / (1 + strain)}, turn);
      CHECK((pure[0] - pure[2]) / (4 * strain) == Approx(G).epsilon(1e-4));
    }
}

TEST_CASE("laws tell how much stiffer strain has made them") {
  // Second derivatives of the energy by both stretches, over those at rest.
  const auto check = [](const auto& sheet, double a, double b) {
    const auto energy = [&](double p, double q) { return sheet.density(p * p + q * q, p * q).value; };
    const auto curvature = [&](double p, double q) {
      constexpr double e = 1e-3;
      return (energy(p + e, q) + energy(p - e, q) + energy(p, q + e) + energy(p, q - e) - 4 * energy(p, q)) / (e * e);
    };
    INFO("stretches " << a << ", " << b);
    CHECK(sheet.stiffening(a * a + b * b, a * b) == Approx(curvature(a, b) / curvature(1, 1)).epsilon(1e-3));
  };
  for (auto [a, b] : {std::pair{1.0, 1.0}, {1.3, 0.8}, {2.0, 0.4}, {0.7, 0.7}}) {
    check(NeoHookeanSheet{2}, a, b);
    check(SkalakSheet{2, 0}, a, b);
    check(SkalakSheet{2, 5}, a, b);
  }
  const WlcPowSpring spring{3};
  for (double ratio : {0.6, 1.0, 1.5, 2.0}) {
    constexpr double e = 1e-6, rest = 0.4;
    const auto slope = [&](double r) { return spring.force((r + e) * rest, rest) - spring.force((r - e) * rest, rest); };
    CHECK(spring.stiffening(ratio * rest, rest) == Approx(slope(ratio) / slope(1)).epsilon(1e-5));
  }
}

TEST_CASE("the modulus of area is G (1 + 2 C) of a Skalak sheet and 3 G of a neo-Hookean one") {
  const double strain = 1e-6;
  const auto modulus = [&](const CellSettings& cell) {
    const auto t = tension(cell, {1 + strain, 0, 0, 1 + strain});
    CHECK(t[0] == Approx(t[2]).epsilon(1e-9));
    return t[0] / (2 * strain);
  };
  for (double c : {0.0, 1.0, 10.0, 1000.0}) CHECK(modulus(with_law(Law::skalak, c)) == Approx(G * (1 + 2 * c)).epsilon(1e-4));
  CHECK(modulus(with_law(Law::neo_hookean)) == Approx(3 * G).epsilon(1e-4));
}

TEST_CASE("sheets stretched far have the tensions of their laws' closed forms") {
  // Of principal stretches a and b: (1/b) dW/da along a (Barthes-Biesel, Diaz & Dhenin 2002).
  const double a = GENERATE(0.7, 1.3, 2.5);
  INFO("stretch " << a);
  const auto sheet = with_law(Law::neo_hookean);
  const auto both = tension(sheet, {a, 0, 0, a});
  CHECK(both[0] == Approx(G * (1 - std::pow(a, -6))).epsilon(1e-12));
  CHECK(both[1] == Approx(0).margin(1e-12 * G));
  const double free = 1 / std::sqrt(a);  // stretch across, without tension there
  const auto one = tension(sheet, {a, 0, 0, free});
  CHECK(one[0] == Approx(G * (a - 1 / (a * a)) / free).epsilon(1e-12));
  CHECK(one[2] == Approx(0).margin(1e-12 * G));
  for (double c : {0.0, 1.0, 30.0}) {
    INFO("C = " << c);
    const auto skalak = with_law(Law::skalak, c);
    const auto all_round = tension(skalak, {a, 0, 0, a});
    CHECK(all_round[0] == Approx(G * (a * a - 1) * (1 + c * a * a * (a * a + 1))).epsilon(1e-11));
    const double b = std::sqrt((1 + c * a * a) / (1 + c * a * a * a * a));
    const auto along = tension(skalak, {a, 0, 0, b});
    CHECK(along[0] == Approx(G * a / b * (a * a - 1 + c * b * b * (a * a * b * b - 1))).epsilon(1e-9));
    CHECK(along[2] == Approx(0).margin(1e-11 * G * (1 + c) * a * a * a * a));
  }
  // Turned after stretching: the tension turns along.
  const double cosine = std::cos(0.7), sine = std::sin(0.7);
  const auto turned = tension(sheet, {cosine * a, -sine * free, sine * a, cosine * free});
  CHECK(turned[0] == Approx(one[0] * cosine * cosine).epsilon(1e-11));
  CHECK(turned[1] == Approx(one[0] * cosine * sine).epsilon(1e-11));
}

TEST_CASE("a Skalak triangle has the energy of its principal stretches, whatever its shape") {
  const double C = 3;
  const Skalak law{{0.7, C}};
  const auto [a, b, area, rest, moved, shape] = StretchedTriangle();
  const double i1 = a * a + b * b - 2, i2 = a * a * b * b - 1;
  CHECK(law.energy(shape, rest) == Approx(area * 0.7 / 4 * (i1 * i1 + 2 * i1 - 2 * i2 + C * i2 * i2)).epsilon(1e-12));
  CHECK(law.strain(shape, rest) == Approx(a).epsilon(1e-12));
}

TEST_CASE("cells of several laws and constants in one scene have the forces that each has alone") {
  std::vector<CellSettings> cells{with_law(Law::neo_hookean), with_law(Law::wlc_pow), with_law(Law::skalak, 10), with_law(Law::wlc_pow),
                                  with_law(Law::neo_hookean)};
  cells[3].shear_modulus_uN_per_m = 20;
  const auto together = forces_of(cells);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const auto alone = forces_of({cells[c]});
    for (std::size_t i = 0; i < alone.size(); ++i) {
      INFO("cell " << c << ", vertex " << i);
      // Other instructions for cells from a list: rounding, and links carry up to 4e-3 nN.
      REQUIRE(norm(together[c * alone.size() + i] - alone[i]) < 1e-16);
    }
  }
  // Their figures as well: the energy of each.
  Membranes all(cells);
  all.compute_forces();
  CHECK(all.views().law.extent(0) == 4);  // one reference for the two alike
  for (const auto& d : all.diagnostics()) CHECK(d.stretch > 0);
}

TEST_CASE("an overstretched sheet is refused in the words of its law") {
  Membranes m({with_law(Law::wlc_pow), with_law(Law::skalak)});
  auto x = to_host(m.surfaces().x, m.vertices());
  for (int i = 200; i < 400; ++i) x[i].x *= 11;
  to_device(x, m.surfaces().x);
  CHECK_THROWS_WITH(m.compute_forces(), Catch::Matchers::Contains("cells.1") &&
                                            Catch::Matchers::Contains("a triangle stretched 11 times") &&
                                            Catch::Matchers::Contains("holds to 10"));
}

TEST_CASE("a sheet without further terms has no energy but its own, and keeps its volume") {
  CellSettings cell = with_law(Law::neo_hookean);
  cell.shape = CellSettings::Shape::sphere;
  cell.radius_um = 3;
  cell.bending_modulus_fJ = cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
  Membranes m({cell});
  auto x = to_host(m.surfaces().x, m.vertices());
  for (Vec3& p : x) p = {1.2 * p.x, p.y / 1.2, p.z};
  to_device(x, m.surfaces().x);
  const auto before = m.diagnostics()[0];
  CHECK(before.springs_fJ > 0);
  CHECK(before.energy_fJ() == Approx(before.springs_fJ).epsilon(1e-9));  // the volume is right to rounding
  for (int n = 0; n < 20; ++n) m.advance(0.2);
  const auto after = m.diagnostics()[0];
  CHECK(after.springs_fJ < before.springs_fJ);
  // To the second order of a step's displacement: 0.01 um of 3 um.
  CHECK(after.volume_um3 == Approx(after.rest_volume_um3).epsilon(1e-5));
}
