#include "membrane/surface_file.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "core/error.hpp"
#include "coupling/rigid_bodies.hpp"
#include "membrane/inertia.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/mesh_io.hpp"
#include "membrane/mesh_repair.hpp"
#include "membrane/self_crossing.hpp"
#include "membrane/stretching.hpp"
#include "temporary_file.hpp"

using namespace corpuscle;
using Catch::Matchers::Contains;

namespace {

TriangleMesh moved(TriangleMesh mesh, const Triple& by, double scale = 1) {
  for (auto& p : mesh.vertices)
    for (int d = 0; d < 3; ++d) p[d] = scale * (p[d] + by[d]);
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const int shift = int(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto t : other.triangles) mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

/// A sphere of radius 1 from an octahedron, each of whose triangles becomes 4^levels.
TriangleMesh octasphere(int levels) {
  TriangleMesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                    {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), int(mesh.vertices.size()));
      if (fresh) {
        Triple m;
        for (int d = 0; d < 3; ++d) m[d] = mesh.vertices[a][d] + mesh.vertices[b][d];
        const double length = std::hypot(m[0], m[1], m[2]);
        for (double& c : m) c /= length;
        mesh.vertices.push_back(m);
      }
      return it->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& t : mesh.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      for (const auto& f : {std::array{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}}) finer.push_back(f);
    }
    mesh.triangles = finer;
  }
  return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, const Triple& by) {
  for (auto& p : mesh.vertices)
    for (int d = 0; d < 3; ++d) p[d] *= by[d];
  return mesh;
}

/// A disc of 5 x 1.5 um.
const TriangleMesh disc = ellipsoid_mesh({2.5, 2.5, 0.75}, 300);

struct CellFile {
  explicit CellFile(const TriangleMesh& mesh) : file("cell.off") {
    write_off(file.path, mesh);
    cell.mesh = file.path;
  }
  FileSurface read() const { return read_cell_surface(cell); }
  std::string refusal() const {
    try {
      read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  TemporaryFile file;
  CellSettings cell;
};

void check_upright(const FileSurface& s) {
  const PrincipalAxes axes = principal_axes(s.mesh);
  for (int d = 0; d < 3; ++d) CHECK(axes.centroid[d] == Approx(0).margin(1e-12));
  CHECK(std::abs(axes.axis[0][2]) == Approx(1).epsilon(1e-9));
}

}  // namespace

TEST_CASE("principal axes of an ellipsoid, whichever way it lies") {
  const TriangleMesh mesh = octasphere(4);
  const TriangleMesh ellipsoid = scaled(mesh, {1, 3, 2});
  const PrincipalAxes upright = principal_axes(ellipsoid);
  const PrincipalAxes turned = principal_axes(transform(ellipsoid, {0, 1, 0}, 90, {7, 8, 9}));
  const double inscribed = std::pow(volume(mesh) / (4 * std::acos(-1.0) / 3), 2.0 / 3);
  for (int d = 0; d < 3; ++d) {
    CHECK(turned.centroid[d] == Approx(7.0 + d).epsilon(1e-12));
    CHECK(turned.moment[d] == Approx(upright.moment[d]).epsilon(1e-12));
    // a^2 / 5 of the exact ellipsoid; the mesh lies within it by the 0.4 % that its volume says, evenly to a tenth of that.
    CHECK(upright.moment[d] == Approx(inscribed * (d + 1) * (d + 1) / 5.0).epsilon(4e-4));
  }
  // 90 degrees about z take x to y, and z onto y then takes y to -z.
  CHECK(std::abs(turned.axis[0][2]) == Approx(1).epsilon(1e-12));
  CHECK(std::abs(turned.axis[1][1]) == Approx(1).epsilon(1e-12));
}

TEST_CASE("a disc is known by its axis, and nothing else is") {
  const auto axis_of = [](const Triple& semi_axes) { return disc_axis(principal_axes(scaled(octasphere(3), semi_axes))); };
  CHECK(disc_axis(principal_axes(biconcave_mesh(300))));
  REQUIRE(axis_of({1, 4, 4}));
  CHECK((*axis_of({1, 4, 4}))[0] == Approx(1).epsilon(1e-12));
  CHECK_FALSE(axis_of({2, 2, 2}));
  CHECK_FALSE(axis_of({2, 2, 6}));
  CHECK_FALSE(axis_of({1, 2, 6}));
}

TEST_CASE("a cell from a file lies about its own centre and axis") {
  const Triple tilt{0.3, 0.9, -0.4}, place{39, 40, 41};
  CellFile lying(transform(disc, tilt, 0, place));
  const FileSurface s = lying.read();
  check_upright(s);
  CHECK(s.disc);
  // The axis has no sense: the one with a positive z component is given.
  const double length = std::hypot(tilt[0], tilt[1], tilt[2]);
  for (int d = 0; d < 3; ++d) {
    CHECK(s.axis[d] == Approx(-tilt[d] / length).margin(1e-3));
    CHECK(s.centroid_um[d] == Approx(place[d]).margin(1e-3));
  }
  // The mesh's extremes lie up to an edge's sagitta, 0.3^2 / (8 x 0.25) um at the rim, within.
  CHECK(s.diameter_um == Approx(5).margin(0.05));
  CHECK(s.thickness_um == Approx(1.5).margin(0.05));
  CHECK(s.volume_um3 == Approx(volume(disc)).epsilon(1e-9));
  REQUIRE(s.notes.size() == 1);
  CHECK_THAT(s.notes[0], Contains("(39, 40, 41)") && Contains("recenter"));
  REQUIRE(s.warnings.size() == 1);
  CHECK_THAT(s.warnings[0], Contains("67 degrees") && Contains("align"));
  SECTION("unless it is to stay as it is") {
    lying.cell.recenter = lying.cell.align = false;
    const FileSurface as_it_is = lying.read();
    CHECK(as_it_is.mesh.vertices == transform(disc, tilt, 0, place).vertices);
    REQUIRE(as_it_is.warnings.size() == 2);
    CHECK_THAT(as_it_is.warnings[0], Contains("file's origin") && Contains("(39, 40, 41)"));
    CHECK_THAT(as_it_is.warnings[1], Contains("67 degrees"));
  }
}

TEST_CASE("an upright cell at the origin is not touched, nor is one without an axis turned") {
  const FileSurface upright = CellFile(biconcave_mesh(500)).read();
  CHECK(upright.notes.empty());
  CHECK(upright.warnings.empty());
  const FileSurface ball = CellFile(octasphere(2)).read();
  CHECK_FALSE(ball.disc);
  REQUIRE(ball.notes.size() == 1);
  CHECK_THAT(ball.notes[0], Contains("file's z is taken"));
}

TEST_CASE("diameter and thickness are those of the disc, wherever it lies") {
  const DiscShape upright = disc_shape(disc), lying = disc_shape(transform(disc, {0, 1, 0}, 20, {39, 39, 39}));
  CHECK(upright.diameter_um == Approx(5).margin(0.05));
  CHECK(lying.diameter_um == Approx(upright.diameter_um).epsilon(0.01));  // measured across other directions
  CHECK(lying.thickness_center_um == Approx(upright.thickness_center_um).epsilon(1e-3));
  CHECK(lying.thickness_max_um == Approx(upright.thickness_max_um).epsilon(1e-3));
  // An axis that meets vertices and edges, where chords are easily counted twice.
  CHECK(disc_shape(scaled(octasphere(2), {2.5, 0.75, 2.5})).thickness_center_um == Approx(1.5).epsilon(1e-5));
}

TEST_CASE("sizes that are not a cell's are refused with the scale that makes them one") {
  const TriangleMesh cell = biconcave_mesh(300);
  const auto scaled = [&](double scale) { return CellFile(moved(cell, {}, scale)); };
  CHECK_THAT(scaled(1e-3).refusal(), Contains("0.0078 um") && Contains("between 1 and 100 um") &&
                                         Contains("cells.scale = 1000 (a file in mm)") && Contains("7.8 um"));
  CHECK_THAT(scaled(1e-6).refusal(), Contains("cells.scale = 1e+06 (a file in m)"));
  CHECK_THAT(scaled(1e3).refusal(), Contains("cells.scale = 0.001 (a file in nm)"));
  CHECK_THAT(scaled(0.5).refusal(), Contains("accepted"));
  CellFile twice(moved(cell, {}, 1e-6));
  twice.cell.scale = 1e3;
  CHECK_THAT(twice.refusal(), Contains("with cells.scale = 1000") && Contains("cells.scale = 1e+06"));
  twice.cell.scale = 1e6;
  const FileSurface right = twice.read();
  CHECK(right.volume_um3 == Approx(volume(cell)).epsilon(1e-12));
  CHECK(right.area_um2 == Approx(area(cell)).epsilon(1e-12));
}

TEST_CASE("a ring is no cell, and a shape of few vertices hardly one") {
  TriangleMesh ring;
  constexpr int around = 24, across = 12;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / across, r = 3 + std::cos(b);
      ring.vertices.push_back({r * std::cos(a), r * std::sin(a), std::sin(b)});
      const int next = (i + 1) % around, up = (j + 1) % across;
      ring.triangles.push_back({i * across + j, next * across + j, next * across + up});
      ring.triangles.push_back({i * across + j, next * across + up, i * across + up});
    }
  CHECK_THAT(CellFile(ring).refusal(), Contains("1 handle, like a ring"));
  const auto warnings = [](int levels) { return CellFile(moved(octasphere(levels), {}, 4)).read().warnings; };
  REQUIRE(warnings(1).size() == 1);
  CHECK_THAT(warnings(1)[0], Contains("18 vertices are too few"));
  CHECK(warnings(3).empty());
}

TEST_CASE("surfaces that face inward, in whole or in part, are turned with a word") {
  TriangleMesh inward = disc;
  for (auto& t : inward.triangles) std::swap(t[1], t[2]);
  const FileSurface whole = CellFile(inward).read();
  CHECK(whole.volume_um3 == Approx(volume(disc)).epsilon(1e-12));
  REQUIRE(whole.notes.size() == 1);
  CHECK_THAT(whole.notes[0], Contains("all are turned"));
  TriangleMesh mixed = disc;
  for (int t : {0, 17, 18, 200}) std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  const FileSurface part = CellFile(mixed).read();
  CHECK(part.volume_um3 == Approx(volume(disc)).epsilon(1e-12));
  REQUIRE(part.notes.size() == 1);
  CHECK_THAT(part.notes[0], Contains("4 of its 596 triangles"));
}

TEST_CASE("one closed surface in several solids is read, several closed surfaces are not") {
  const TemporaryFile whole("whole.stl");
  write_stl(whole.path, disc, StlFormat::ascii);
  std::string text;
  {
    std::ifstream in(whole.path);
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  CellFile cell(disc);
  const TemporaryFile patches("patches.stl");
  const auto half = text.find("facet normal", text.size() / 2);
  patches.fill("solid top" + text.substr(text.find('\n'), half - text.find('\n')) + "endsolid top\nsolid bottom\n" + text.substr(half));
  cell.cell.mesh = patches.path;
  const FileSurface one = cell.read();
  CHECK(one.mesh.vertices.size() == 300);
  REQUIRE(one.notes.size() == 1);
  CHECK_THAT(one.notes[0], Contains("its 2 solids form one surface"));

  const TemporaryFile apart("apart.stl");
  std::string second = text;
  write_stl(whole.path, moved(disc, {20, 0, 0}), StlFormat::ascii);
  {
    std::ifstream in(whole.path);
    second.assign(std::istreambuf_iterator<char>(in), {});
  }
  apart.fill("solid first" + text.substr(text.find('\n')) + "solid second" + second.substr(second.find('\n')));
  cell.cell.mesh = apart.path;
  CHECK_THAT(cell.refusal(), Contains("apart.stl") && Contains("2 separate surfaces") && Contains("solid 'first' and solid 'second'"));

  TriangleMesh two = disc;
  append(two, moved(disc, {20, 0, 0}));
  CHECK_THAT(CellFile(two).refusal(), Contains("2 separate surfaces") && Contains("triangle 0 and triangle 596"));
  two.triangles.pop_back();
  CHECK_THAT(CellFile(two).refusal(), Contains("open"));
}

TEST_CASE("a surface that passes through itself is refused with the place") {
  SECTION("a spike through the other side") {
    TriangleMesh spike = moved(octasphere(2), {}, 2);
    spike.vertices[0] = {-3, 0.05, 0.03};  // was the pole at x = 2; ends 1 um beyond the other
    const auto found = find_self_crossing(spike);
    REQUIRE(found);
    // The spike's base is an edge wide, 0.8 um, 5 um from its point: where it goes through it is at most 0.3 um wide.
    CHECK(found->at[0] == Approx(-2).margin(0.1));
    CHECK(std::hypot(found->at[1], found->at[2]) < 0.3);
    CHECK_THAT(CellFile(spike).refusal(), Contains("passes through itself") && Contains("cross at (-"));
  }
  SECTION("dimples that meet") {
    TriangleMesh cell = biconcave_mesh(500);
    for (auto& p : cell.vertices)
      if (std::hypot(p[0], p[1]) < 1.2) p[2] += p[2] > 0 ? -0.6 : 0.6;  // 0.81 um thick at the centre
    const auto found = find_self_crossing(cell);
    REQUIRE(found);
    CHECK(std::hypot(found->at[0], found->at[1]) < 1.5);
    CHECK(std::abs(found->at[2]) < 0.1);
  }
  SECTION("edges that meet edges exactly") {
    TriangleMesh through = octasphere(3);
    for (auto& p : through.vertices) p[2] -= p[2] > 0 && std::hypot(p[0], p[1]) < 0.5 ? 2.2 : 0;  // what is above lies over what is below
    CHECK(find_self_crossing(through));
  }
  SECTION("neighbours folded onto each other") {
    TriangleMesh box{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 0}, {1, 1, 2}},
                     {{1, 0, 4}, {2, 1, 4}, {3, 2, 4}, {0, 3, 4}, {0, 1, 5}, {1, 2, 5}, {2, 3, 5}, {3, 0, 5}}};
    REQUIRE_NOTHROW(check_closed_surface(box, "pyramid"));
    CHECK_FALSE(find_self_crossing(box));
    box.vertices[4] = {1, -0.5, 0};  // beyond the edge between vertices 0 and 1, in the plane
    CHECK(find_self_crossing(box));
  }
}

TEST_CASE("surfaces that do not cross themselves are left alone, of whatever triangles") {
  CHECK_FALSE(find_self_crossing(biconcave_mesh(500)));
  CHECK_FALSE(find_self_crossing(scaled(octasphere(4), {1, 1, 1e-3})));  // what is above lies over what is below, and near it
  CHECK_FALSE(find_self_crossing(moved(scaled(octasphere(4), {1, 1, 9}), {1e4, 0, 0})));
  // A cube of twelve triangles, one of them cut into 3000: very unlike sizes.
  TriangleMesh cube{
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
      {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}}};
  for (int cut = 0; cut < 1000; ++cut) {
    const auto t = cube.triangles[3];
    Triple m{};
    for (int i : t)
      for (int d = 0; d < 3; ++d) m[d] += cube.vertices[i][d] / 3;
    if (cut % 3 == 0) std::rotate(cube.triangles.begin() + 3, cube.triangles.begin() + 4, cube.triangles.end());
    const int n = int(cube.vertices.size());
    cube.vertices.push_back(m);
    for (auto& other : cube.triangles)
      if (other == t) other = {t[0], t[1], n};
    cube.triangles.push_back({t[1], t[2], n});
    cube.triangles.push_back({t[2], t[0], n});
  }
  CHECK_FALSE(find_self_crossing(cube));
  CHECK_FALSE(find_self_crossing(octasphere(6)));  // 32768 triangles
}

TEST_CASE("bodies: an ellipsoid and a file can be tilted, scaled and centred") {
  BodySettings body;
  body.shape = BodySettings::Shape::ellipsoid;
  body.semi_axes_um = {1, 1, 3};
  body.vertices = 300;
  body.center_um = {5, 6, 7};
  const Triple upright = extents(make_body_mesh(body, 1));
  body.axis = {1, 0, 0};
  const TriangleMesh tilted = make_body_mesh(body, 1);
  const Triple lying = extents(tilted);
  CHECK(upright[2] > 5.7);  // 6 um less what the mesh leaves at its poles
  CHECK(lying[0] == Approx(upright[2]).epsilon(1e-12));
  CHECK(lying[2] == Approx(upright[0]).epsilon(1e-12));
  for (int d = 0; d < 3; ++d) CHECK(principal_axes(tilted).centroid[d] == Approx(body.center_um[d]).margin(1e-3));

  const TemporaryFile file("body.off");
  write_off(file.path, moved(disc, {10, 0, 0}, 1e-3));
  body.shape = BodySettings::Shape::file;
  body.file = file.path;
  body.scale = 1000;
  const auto centre = [&] { return principal_axes(make_body_mesh(body, 1)).centroid; };
  CHECK(extents(make_body_mesh(body, 1))[0] == Approx(1.5).margin(0.05));
  CHECK(centre()[2] == Approx(7 - 10).margin(1e-3));  // x of the file goes to -z
  const FileSurface off_centre = read_body_surface(body);
  REQUIRE(off_centre.notes.size() == 1);
  CHECK_THAT(off_centre.notes[0], Contains("(10, ") && Contains("bodies.recenter"));
  body.recenter = true;
  for (int d = 0; d < 3; ++d) CHECK(centre()[d] == Approx(body.center_um[d]).margin(1e-9));
}
