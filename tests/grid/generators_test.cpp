#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "grid/spacing_map.hpp"
#include "grid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::grid_test;
using Map = GridSettings::CrossSection;

namespace {

double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double distance(const Triple& a, const Triple& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

GridSettings arc(double radius, double angle) {
  GridSettings s = tube_settings(8, 16, Map::conformal);
  s.generator = GridSettings::Generator::swept_tube;
  s.centerline = GridSettings::Centerline::arc;
  s.arc_radius_um = radius;
  s.arc_angle_deg = angle;
  return s;
}

GridSettings helix() {
  GridSettings s = arc(0, 0);
  s.centerline = GridSettings::Centerline::helix;
  s.helix_radius_um = 15;
  s.helix_pitch_um = 30;
  s.helix_turns = 1.5;
  return s;
}

GridSettings spline() {
  GridSettings s = arc(0, 0);
  s.centerline = GridSettings::Centerline::spline;
  s.points_um = {{0, 0, 0}, {4, 0, 12}, {-3, 5, 26}, {0, 9, 41}, {6, 4, 55}};
  return s;
}

}  // namespace

TEST_CASE("box nodes are where the settings put them", "[grid]") {
  GridSettings s;
  s.nodes = {5, 6, 4};
  s.lower_um = {-1, 0, 2};
  s.upper_um = {1, 5, 8};
  const NodeSource source = make_node_source(s);
  REQUIRE(source.cells == std::array<int, 3>{4, 5, 3});
  CHECK(source.node(0, 0, 0) == s.lower_um);
  CHECK(source.node(4, 5, 3) == s.upper_um);
  CHECK(distance(source.node(1, 2, 1), {-0.5, 2, 4}) < 1e-15);  // round-off
}

TEST_CASE("the square's edge lands exactly on the circle", "[grid]") {
  const Map map = GENERATE(Map::conformal, Map::elliptical);
  for (int n = 0; n <= 40; ++n) {
    const double t = -1 + n / 20.0;
    for (const auto& p : {square_to_disk(t, -1, map), square_to_disk(1, t, map), square_to_disk(t, 1, map), square_to_disk(-1, t, map)})
      CHECK(std::hypot(p[0], p[1]) == Approx(1).epsilon(2e-14));  // round-off of the series behind the conformal map
  }
  const auto middle = square_to_disk(0, 0, map);
  CHECK(std::hypot(middle[0], middle[1]) < 1e-15);
  const auto p = square_to_disk(0.3, -0.8, map), q = square_to_disk(-0.3, -0.8, map);
  CHECK(std::abs(p[0] + q[0]) + std::abs(p[1] - q[1]) < 1e-14);  // mirror image, to round-off
}

TEST_CASE("the conformal map keeps angles", "[grid]") {
  for (const auto& [u, v] : {std::array{0.1, 0.2}, std::array{-0.7, 0.4}, std::array{0.5, 0.85}}) {
    const double h = 1e-5;
    const auto e = square_to_disk(u + h, v, Map::conformal), w = square_to_disk(u - h, v, Map::conformal);
    const auto n = square_to_disk(u, v + h, Map::conformal), s = square_to_disk(u, v - h, Map::conformal);
    // Cauchy and Riemann: x_u = y_v and x_v = -y_u; central differences are good to h^2 = 1e-10.
    CHECK((e[0] - w[0]) == Approx(n[1] - s[1]).margin(2e-9 * h));
    CHECK((n[0] - s[0]) == Approx(w[1] - e[1]).margin(2e-9 * h));
  }
}

TEST_CASE("the tube's wall nodes lie on its circle and its volume converges", "[grid]") {
  const Map map = GENERATE(Map::conformal, Map::elliptical);
  const double pi = std::acos(-1.0), exact = pi * 25 * 20;
  double error[4];
  for (int level = 0; level < 4; ++level) {
    const int n = 8 << level;
    const GridSettings s = tube_settings(n, 4, map);
    const NodeSource source = make_node_source(s);
    for (int m = 0; m <= n; ++m)
      for (const auto& x : {source.node(m, 0, 1), source.node(m, n, 1), source.node(0, m, 1), source.node(n, m, 1)})
        CHECK(std::hypot(x[0], x[1]) == Approx(5).epsilon(2e-14));
    CHECK(source.node(0, 0, 0)[2] == -10);
    CHECK(source.node(0, 0, 4)[2] == 10);
    const Comm comm;
    const Grid grid(comm, source, {false, false, false});  // refuses volumes that are not positive
    error[level] = 1 - grid.total_volume() / exact;
  }
  for (int level = 1; level < 4; ++level) {
    CHECK(std::log2(error[level - 1] / error[level]) == Approx(2).margin(0.1));
    // A regular polygon of 4 n corners lacks 2 pi^2 / (3 (4 n)^2) of the circle; the uneven corners of the
    // conformal map lack 1.8 times as much.
    CHECK(error[level] < 1.9 * 2 * pi * pi / (3 * std::pow(4 * (8 << level), 2)));
  }
}

TEST_CASE("arc and helix have the length, axis and curvature of the exact curves", "[grid]") {
  const double pi = std::acos(-1.0);
  const Centerline curve(arc(20, 90));
  CHECK(curve.length() == Approx(10 * pi).epsilon(1e-8));          // 20000 chords
  CHECK(curve.largest_curvature() == Approx(0.05).epsilon(1e-4));  // differences over 1/4000 of the length
  for (int m = 0; m <= 50; ++m) {
    const auto f = curve.at(curve.length() * m / 50);
    CHECK(std::hypot(f.position[0] - 20, f.position[2]) == Approx(20).epsilon(1e-7));  // straight between 4000 points
    CHECK(std::abs(f.position[1]) < 1e-12);
  }
  const Centerline spiral(helix());
  const double rise = 30 / (2 * pi);
  CHECK(spiral.length() == Approx(3 * pi * std::hypot(15, rise)).epsilon(1e-8));
  CHECK(spiral.largest_curvature() == Approx(15 / (225 + rise * rise)).epsilon(1e-4));
  for (int m = 0; m <= 50; ++m) {
    const auto f = spiral.at(spiral.length() * m / 50);
    CHECK(std::hypot(f.position[0], f.position[1]) == Approx(15).epsilon(1e-6));
  }
}

TEST_CASE("the spline passes through its points", "[grid]") {
  const GridSettings s = spline();
  const Centerline curve(s);
  constexpr int samples = 40000;
  for (const auto& point : s.points_um) {
    double nearest = 1e9;
    for (int m = 0; m <= samples; ++m) nearest = std::min(nearest, distance(curve.at(curve.length() * m / samples).position, point));
    CHECK(nearest < curve.length() / samples);  // the spacing of the samples
  }
}

TEST_CASE("frames are orthonormal, follow the tangent and do not twist", "[grid]") {
  const GridSettings s = GENERATE(arc(20, 120), helix(), spline());
  const Centerline curve(s);
  const double step = 0.02;
  double turned = 0;
  for (double at = 0; at + step < curve.length(); at += step) {
    const auto f = curve.at(at), g = curve.at(at + step);
    REQUIRE(std::abs(dot(f.tangent, f.normal)) + std::abs(dot(f.tangent, f.binormal)) + std::abs(dot(f.normal, f.binormal)) < 1e-12);
    REQUIRE(std::abs(dot(f.normal, f.normal) - 1) + std::abs(dot(f.binormal, f.binormal) - 1) < 1e-12);
    const Triple chord{g.position[0] - f.position[0], g.position[1] - f.position[1], g.position[2] - f.position[2]};
    REQUIRE(dot(chord, f.tangent) / std::sqrt(dot(chord, chord)) > 1 - 1e-4);  // turns by 0.1 / um x 0.02 um at most
    turned += dot(g.normal, f.binormal);
  }
  // Rotation about the tangent over the whole length, rad; the differences leave step x curvature^2 x length.
  CHECK(std::abs(turned) < 2e-3);
}

TEST_CASE("frames of the helix lag the principal normal by the integral of the torsion", "[grid]") {
  const Centerline curve(helix());
  const double rise = 30 / (2 * std::acos(-1.0)), torsion = rise / (225 + rise * rise);
  const auto angle = [](const Centerline::Frame& f) {  // from the principal normal, which points at the axis
    const double r = std::hypot(f.position[0], f.position[1]);
    const Triple inward{-f.position[0] / r, -f.position[1] / r, 0};
    return std::atan2(dot(inward, f.binormal), dot(inward, f.normal));
  };
  const double pi = std::acos(-1.0);
  double change = angle(curve.at(curve.length())) - angle(curve.at(0)) - torsion * curve.length();
  change -= 2 * pi * std::round(change / (2 * pi));
  CHECK(std::abs(change) < 1e-3);  // one-sided tangents at the two ends
}

TEST_CASE("a swept tube keeps its radius and refuses a bend that folds it", "[grid]") {
  const GridSettings s = arc(20, 90);
  const NodeSource source = make_node_source(s);
  for (int k = 0; k <= 16; ++k) {
    const Triple axis = source.node(4, 4, k);
    for (int m = 0; m <= 8; ++m) CHECK(distance(source.node(m, 0, k), axis) == Approx(5).epsilon(1e-12));
  }
  const Comm comm;
  const Grid grid(comm, source, {false, false, false});
  // Pappus: the bent tube has the volume of a straight one of its length; the polygon of 32 corners and the 16 straight
  // pieces of 5.6 degrees lack 1.1 % and 0.2 %.
  CHECK(grid.total_volume() == Approx(std::acos(-1.0) * 25 * 10 * std::acos(-1.0)).epsilon(0.014));
  CHECK_THROWS_AS(make_node_source(arc(5.2, 90)), InputError);
  CHECK_THROWS_WITH(make_node_source(arc(5.2, 90)), Catch::Contains("fold") && Catch::Contains("arc_radius_um"));
  CHECK_NOTHROW(make_node_source(arc(5.5, 90)));
}

TEST_CASE("a swept tube that runs through itself is refused with the place", "[grid]") {
  const auto refused = [](const GridSettings& s, const std::string& place) {
    CHECK_THROWS_WITH(make_node_source(s), Catch::Contains("runs through itself") && Catch::Contains(place));
  };
  GridSettings s = spline();  // 10 um wide
  SECTION("a loop that crosses itself") {
    s.points_um = {{-40, 0, 0}, {0, 0, 0}, {30, 20, 0}, {0, 45, 0}, {-30, 20, 2}, {0, -1, 4}, {40, -10, 4}};
    refused(s, "comes back to");
  }
  SECTION("two ends side by side") {
    s.points_um = {{0, 0, 0}, {0, 0, 30}, {0, 0, 60}, {0, 15, 75}, {0, 30, 60}, {0, 20, 30}, {0, 8, 0}};
    refused(s, "um from where it was at");
  }
  SECTION("turns of a helix too low") {
    s = helix();
    s.helix_pitch_um = 9.5;  // the tube's diameter is 10 um, the turns' distance across the slant 9.45
    refused(s, "grid.helix_pitch_um");
    s.helix_pitch_um = 0.01;
    refused(s, "grid.helix_pitch_um");
  }
  SECTION("but not when it comes near itself") {
    s = helix();
    s.helix_pitch_um = 10.2;
    CHECK_NOTHROW(make_node_source(s));
    CHECK_NOTHROW(make_node_source(arc(5.4, 350)));
    CHECK_NOTHROW(make_node_source(spline()));
    s = spline();
    s.points_um = {{0, 0, 0}, {0, 0, 30}, {0, 0, 60}, {0, 15, 75}, {0, 30, 60}, {0, 20, 30}, {0, 12, 0}};
    CHECK_NOTHROW(make_node_source(s));
  }
}

TEST_CASE("the tightest bend is named with its place", "[grid]") {
  GridSettings s = spline();
  s.points_um = {{0, 0, 0}, {0, 0, 40}, {0, 20, 60}, {0, 28, 40}, {0, 9, 0}};  // turns about the third point
  CHECK_THROWS_WITH(make_node_source(s), Catch::Contains("fold") && Catch::Contains("at (0, 19.8") && Catch::Contains("grid.points_um"));
}

TEST_CASE("the spacing of nodes, place by place and across the grid lines", "[grid]") {
  GridSettings box;
  box.nodes = {5, 9, 17};
  box.upper_um = {4, 4, 4};  // 1 x 0.5 x 0.25 um
  const Grid grid(Comm(), make_node_source(box), {false, false, false});
  const SpacingMap map(grid);
  CHECK(map.upper() == Triple{4, 4, 4});
  const NodeSteps steps = map.near({1, 1, 1}, {2, 2, 2});
  CHECK(steps.spacing({1, 0, 0}) == Approx(1).epsilon(1e-12));
  CHECK(steps.spacing({0, 1, 0}) == Approx(0.5).epsilon(1e-12));
  CHECK(steps.spacing({0, 0, 1}) == Approx(0.25).epsilon(1e-12));
  CHECK(steps.spacing({0, 0.6, 0.8}) == Approx(std::hypot(0.6 * 0.5, 0.8 * 0.25)).epsilon(1e-12));
  CHECK(steps.along(1, {0, 0.6, 0.8}) == Approx(std::pow(0.6 * 0.5, 2)).epsilon(1e-12));
  // Outside of the grid: the mean of it.
  CHECK(map.near({40, 40, 40}, {41, 41, 41}).spacing({0, 0, 1}) == Approx(0.25).epsilon(1e-12));
}
