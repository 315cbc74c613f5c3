#include "membrane/forces.hpp"

#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "core/units.hpp"
#include "membrane/diagnostics.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

enum class Term { springs, bending, global_area, local_area, volume, all };

CellLaw only(Term term, const CellLaw& law) {
  if (term == Term::all) return law;
  CellLaw one = law;
  if (term != Term::bending) one.bending = 0;
  if (term != Term::global_area) one.area = 0;
  if (term != Term::local_area) one.local_area = 0;
  if (term != Term::volume) one.volume = 0;
  return one;
}

/// One deformed cell with one term of the energy or all.
struct OneCell {
  OneCell(const CellSettings& settings, Term term) {
    CellReference reference = make_reference(settings);
    reference.law = only(term, reference.law);
    if (term != Term::springs && term != Term::all) reference.in_plane = WlcPow{};
    views = make_membrane_views(make_surface_set({reference.mesh}), {reference}, {0});
    elasticity = make_elasticity({reference}, {0});
    table = Table<double>("corpuscle::test::table", 1, CellColumn::count);
    rest = to_host(views.surface.x, views.vertices);
    x = deformed(rest, 0.03);
    to_device(x, views.surface.x);
  }

  double energy() {
    elasticity->measure_cells(views, table);
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), table);
    double sum = 0;
    for (int c = CellColumn::springs; c <= CellColumn::global_volume; ++c) sum += host(0, c);
    return sum;
  }

  double energy_at(int vertex, int d, double shift) {
    const auto position = Kokkos::subview(views.surface.x, vertex, d);
    Kokkos::deep_copy(position, x[vertex][d] + shift);
    const double e = energy();
    Kokkos::deep_copy(position, x[vertex][d]);
    return e;
  }

  MembraneViews views;
  std::unique_ptr<Elasticity> elasticity;
  Table<double> table;
  std::vector<Vec3> rest, x;
};

/// A law that the program does not have: Hookean springs, as strained as they are long.
struct HookeanSpring {
  static constexpr double limit = 3;
  double stiffness = 0;
  KOKKOS_INLINE_FUNCTION double force(double length, double rest) const { return stiffness * (length - rest); }
  KOKKOS_INLINE_FUNCTION double energy(double length, double rest) const { return 0.5 * stiffness * (length - rest) * (length - rest); }
  KOKKOS_INLINE_FUNCTION static double strain(double length, double rest) { return length / rest; }
  KOKKOS_INLINE_FUNCTION static double stiffening(double, double) { return 1; }
};

template <class Law>
Array<Law> one_type(const Law& law) {
  const Array<Law> laws("corpuscle::test::law", 1);
  Kokkos::deep_copy(laws, law);
  return laws;
}

/// Error of the force against differences of the energy, relative, at every 17th vertex.
double force_error(OneCell& cell) {
  cell.elasticity->membrane_forces(cell.views, cell.views.surface.x, cell.views.force);
  const auto force = to_host(cell.views.force, cell.views.vertices);
  const double h = 1e-3;  // um; the fourth-order difference leaves h^4 = 1e-12, rounding of the energy 1e-13 / h
  double error2 = 0, scale2 = 0;
  for (int vertex = 0; vertex < cell.views.vertices; vertex += 17) {
    for (int d = 0; d < 3; ++d) {
      const double inner = cell.energy_at(vertex, d, h) - cell.energy_at(vertex, d, -h);
      const double outer = cell.energy_at(vertex, d, 2 * h) - cell.energy_at(vertex, d, -2 * h);
      const double slope = (8 * inner - outer) / (12 * h);
      error2 += (slope + force[vertex][d]) * (slope + force[vertex][d]);
      scale2 += slope * slope;
    }
  }
  CHECK(scale2 > 0);
  return std::sqrt(error2 / scale2);
}

/// Net force and torque over the sums of magnitudes.
std::array<double, 2> imbalance(const std::vector<Vec3>& x, const std::vector<Vec3>& force) {
  Vec3 net, torque;
  double force_sum = 0, torque_sum = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    net += force[i];
    torque += cross(x[i], force[i]);
    force_sum += norm(force[i]);
    torque_sum += norm(x[i]) * norm(force[i]);
  }
  CHECK(force_sum > 0);
  return {norm(net) / force_sum, norm(torque) / torque_sum};
}

/// Of any law: forces from the energy, none at rest, none in sum; a cell beyond the limit is marked.
template <class Law>
void check_law(const Law& law) {
  OneCell cell(cell_settings(300), Term::springs);
  cell.elasticity = std::make_unique<ElasticityOf<Law, AllCells>>(one_type(law), AllCells{1});
  CHECK(force_error(cell) < 1e-6);
  const auto force = to_host(cell.views.force, cell.views.vertices);
  const auto [net, torque] = imbalance(cell.x, force);
  CHECK(net < 1e-12);
  CHECK(torque < 1e-12);
  double most = 0;
  for (const Vec3& f : force) most = std::max(most, norm(f));
  to_device(cell.rest, cell.views.surface.x);
  cell.elasticity->membrane_forces(cell.views, cell.views.surface.x, cell.views.force);
  for (const Vec3& f : to_host(cell.views.force, cell.views.vertices)) CHECK(norm(f) < 1e-11 * most);
  const HostCopy status(cell.views.status);
  CHECK(status.read()(0) == 0);
  std::vector<Vec3> far = cell.rest;
  for (Vec3& p : far) p.x *= 1.2 * Law::limit;
  to_device(far, cell.views.surface.x);
  cell.elasticity->membrane_forces(cell.views, cell.views.surface.x, cell.views.force);
  CHECK(status.read()(0) == 1);
}

}  // namespace

TEST_CASE("every force is minus the gradient of its energy") {
  const auto term = GENERATE(Term::springs, Term::bending, Term::global_area, Term::local_area, Term::volume, Term::all);
  CellSettings settings = cell_settings(300);
  settings.reference = GENERATE(CellSettings::Reference::shape, CellSettings::Reference::uniform);
  OneCell cell(settings, term);
  const double error = force_error(cell);
  INFO("term " << int(term) << ": relative error " << error);
  CHECK(error < 1e-6);  // the bound asked for
  report("term {}: relative error {:.1e}", int(term), error);
}

TEST_CASE("a triangle that is squeezed flat, and through itself, is pushed open, and not thrown away by bending") {
  const auto term = GENERATE(Term::bending, Term::local_area);
  OneCell cell(cell_settings(300), term);
  const auto rest_area = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cell.views.rest_area);
  const auto triangle = triangles_on_host(cell.views.surface);
  const int squeezed = 100, corner[3] = {triangle(squeezed, 0), triangle(squeezed, 1), triangle(squeezed, 2)};
  const Vec3 a = cell.x[corner[1]], along = cell.x[corner[2]] - a, foot = a + 0.4 * along;
  const Vec3 height = cell.x[corner[0]] - foot - (dot(cell.x[corner[0]] - foot, along) / dot(along, along)) * along;
  const double whole = rest_area(squeezed) / (0.5 * norm(along) * norm(height));  // heights for the area at rest
  const auto forces = [&] {
    to_device(cell.x, cell.views.surface.x);
    cell.elasticity->membrane_forces(cell.views, cell.views.surface.x, cell.views.force);
    return to_host(cell.views.force, cell.views.vertices);
  };
  const auto largest = [&](double ratio) {
    cell.x[corner[0]] = foot + ratio * whole * height;
    double most = 0;
    for (const Vec3& f : forces()) most = std::max(most, norm(f));
    return most;
  };
  const double at_half = largest(0.5);
  if (term == Term::local_area) CHECK(largest(0.05) > 4 * at_half);  // of k_d alone twice
  for (double ratio : {0.4, 0.2, 0.1, 1e-2, 1e-3, 1e-5, -1e-5, -1e-3, -0.1}) {
    INFO("at " << ratio << " of its area at rest");
    CHECK(largest(ratio) < 20 * at_half);  // over the height it would grow without bound: 5e4 times at 1e-5
  }
  for (double ratio : {0.52, 0.45, 0.2, 0.05, -0.1}) {
    cell.x[corner[0]] = foot + ratio * whole * height;
    const auto force = forces();
    double error = 0, scale = 0;
    const double h = 1e-4 * std::abs(ratio);
    for (int vertex : corner)
      for (int d = 0; d < 3; ++d) {
        const double slope = (8 * (cell.energy_at(vertex, d, h) - cell.energy_at(vertex, d, -h)) -
                              (cell.energy_at(vertex, d, 2 * h) - cell.energy_at(vertex, d, -2 * h))) /
                             (12 * h);
        error = std::max(error, std::abs(slope + force[vertex][d]));
        scale = std::max(scale, std::abs(slope));
      }
    INFO("at " << ratio << " of its area at rest: " << error / scale);
    if (term == Term::local_area || ratio > 0.5) CHECK(error < 1e-5 * scale);
    const auto [net, torque] = imbalance(cell.x, force);
    CHECK(net < 1e-11);
    CHECK(torque < 1e-11);
  }
}

TEST_CASE("internal forces of a deformed cell exert no net force or torque") {
  const auto term = GENERATE(Term::springs, Term::bending, Term::global_area, Term::local_area, Term::volume, Term::all);
  OneCell cell(cell_settings(500), term);
  cell.elasticity->membrane_forces(cell.views, cell.views.surface.x, cell.views.force);
  const auto force = to_host(cell.views.force, cell.views.vertices);
  const auto [net, torque] = imbalance(cell.x, force);
  CHECK(net < 1e-12);  // the bound asked for
  CHECK(torque < 1e-12);
  report("term {}: net force {:.1e}, net torque {:.1e} of the sums of magnitudes", int(term), net, torque);
}

TEST_CASE("laws of springs and of triangles plug in alike") {
  check_law(SpringNetwork<HookeanSpring>{{5e-3}});
  check_law(NeoHookean{{5e-3}});
  check_law(Skalak{{5e-3, 0}});
  check_law(Skalak{{5e-3, 20}});
}

TEST_CASE("with every law that a scene can choose, all terms together are minus the gradient of the energy") {
  CellSettings settings = cell_settings(300);
  settings.law = GENERATE(CellSettings::Law::wlc_pow, CellSettings::Law::neo_hookean, CellSettings::Law::skalak);
  OneCell cell(settings, Term::all);
  INFO("law " << int(settings.law));
  CHECK(force_error(cell) < 1e-6);
  const auto [net, torque] = imbalance(cell.x, to_host(cell.views.force, cell.views.vertices));
  CHECK(net < 1e-12);
  CHECK(torque < 1e-12);
}

TEST_CASE("a neo-Hookean triangle has the energy of its principal stretches, whatever its shape") {
  const NeoHookean law{{0.7}};
  const auto [a, b, area, rest, moved, shape] = StretchedTriangle();
  CHECK(law.energy(shape, rest) == Approx(area * 0.35 * (a * a + b * b + 1 / (a * a * b * b) - 3)).epsilon(1e-12));
  CHECK(law.strain(shape, rest) == Approx(a).epsilon(1e-12));
  // Tension along x at rest area unity: dW/da over b.
  Vec3 force[3] = {};
  law.add_forces(shape, rest, force);
  double virial = 0;
  for (int k = 0; k < 3; ++k) virial -= force[k].x * moved[k].x;
  CHECK(virial / (a * b * area) == Approx(0.7 * (a - 1 / (a * a * a * b * b)) / b).epsilon(1e-12));
}

TEST_CASE("the reference shape is free of force") {
  Membranes membranes({cell_settings(500)});
  membranes.compute_forces();
  // Single links carry about 0.004 nN; what is left is rounding.
  for (const Vec3& f : to_host(membranes.views().force, membranes.vertices())) REQUIRE(norm(f) < 1e-13);
  const auto d = membranes.diagnostics()[0];
  CHECK(d.bending_fJ == Approx(0).margin(1e-15));
  CHECK(d.local_area_fJ == Approx(0).margin(1e-20));
  CHECK(d.stretch == Approx(1 / 2.2));
}

TEST_CASE("the shear modulus of a flat hexagonal patch is the one asked for") {
  const double asked = GENERATE(6.32, 4.0);
  CellSettings settings = cell_settings(200);
  settings.shear_modulus_uN_per_m = asked;
  const CellReference reference = make_reference(settings);
  const double edge = 0.5, strain = 1e-4;
  for (double turn : {0.0, 0.2, 0.5}) {
    // Six triangles around a vertex, sheared by `strain` along x; the lattice may lie at any angle.
    const double height = std::sqrt(3.0) / 2 * edge;
    TriangleRest rest{{edge, edge, edge}, {1, 1, 1}, {0, 0, 0}, 0.5 * edge * height};
    double stress = 0, area = 0;
    for (int t = 0; t < 6; ++t) {
      TriangleState state;
      const auto ring = [&](int k) {
        const double phi = turn + k * 60 * units::degree;
        return Vec3{edge * (std::cos(phi) + strain * std::sin(phi)), edge * std::sin(phi), 0};
      };
      state.corner[1] = ring(t);
      state.corner[2] = ring(t + 1);
      state.normal = {0, 0, 1};
      for (Vec3& n : state.other_normal) n = {0, 0, 1};
      state.area = rest.area;
      Vec3 force[3];
      triangle_forces(state, rest, reference.law, std::get<WlcPow>(reference.in_plane), {0, 0}, force);
      // Virial stress of the triangle's forces on its own corners.
      for (int k = 0; k < 3; ++k) stress -= force[k].x * state.corner[k].y;
      area += state.area;
    }
    const double modulus = stress / area / strain;
    CHECK(modulus == Approx(asked * units::uN_per_m).epsilon(0.01));  // the bound asked for
    report("shear modulus error {:.1e}", modulus / (asked * units::uN_per_m) - 1);
  }
}

TEST_CASE("spring law") {
  const WlcPowSpring law{3.7e-3};
  CHECK(law.force(0.5, 0.5) == Approx(0).margin(1e-18));
  CHECK(law.force(0.6, 0.5) > 0);
  CHECK(law.force(0.4, 0.5) < 0);
  // Equation 5 written out at x = 0.8, rest length 1: kT/p [1/(4 0.04) - 1/4 + 0.8] - k_p / l^2.
  const double l = 0.8 * 2.2, at_rest = 0.25 / std::pow(1 - 1 / 2.2, 2) - 0.25 + 1 / 2.2;
  CHECK(law.force(l, 1) == Approx(3.7e-3 * (6.25 + 0.55 - at_rest / (l * l))).epsilon(1e-12));
  CHECK(std::isfinite(law.force(5, 1)));  // beyond the contour length
}

TEST_CASE("a squeezed triangle: what it costs to flatten it, and what it takes part in bending") {
  // Eight times k_d, where k_d alone comes to one; from half the area at rest on, without a jump.
  CHECK(Squeeze(0.5).tension == 0);
  CHECK(Squeeze(0.499).tension == Approx(0).margin(1e-4));
  CHECK(Squeeze(0.25).tension == Approx(-2));
  CHECK(Squeeze(0).tension == Approx(-8));
  CHECK(Squeeze(0).energy == Approx(4.0 / 3));
  CHECK(BendingShare(0.5).value == 1);
  CHECK(BendingShare(0.499).value == Approx(1).epsilon(1e-4));
  CHECK(BendingShare(0.25).value == Approx(0.3125));
  CHECK(BendingShare(1e-9).value == Approx(0).margin(1e-15));
  for (const double ratio : {2.0, 0.7, 0.4, 0.1}) CHECK(BendingShare(ratio).over_ratio * ratio == Approx(BendingShare(ratio).value));
}

TEST_CASE("signed dihedral angle") {
  const Vec3 up{0, 0, 1}, along{0, 1, 0};
  const Dihedral convex = dihedral(up, {0.6, 0, 0.8}, along);  // the right-hand neighbour falls away
  CHECK(convex.sine == Approx(0.6));
  CHECK(convex.cosine == Approx(0.8));
  CHECK(dihedral(up, {-0.6, 0, 0.8}, along).sine == Approx(-0.6));
  // A biconcave cell has edges of both signs, and its spontaneous angle from Equation 13 is convex.
  const CellReference r = make_reference(cell_settings(500));
  double lowest = 0, highest = 0;
  for (const auto& a : r.rest_angle) {
    for (double angle : a) lowest = std::min(lowest, angle), highest = std::max(highest, angle);
  }
  CHECK(lowest < -1 * units::degree);
  CHECK(highest > 20 * units::degree);
}

TEST_CASE("triangles do not fold through each other, and up to a right angle bend by Equation 7 alone") {
  const double rest = GENERATE(-20, 0, 30) * units::degree, k_b = 2.8e-4;
  const auto at = [](double theta) { return Dihedral{std::cos(theta), std::sin(theta)}; };
  const auto moment = [&](double theta) { return bending_moment(at(theta), std::cos(rest), std::sin(rest), k_b); };
  const auto energy = [&](double theta) { return bending_energy(at(theta), std::cos(rest), std::sin(rest), k_b); };
  for (double degrees : {-178.0, -150.0, -100.0, -89.0, -30.0, 10.0, 89.0, 91.0, 135.0, 170.0, 179.0}) {
    const double theta = degrees * units::degree, h = 1e-5;
    INFO("at " << degrees << " degrees, " << rest / units::degree << " at rest");
    CHECK(moment(theta) == Approx((energy(theta + h) - energy(theta - h)) / (2 * h)).epsilon(1e-5));
    if (std::abs(degrees) < 90) CHECK(moment(theta) == Approx(k_b * std::sin(theta - rest)));
    if (std::abs(degrees) > 134) CHECK(moment(theta) * theta > k_b * std::sin(theta - rest) * theta);
  }
  // From both sides against the fold, ever more so, which its rest angle changes by k_b at most.
  for (double side : {-1.0, 1.0})
    for (double degrees : {150.0, 170.0, 179.0})
      CHECK(side * moment(side * (degrees + 0.9) * units::degree) > side * moment(side * degrees * units::degree));
  CHECK(moment(179.9 * units::degree) > 6 * k_b);
  CHECK(moment(-179.9 * units::degree) < -6 * k_b);
  CHECK(std::isfinite(energy(180 * units::degree)));
  // What is sharp at rest is at rest.
  const double sharp = 120 * units::degree;
  CHECK(bending_moment(at(sharp), std::cos(sharp), std::sin(sharp), k_b) == Approx(0).margin(1e-18));
}

TEST_CASE("reference states") {
  CellSettings settings = cell_settings(500);
  const CellReference shape = make_reference(settings);
  settings.reference = CellSettings::Reference::spontaneous_angle;
  const CellReference angle = make_reference(settings);
  settings.reference = CellSettings::Reference::uniform;
  const CellReference uniform = make_reference(settings);
  CHECK(shape.law.rest_area == Approx(area(shape.mesh)));
  CHECK(angle.rest_length == shape.rest_length);
  // Equation 13 by hand for 500 vertices: arccos((862.56 - 15.708) / (862.56 - 9.4248)).
  CHECK(angle.rest_angle[7][1] / units::degree == Approx(6.958).margin(0.001));
  CHECK(uniform.rest_angle == angle.rest_angle);
  CHECK(uniform.law.rest_area == 135);
  CHECK(uniform.law.rest_volume == 94);
  CHECK(uniform.rest_length[0] == uniform.rest_length[500]);
}

TEST_CASE("constants out of range are refused") {
  CellSettings s = cell_settings(200);
  const auto refused = [&](const std::string& key) {
    CHECK_THROWS_WITH(make_reference(s), Catch::Matchers::Contains("cells." + key));
    s = cell_settings(200);
  };
  s.local_area_modulus_uN_per_m = 0, refused("local_area_modulus_uN_per_m");
  s.law = CellSettings::Law::neo_hookean, s.local_area_modulus_uN_per_m = -1, refused("local_area_modulus_uN_per_m");
  s.law = CellSettings::Law::skalak, s.skalak_c = -1, refused("skalak_c");
  s.type = 3, s.shear_modulus_uN_per_m = -1;
  CHECK_THROWS_WITH(make_reference(s), Catch::Matchers::Contains("cell_types.3.shear_modulus_uN_per_m"));
  s = cell_settings(200);
  s.mass_pg = 0, refused("mass_pg");
  s.shear_modulus_uN_per_m = -1, refused("shear_modulus_uN_per_m");
  s.membrane_viscosity_N_s_per_m = NAN, refused("membrane_viscosity_N_s_per_m");
}
