// Grids that bend come near themselves: what is near in space may be far along the grid.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "../fluid/fluid_fixture.hpp"
#include "cells/shared_cells.hpp"
#include "contact/wall_contact.hpp"
#include "transfer/cytosol.hpp"
#include "transfer/transfer.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

const double pi = std::acos(-1.0);

GridSettings swept(GridSettings::Centerline line, double diameter, int along) {
  GridSettings grid;
  grid.generator = GridSettings::Generator::swept_tube;
  grid.centerline = line;
  grid.diameter_um = diameter;
  grid.nodes = {13, 13, along};
  return grid;
}

/// Two legs side by side, 2 um between their walls, and half a circle.
GridSettings hairpin() {
  GridSettings grid = swept(GridSettings::Centerline::spline, 4.6, 61);
  for (int n = 0; n <= 4; ++n) grid.points_um.push_back({0, 0, 3.0 * n});
  for (int n = 1; n < 6; ++n) grid.points_um.push_back({3.3 - 3.3 * std::cos(n * pi / 6), 0, 12 + 3.3 * std::sin(n * pi / 6)});
  for (int n = 0; n <= 4; ++n) grid.points_um.push_back({6.6, 0, 12 - 3.0 * n});
  return grid;
}

GridSettings arc(double degrees) {
  GridSettings grid = swept(GridSettings::Centerline::arc, 6, 61);
  grid.nodes = {11, 11, 61};
  grid.arc_radius_um = 12;
  grid.arc_angle_deg = degrees;
  return grid;
}

Components<double> to_device(const std::vector<Triple>& points) {
  Components<double> x("corpuscle::test::x", points.size(), 3);
  const auto host = Kokkos::create_mirror_view(x);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int d = 0; d < 3; ++d) host(i, d) = points[i][d];
  Kokkos::deep_copy(x, host);
  return x;
}

/// Anywhere between the nodes, each as a place within one of the cells: of those at walls not nearer to them than 0.3 of one, as curved
/// walls are seen as chords.
std::vector<Triple> anywhere(const NodeSource& source, int count) {
  std::mt19937 random(7);
  const auto number = [&](int below) { return static_cast<int>(random() % static_cast<unsigned>(below)); };
  std::vector<Triple> points;
  for (int n = 0; n < count; ++n) {
    int at[3];
    double f[3];
    for (int d = 0; d < 3; ++d) at[d] = number(source.cells[d]), f[d] = 0.3 + 0.4 * number(1000) / 1000;
    Triple p{};
    for (int corner = 0; corner < 8; ++corner) {
      const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
      const Triple node = source.node(at[0] + a, at[1] + b, at[2] + c);
      const double weight = (a ? f[0] : 1 - f[0]) * (b ? f[1] : 1 - f[1]) * (c ? f[2] : 1 - f[2]);
      for (int d = 0; d < 3; ++d) p[d] += weight * node[d];
    }
    points.push_back(p);
  }
  return points;
}

const std::array<Type, 6> walls{Type::wall, Type::wall, Type::wall, Type::wall, Type::wall, Type::wall};

}  // namespace

TEST_CASE("in a tube that passes near itself every point is at home once, on any ranks", "[transfer][ranks]") {
  const Comm comm;
  const NodeSource source = make_node_source(hairpin());
  Grid grid(comm, source, {false, false, false});
  constexpr int count = 3000;
  std::vector<Triple> points = anywhere(source, count);
  Transfer transfer(grid, sides(walls), CouplingSettings::Kernel::three_point, count);
  Components<double> times("corpuscle::test::times", count, 3);
  for (int step = 0; step < 2; ++step) {  // from nothing, and from where they were
    Kokkos::deep_copy(times, 0.0);
    transfer.place(to_device(points));
    transfer.mark_at_home(times);
    CHECK(comm.sum(static_cast<double>(transfer.at_home())) == count);
    const auto host = on_host(times);
    std::vector<double> of_all(count);
    for (int n = 0; n < count; ++n) of_all[n] = host(n, 0);
    comm.sum(of_all.data(), count);
    int wrong = 0;
    for (const double here : of_all) wrong += here != 1;
    CHECK(wrong == 0);
    for (auto& p : points) p[1] *= 0.9995;
  }
  if (comm.size() > 1) return;
  CHECK(transfer.place(to_device(points)) == -1);
}

TEST_CASE("a wall is near only where its cells are: not behind the plane in which a bent tube ends", "[contact][ranks]") {
  const Comm comm;
  Grid grid(comm, make_node_source(arc(240)), {false, false, false});
  // All along the centreline, and there on a circle half a um off the wall.
  std::vector<Triple> middle, beside;
  constexpr int stations = 40;
  for (int n = 1; n < stations; ++n)
    for (int m = 0; m < 8; ++m) {
      const double angle = n * 4 * pi / 3 / stations, round = m * pi / 4 + 0.2;
      const auto at = [&](double r) {
        const double out = 12 + r * std::cos(round);
        return Triple{12 - out * std::cos(angle), r * std::sin(round), out * std::sin(angle)};
      };
      if (m == 0) middle.push_back(at(0));
      if (n > 2 && n < stations - 2) beside.push_back(at(2.5));
    }
  WallSides all;
  for (auto& pair : all.wall) pair[0] = pair[1] = true;
  const auto least = [&](const std::vector<Triple>& points, double reach) {
    SurfaceSet set;
    set.x = to_device(points);
    Transfer transfer(grid, sides(walls), CouplingSettings::Kernel::three_point, static_cast<int>(points.size()));
    transfer.place(set.x);
    return comm.min(least_wall_gap({transfer.block().lattice, transfer.views(), all, set, reach}));
  };
  CHECK(least(middle, 1) == 1e30);
  CHECK(least(middle, 2) == Approx(12 * 4 * pi / 3 / stations).epsilon(0.02));  // to the ends, along the arc
  CHECK(least(beside, 1) == Approx(0.5).margin(0.08));                          // walls are chords, of up to 1 um: 0.05 um off the circle
}

TEST_CASE("of two walls in a corner the nearer one counts, whichever it is", "[contact]") {
  GridSettings settings = box({8, 8, 8}, {2, 2, 2});
  Grid grid(Comm::alone(), make_node_source(settings), {false, false, false});
  WallSides all;
  for (auto& pair : all.wall) pair[0] = pair[1] = true;
  ContactLaw law;
  law.range = law.reach = 0.4, law.pressure = 0.02, law.knee = 0.05;
  SurfaceSet point;
  point.vertex_body = Array<int>("corpuscle::test::body", 1);
  point.to_place = Table<int>("corpuscle::test::to_place", 1, 2);
  ContactRest rest;
  rest.area = Array<double>("corpuscle::test::area", 1);
  Kokkos::deep_copy(rest.area, 1.0);
  for (int near = 0; near < 3; ++near)
    for (int end = 0; end < 2; ++end) {
      Triple p;
      for (int d = 0; d < 3; ++d) {
        const double gap = d == near ? 0.1 : 0.2, low = settings.lower_um[d], high = settings.upper_um[d];
        p[d] = end == 0 ? low + gap : high - gap;
      }
      const auto x = to_device({p});
      Transfer transfer(grid, sides(walls), CouplingSettings::Kernel::three_point, 1);
      transfer.place(x);
      point.x = x;
      const WallContacts contacts{transfer.block().lattice, transfer.views(), all, point, 0.4};
      CHECK(least_wall_gap(contacts) == Approx(0.1).epsilon(1e-9));
      Components<double> force("corpuscle::test::force", 1, 3);
      wall_forces(contacts, law, rest, force);
      const auto f = on_host(force);
      CHECK(f(0, near) * (end == 0 ? 1 : -1) == Approx(law.repulsion(0.1)).epsilon(1e-9));
      CHECK(std::abs(f(0, (near + 1) % 3)) < 1e-12);
    }
}

TEST_CASE("what is inside shared cells astride periodic sides has their volume", "[transfer][inside][ranks]") {
  const Comm comm;
  GridSettings settings = box({16, 16, 16}, {2, 2, 2});
  Grid grid(comm, make_node_source(settings), {true, true, true});
  std::vector<CellSettings> cells(1);
  cells[0].shape = CellSettings::Shape::sphere;
  cells[0].radius_um = 0.8;
  cells[0].vertices = 300;
  cells[0].law = CellSettings::Law::neo_hookean;
  cells[0].viscosity_ratio = 3;
  const int on = GENERATE(0, 1, 2, 3);  // a side, an edge, the corner
  for (int d = 0; d < 3; ++d)
    cells[0].center_um[d] = d < on ? settings.lower_um[d] + 0.1 : 0.5 * (settings.lower_um[d] + settings.upper_um[d]);
  SharedCells shared(places_of(cells), grid, IndexSpace::halo, 0, std::make_shared<Workspace>());
  shared.to_copies(shared.surfaces().x, true);
  const Type p = Type::periodic;
  Transfer transfer(grid, sides({p, p, p, p, p, p}), CouplingSettings::Kernel::three_point, shared.surfaces().vertices);
  transfer.place(shared.surfaces().x);
  Cytosol cytosol(grid, {3});
  cytosol.update(transfer, shared.surfaces(), {shared.membranes().views().type, shared.turns()});
  CHECK_FALSE(cytosol.broken());
  const auto relative = on_host(cytosol.relative_viscosity()), volume = on_host(grid.views().volume);
  double inside = 0;
  visit_owned(grid.index(), [&](int, int, int, int c) { inside += 0.5 * (relative(c) - 1) * volume(c); });
  double enclosed = 0;
  for (const auto& cell : shared.membranes().diagnostics()) enclosed += cell.volume_um3;
  CHECK(comm.sum(inside) == Approx(comm.sum(enclosed)).epsilon(0.01));  // fractions are of grid lines, 6 across
}
