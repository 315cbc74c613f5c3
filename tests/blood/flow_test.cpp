// Volumes and flows of cells across a tube, from their membranes; how far out they reach; stress on walls.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "../fluid/fluid_fixture.hpp"
#include "../verification/order.hpp"
#include "blood/cell_flow.hpp"
#include "blood/cell_shape.hpp"
#include "blood/core_edge.hpp"
#include "blood/guided_flow.hpp"
#include "immersed/surface.hpp"
#include "membrane/mesh_generator.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

constexpr double radius = 5, pi = 3.14159265358979323846;

Case tube_case(bool bent, bool periodic, int across = 12, int along = 20) {
  Case scene;
  scene.grid = tube(across, along);
  scene.grid->length_um = 20;
  if (bent) {
    scene.grid->generator = GridSettings::Generator::swept_tube;
    scene.grid->centerline = GridSettings::Centerline::arc;
    scene.grid->arc_radius_um = 12;
    scene.grid->arc_angle_deg = 90;
  }
  const Type ends = periodic ? Type::periodic : Type::wall;
  scene.boundaries = sides({Type::wall, Type::wall, Type::wall, Type::wall, ends, ends});
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  if (periodic) scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -1};
  return scene;
}

FlowFrame frame_of(const Case& scene) {
  const bool periodic = scene.boundaries[4].type == Type::periodic;
  Grid grid(Comm(), make_node_source(*scene.grid), {false, false, periodic});
  FluidSolver fluid(grid, *scene.fluid, scene.boundaries, &*scene.grid);
  return find_guided_flow(scene, fluid)->frame;
}

TriangleMesh moved(TriangleMesh mesh, const Triple& by) {
  for (Triple& x : mesh.vertices)
    for (int d = 0; d < 3; ++d) x[d] += by[d];
  return mesh;
}

/// Columns of CellFlowColumn, of cells that move as `velocity(x)` says.
template <class Velocity>
std::vector<double> sums_of(const FlowFrame& frame, int bins, const std::vector<TriangleMesh>& meshes, const Velocity& velocity) {
  const int cells = static_cast<int>(meshes.size());
  const SurfaceSet set = make_surface_set(meshes, cells);
  const auto v = Kokkos::create_mirror_view(set.v);
  int vertex = 0;
  for (const auto& mesh : meshes)
    for (const Triple& x : mesh.vertices) store(v, vertex++, velocity(Vec3{x[0], x[1], x[2]}));
  Kokkos::deep_copy(set.v, v);
  const Table<double> parts("corpuscle::test::parts", cells * sections, CellFlowColumn::within + bins);
  const Array<double> totals("corpuscle::test::totals", CellFlowColumn::within + bins);
  sum_cell_flow(set, cells, frame, bins, parts, totals);
  const auto host = on_host(totals);
  return {host.data(), host.data() + host.size()};
}

/// Of a sphere around the axis of a cylinder, what is within the cylinder.
double within(double sphere, double cylinder) {
  return cylinder >= sphere ? 4 * pi / 3 * std::pow(sphere, 3)
                            : 4 * pi / 3 * (std::pow(sphere, 3) - std::pow(sphere * sphere - cylinder * cylinder, 1.5));
}

double layer_of(const FlowFrame& frame, const std::vector<TriangleMesh>& meshes, int windows) {
  const SurfaceSet set = make_surface_set(meshes, static_cast<int>(meshes.size()));
  const Table<double> edge("corpuscle::test::edge", windows, view_count(frame) + filled_columns);
  find_core_edge(set, set.triangles, frame, windows, edge);
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), edge);
  return cell_free_layer(frame, windows, host.data());
}

}  // namespace

TEST_CASE("a cell's volume within each radius and its flow are exact", "[blood]") {
  constexpr int bins = 10;
  constexpr double size = 2;
  const auto sphere = ellipsoid_mesh({size, size, size}, 2000);
  const FlowFrame frame = frame_of(tube_case(false, true));
  SECTION("on the axis, through the periodic side") {
    const auto at_end = moved(sphere, {0, 0, 9.5});
    const auto sums = sums_of(frame, bins, {sphere, at_end}, [](const Vec3&) { return Vec3{0.1, -0.2, 0.3}; });
    const double whole = volume(sphere);
    CHECK(sums[CellFlowColumn::volume] == Approx(2 * whole).epsilon(1e-12));
    CHECK(sums[CellFlowColumn::flow] == Approx(2 * whole * 0.3).epsilon(1e-12));
    // What a mesh encloses is less than the sphere's by 0.3 %; the quadrature across the cylinder's surface leaves as
    // much.
    for (int b = 0; b < bins; ++b)
      CHECK(sums[CellFlowColumn::within + b] == Approx(2 * within(size, radius * (b + 1) / bins)).epsilon(6e-3));
    CHECK(sums[CellFlowColumn::within + bins - 1] == Approx(2 * whole).epsilon(1e-4));
  }
  SECTION("beside the axis, turning about itself") {
    const Vec3 center{1.5, 1, 3};
    const auto beside = moved(sphere, {1.5, 1, 3});
    const Vec3 spin{0.2, 0.5, -0.3};
    const auto sums = sums_of(frame, bins, {beside}, [&](const Vec3& x) { return Vec3{0, 0, 0.1} + cross(spin, x - center); });
    Sums<10> moments;
    for (const auto& t : beside.triangles) {
      Vec3 corner[3];
      for (int k = 0; k < 3; ++k)
        for (int d = 0; d < 3; ++d) corner[k][d] = beside.vertices[t[k]][d];
      moments += tetrahedron_moments(corner);
    }
    // A quadratic integrand: exact, of what the mesh encloses.
    const Vec3 off = Vec3{moments[1], moments[2], moments[3]} - moments[0] * center;
    CHECK(sums[CellFlowColumn::flow] == Approx(0.1 * moments[0] + cross(spin, off).z).epsilon(1e-11));
    CHECK(sums[CellFlowColumn::within + bins - 1] == Approx(volume(sphere)).epsilon(1e-4));
    double inner = 0;  // the sphere's height over each place of the innermost bin
    constexpr int rings = 50;
    for (int a = 0; a < rings; ++a)
      for (int b = 0; b < rings; ++b) {
        const double r = 0.5 * (a + 0.5) / rings, angle = 2 * pi * b / rings;
        const double apart = std::hypot(r * std::cos(angle) - center.x, r * std::sin(angle) - center.y);
        if (apart < size) inner += 2 * std::sqrt(size * size - apart * apart) * r * (0.5 / rings) * (2 * pi / rings);
      }
    CHECK(sums[CellFlowColumn::within] == Approx(inner).epsilon(0.01));
  }
}

TEST_CASE("a bent tube has the coordinates that it was made with", "[blood]") {
  constexpr int bins = 10;
  constexpr double size = 2, bend = 12;  // the arc's centre is at x = 12, z = 0; it begins along z
  const FlowFrame frame = frame_of(tube_case(true, false));
  CHECK(frame.length == Approx(bend * pi / 2).epsilon(1e-6));
  const double angle = pi / 5, out = 1.2;  // beside the centreline, outwards
  const Triple center{bend - (bend + out) * std::cos(angle), 0.7, (bend + out) * std::sin(angle)};
  const auto sphere = moved(ellipsoid_mesh({size, size, size}, 2000), center);
  // Carried around the arc's centre as a whole: along the centreline all of it goes at rate x bend.
  constexpr double rate = 0.01;
  const auto sums = sums_of(frame, bins, {sphere}, [&](const Vec3& x) { return rate * cross(Vec3{0, 1, 0}, x - Vec3{bend, 0, 0}); });
  CHECK(sums[CellFlowColumn::flow] == Approx(volume(sphere) * rate * bend).epsilon(1e-3));
  CHECK(sums[CellFlowColumn::within + bins - 1] == Approx(volume(sphere)).epsilon(1e-3));
  // Against counting: random points in the sphere within a radius of 2 um of the centreline.
  std::srand(5);
  long inside = 0, near = 0;
  while (inside < 200000) {
    Vec3 x;
    for (int d = 0; d < 3; ++d) x[d] = size * (2.0 * std::rand() / RAND_MAX - 1);
    if (dot(x, x) > size * size) continue;
    ++inside;
    for (int d = 0; d < 3; ++d) x[d] += center[d];
    const double from_axis = std::hypot(std::hypot(x.x - bend, x.z) - bend, x.y);
    near += from_axis < 2 ? 1 : 0;
  }
  CHECK(sums[CellFlowColumn::within + 3] / volume(sphere) == Approx(static_cast<double>(near) / inside).epsilon(0.01));
}

TEST_CASE("the cell-free layer is what the outermost membranes leave, seen from all sides", "[blood]") {
  const FlowFrame frame = frame_of(tube_case(false, true));
  const auto sphere = ellipsoid_mesh({2, 2, 2}, 2000);
  CHECK(layer_of(frame, {sphere}, 1) == Approx(3).margin(0.02));
  // Beside the axis it is thinner on one side by as much as it is thicker on the other.
  CHECK(layer_of(frame, {moved(sphere, {0.8, -0.5, 4})}, 1) == Approx(3).margin(0.02));
  // Two on opposite sides: in the direction of either the nearer one counts.
  double both = 0;
  for (int k = 0; k < 16; ++k) both += 5 - (2 + 1.5 * std::abs(std::cos(2 * pi * k / 16))) * 1.0;
  CHECK(layer_of(frame, {moved(sphere, {1.5, 0, 4}), moved(sphere, {-1.5, 0, -4})}, 1) == Approx(both / 16).margin(0.02));
  // A mesh far coarser than the windows leaves none out.
  const double coarse = layer_of(frame, {ellipsoid_mesh({2, 2, 2}, 42)}, 100), fine = layer_of(frame, {sphere}, 100);
  CHECK(coarse == Approx(fine).margin(0.2));
  // In short windows they do not hide behind each other, and windows without a cell say nothing. On both sides of the
  // periodic end it is one cell.
  const double split = layer_of(frame, {moved(sphere, {0, 0, 10})}, 20), whole = layer_of(frame, {sphere}, 20);
  CHECK(split == Approx(whole).margin(0.02));
  // Nor does it matter much where the windows are: a tip that looks into one, which alone would leave 4.6 um, does not
  // count as a window full of cell (then it would be 3.4 um).
  for (const double shift : {0.05, 0.3, 0.5, 0.9}) CHECK(layer_of(frame, {moved(sphere, {0, 0, shift})}, 20) == Approx(whole).margin(0.08));
  CHECK(whole == Approx(5 - 0.5 * (2 + std::sqrt(3.0))).margin(0.03));  // two windows a side, of which one is a um off the middle
}

TEST_CASE("plasma alone is solved for on a piece of few cells, of any section", "[blood]") {
  const auto speed = [](const Triple& size, const std::array<int, 3>& cells, bool duct) {
    Case scene;
    scene.grid = GridSettings{};
    scene.grid->generator = GridSettings::Generator::box;
    scene.grid->upper_um = size;
    scene.fluid = FluidSettings{};
    scene.fluid->pressure_gradient_Pa_per_um = {0, 0, -1};
    for (int d = 0; d < 3; ++d) scene.grid->nodes[d] = cells[d] + 1;
    for (int n = 0; n < 6; ++n) {
      BoundarySettings side;
      side.side = static_cast<BoundarySettings::Side>(n);
      side.type = n / 2 == 1 || (duct && n / 2 == 0) ? BoundarySettings::Type::wall : BoundarySettings::Type::periodic;
      scene.boundaries.push_back(side);
    }
    std::array<bool, 3> periodic{!duct, false, true};
    Grid grid(Comm(), make_node_source(*scene.grid), periodic);
    FluidSolver fluid(grid, *scene.fluid, scene.boundaries, &*scene.grid);
    return plasma_speed(Comm(), scene, *find_guided_flow(scene, fluid)) * 12 * fluid.viscosity() / (1e-3 * size[1] * size[1]);
  };
  // Between plates G h^2 / 12 mu; walls half a cell from the nodes beside them leave an error of second order.
  CHECK(speed({6, 10, 12}, {6, 40, 12}, false) == Approx(1).epsilon(2e-3));
  CHECK(speed({6, 100, 12}, {6, 600, 12}, false) == Approx(1).epsilon(1e-4));
  // A square duct: 0.4217 of that, as Boussinesq's series has it.
  CHECK(speed({10, 10, 30}, {40, 40, 60}, true) == Approx(0.4217).epsilon(5e-3));
}

namespace {

/// Over the exact stress: rms and largest of what is farther than 15 degrees from the grid's four corners on the wall,
/// where its lines meet at a straight angle; largest there; mean of all. And of the mean speed that plasma alone has.
struct StressError {
  double rms = 0, largest = 0, corner = 0, mean = 0, plasma = 0;
};

/// Of the stress on the tube's wall in developed flow, against Poiseuille's.
StressError poiseuille_stress_error(GridSettings::CrossSection map, int across) {
  Case scene = tube_case(false, true, across, 6);
  scene.grid->length_um = 3;
  scene.grid->cross_section = map;
  scene.fluid->momentum_tolerance = 1e-11;
  Grid grid(Comm(), make_node_source(*scene.grid), {false, false, true});
  const IndexSpace& index = grid.index();
  FluidSolver fluid(grid, *scene.fluid, scene.boundaries, &*scene.grid);
  for (int n = 1; n <= 5; ++n) fluid.begin_step(1000), fluid.solve(1000.0 * n, nullptr);  // steps of 300 times the slowest decay
  const double exact = 1e-3 * radius / 2;                                                 // half the gradient times the radius, kPa
  StressError error;
  const Components<double> stress("corpuscle::test::stress", index.size(), 3);
  find_wall_stress(scene.boundaries, fluid, stress);
  const GuidedFlow flow = *find_guided_flow(scene, fluid);
  error.plasma = plasma_speed(Comm(), scene, flow) / (exact * radius / (4 * fluid.viscosity())) - 1;
  CHECK(plasma_speed(Comm(), scene, flow) == Approx(mean_velocity(fluid)[2]).epsilon(1e-7));  // of a piece, and of the tube
  const auto found = on_host(stress), x = on_host(grid.views().x);
  int cells = 0, all = 0;
  visit_owned(index, [&](int i, int j, int, int c) {
    const bool wall = i == 0 || j == 0 || i == index.n[0] - 1 || j == index.n[1] - 1;
    if (!wall) {
      if (norm(load(found, c)) != 0) FAIL("stress away from the wall");
      return;
    }
    const double e = norm(load(found, c) - Vec3{0, 0, exact}) / exact;
    error.mean += found(c, 2) / exact - 1, ++all;
    const double from_corner = std::abs(std::remainder(std::atan2(x(c, 1), x(c, 0)) - pi / 4, pi / 2));
    if (from_corner < pi / 12) {
      error.corner = std::max(error.corner, e);
      return;
    }
    error.rms += e * e, ++cells;
    error.largest = std::max(error.largest, e);
  });
  error.rms = std::sqrt(error.rms / cells), error.mean /= all;
  return error;
}

}  // namespace

TEST_CASE("the stress on a tube's wall converges on curvilinear grids, but for their four corners", "[blood]") {
  using Section = GridSettings::CrossSection;
  for (const auto map : {Section::conformal, Section::elliptical}) {
    std::vector<double> spacing, rms, largest;
    StressError error;
    for (const int across : {18, 24, 36}) {
      error = poiseuille_stress_error(map, across);
      spacing.push_back(1.0 / across), rms.push_back(error.rms), largest.push_back(error.largest);
    }
    const auto text = fmt::format(
        "map {}: rms {:.2e} {:.2e} {:.2e}, order {:.2f}; largest {:.2e} {:.2e} {:.2e}, order {:.2f}; corner {:.2e}, "
        "mean {:.2e}, plasma {:.2e}",
        static_cast<int>(map), rms[0], rms[1], rms[2], fitted_order(spacing, rms), largest[0], largest[1], largest[2],
        fitted_order(spacing, largest), error.corner, error.mean, error.plasma);
    INFO(text);
    if (std::getenv("CORPUSCLE_SHOW")) WARN(text);
    const bool orthogonal = map == Section::conformal;
    CHECK(fitted_order(spacing, rms) > 1.5);  // 1.6; two would be the velocity's, and the corners are felt around them
    CHECK(rms[2] < (orthogonal ? 4e-4 : 2e-3));
    CHECK(largest[2] < (orthogonal ? 5e-4 : 4e-3));
    CHECK(error.corner < 0.08);  // on any grid: 4 and 7 %
    CHECK(std::abs(error.mean) < 3e-3);
    CHECK(std::abs(error.plasma) < 0.01);
  }
}
