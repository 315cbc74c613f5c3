// How much of each grid cell is inside surfaces.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "../fluid/fluid_fixture.hpp"
#include "cells/rank_blocks.hpp"
#include "held_surface.hpp"
#include "immersed/surface_work.hpp"
#include "transfer/cytosol.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using namespace corpuscle::testing;

namespace {

constexpr auto three_point = CouplingSettings::Kernel::three_point;

std::vector<BoundarySettings> all(Type type) { return sides({type, type, type, type, type, type}); }

NodeSource cube_of(int cells, double length) {
  auto settings = box({cells, cells, cells}, {length / 2, length / 2, length / 2});
  settings.lower_um = {-length / 2, -length / 2, -length / 2};
  return make_node_source(settings);
}

/// The part of each cell inside, and the volume that the surfaces enclose as the grid sees it and as they do.
struct Inside {
  Inside(Comm comm, const NodeSource& nodes, const std::vector<BoundarySettings>& boundaries, const std::vector<TriangleMesh>& meshes,
         std::vector<double> ratios = {})
      : grid(comm, nodes, periodic(boundaries)),
        surfaces(make_surface_set(with_copies(meshes))),
        transfer(grid, boundaries, three_point, surfaces.vertices),
        cytosol(grid, ratios.empty() ? std::vector<double>(meshes.size(), 2) : ratios) {
    enclosed = enclosed_volume(make_surface_set(meshes));
    const auto turns = period_turns(grid);
    kinds = {Array<int>("corpuscle::test::type", surfaces.bodies), Table<int>("corpuscle::test::turns", surfaces.bodies, 3)};
    const auto type = Kokkos::create_mirror_view(kinds.type);
    const auto of_body = Kokkos::create_mirror_view(kinds.turns);
    for (int b = 0; b < surfaces.bodies; ++b) {
      type(b) = b / static_cast<int>(turns.size());
      for (int d = 0; d < 3; ++d) of_body(b, d) = turns[b % turns.size()][d];
    }
    Kokkos::deep_copy(kinds.type, type);
    Kokkos::deep_copy(kinds.turns, of_body);
  }

  /// Each with all that are beyond periodic sides.
  std::vector<TriangleMesh> with_copies(const std::vector<TriangleMesh>& meshes) const {
    std::vector<TriangleMesh> all;
    for (const TriangleMesh& mesh : meshes)
      for (const Vec3& shift : period_shifts(grid)) {
        all.push_back(mesh);
        for (Triple& p : all.back().vertices) p = {p[0] + shift.x, p[1] + shift.y, p[2] + shift.z};
      }
    return all;
  }

  void update() {
    transfer.place(surfaces.x);
    cytosol.update(transfer, surfaces, kinds);
    fraction = on_host(cytosol.relative_viscosity());
    const auto volume = on_host(grid.views().volume);
    inside = least = most = 0;
    visit([&](int c, int, int, int) {
      inside += (fraction(c) - 1) * volume(c);
      least = std::min(least, fraction(c) - 1), most = std::max(most, fraction(c) - 1);
    });
    inside = grid.comm().sum(inside);
  }
  template <class Body>
  void visit(const Body& body) {
    const IndexSpace& index = grid.index();
    for (int k = 0; k < index.n[2]; ++k)
      for (int j = 0; j < index.n[1]; ++j)
        for (int i = 0; i < index.n[0]; ++i) body(index.cell(i, j, k), i, j, k);
  }
  static std::array<bool, 3> periodic(const std::vector<BoundarySettings>& boundaries) {
    std::array<bool, 3> along{};
    for (const auto& b : boundaries)
      if (b.type == Type::periodic) along[static_cast<int>(b.side) / 2] = true;
    return along;
  }

  Grid grid;
  SurfaceSet surfaces;
  Transfer transfer;
  Cytosol cytosol;
  BodyKinds kinds;
  HostMirror<Array<double>> fraction;
  double enclosed = 0, inside = 0, least = 0, most = 0;
};

/// Inside where a node is farther than `margin` within, outside where it is farther than that without; the share of
/// nodes that are not.
double misplaced(Inside& s, const Triple& axes, const Triple& center, double margin) {
  const auto x = on_host(s.grid.views().x);
  double wrong = 0;
  s.visit([&](int c, int, int, int) {
    const double r = std::sqrt(std::pow((x(c, 0) - center[0]) / axes[0], 2) + std::pow((x(c, 1) - center[1]) / axes[1], 2) +
                               std::pow((x(c, 2) - center[2]) / axes[2], 2));
    const double least = *std::min_element(axes.begin(), axes.end());
    if ((r - 1) * least < -margin && s.fraction(c) != 2) ++wrong;
    if ((r - 1) * least > margin && s.fraction(c) != 1) ++wrong;
  });
  return wrong;
}

}  // namespace

TEST_CASE("the inside of a sphere and an ellipsoid has their volume, on any grid", "[transfer][inside]") {
  struct Setting {
    const char* name;
    NodeSource nodes;
    std::vector<BoundarySettings> boundaries;
  };
  GridSettings tube;
  tube.generator = GridSettings::Generator::straight_tube;
  tube.diameter_um = 5;
  tube.length_um = 5;
  tube.nodes = {26, 26, 26};
  auto tube_sides = all(Type::wall);
  tube_sides[4].type = tube_sides[5].type = Type::periodic;
  auto skewed = warped_box({25, 25, 25});
  const int which = GENERATE(0, 1, 2);
  const Triple axes = GENERATE(Triple{1, 1, 1}, Triple{1.3, 1, 0.77});
  const double size = which == 2 ? 0.4 : 1;  // the warped box is two wide
  const Triple scaled{size * axes[0], size * axes[1], size * axes[2]};
  const Triple center = which == 0 ? Triple{0.03, -0.02, 0.01} : (which == 1 ? Triple{0.3, 0.2, -0.1} : Triple{1.3, 1.14, 1.18});
  const double h = which == 2 ? 0.08 : 0.2;
  Inside s(Comm(), which == 0 ? cube_of(25, 5) : (which == 1 ? make_node_source(tube) : skewed), which == 1 ? tube_sides : all(Type::wall),
           {ellipsoid_mesh(scaled, center, 0.5 * h)});
  s.update();
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("grid {}: inside {:.6f} of {:.6f}: {:.2e}", which, s.inside, s.enclosed, s.inside / s.enclosed - 1));
  // Lines are a spacing apart, and a sphere of five spacings ends between two of them.
  CHECK(s.inside == Approx(s.enclosed).epsilon(0.015));
  CHECK(misplaced(s, scaled, center, 1.2 * h) == 0);
  CHECK(s.least == 0);
  CHECK(s.most == 1);
  CHECK_FALSE(s.cytosol.broken());
}

TEST_CASE("the part of a cell inside a sphere is what the sphere has of it", "[transfer][inside]") {
  const double h = 0.2;
  const Triple center{0.03, -0.02, 0.01};
  Inside s(Comm(), cube_of(20, 20 * h), all(Type::wall), {ellipsoid_mesh({1, 1, 1}, center, 0.25 * h)});
  s.update();
  const auto x = on_host(s.grid.views().x);
  double squares = 0, most = 0;
  int cells = 0;
  s.visit([&](int c, int, int, int) {
    constexpr int m = 10;
    int in = 0;
    for (int n = 0; n < m * m * m; ++n) {
      const int at[3] = {n % m, n / m % m, n / m / m};
      double square = 0;
      for (int d = 0; d < 3; ++d) square += std::pow(x(c, d) + h * ((at[d] + 0.5) / m - 0.5) - center[d], 2);
      if (square < 1) ++in;
    }
    if (in == 0 || in == m * m * m) return;
    const double error = s.fraction(c) - 1 - in / static_cast<double>(m * m * m);
    squares += error * error, most = std::max(most, std::abs(error)), ++cells;
  });
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{} cells: rms {:.4f}, at most {:.4f}", cells, std::sqrt(squares / cells), most));
  CHECK(std::sqrt(squares / cells) < 0.02);  // curvature takes off 0.025 h at a cell's edges; the mean of three lines has 0.1
  CHECK(most < 0.1);
}

TEST_CASE("the volume inside comes nearer to that enclosed on finer grids", "[transfer][inside]") {
  std::vector<double> error;
  for (int cells : {12, 24, 48}) {
    double largest = 0;
    for (const Triple& center : {Triple{0.03, -0.02, 0.01}, Triple{0.1, 0.06, -0.05}}) {
      Inside s(Comm(), cube_of(cells, 3), all(Type::wall), {ellipsoid_mesh({1.1, 1, 0.9}, center, 0.08)});
      s.update();
      largest = std::max(largest, std::abs(s.inside / s.enclosed - 1));
    }
    error.push_back(largest);
  }
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("errors of the volume {:.2e}, {:.2e}, {:.2e}", error[0], error[1], error[2]));
  CHECK(error[2] < 0.35 * error[0]);  // chords end as roots of the distance: order 3/2
  CHECK(error[2] < 3e-3);
}

TEST_CASE("lines through vertices and along edges are inside where others are", "[transfer][inside]") {
  // An octahedron whose vertices, edges and faces all lie on lines of the grid.
  TriangleMesh mesh;
  const double r = 1;
  mesh.vertices = {{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  Inside s(Comm(), cube_of(21, 4.2), all(Type::wall), {mesh});
  s.update();
  CHECK_FALSE(s.cytosol.broken());
  CHECK(s.least == 0);
  CHECK(s.most == 1);
  const auto x = on_host(s.grid.views().x);
  s.visit([&](int c, int, int, int) {
    const double d = std::abs(x(c, 0)) + std::abs(x(c, 1)) + std::abs(x(c, 2)) - r;
    if (d > 0.31) CHECK(s.fraction(c) == 1);
    if (d < -0.31) CHECK(s.fraction(c) == 2);
  });
}

TEST_CASE("what is inside goes round periodic sides with its surface", "[transfer][inside]") {
  const double length = 4, h = 0.2;
  const int n = 20;
  const Triple center{0.013, 0.027, -0.041};
  const auto mesh = ellipsoid_mesh({1.3, 1, 0.77}, center, 0.5 * h);
  Inside middle(Comm(), cube_of(n, length), all(Type::periodic), {mesh});
  middle.update();
  REQUIRE(middle.inside == Approx(middle.enclosed).epsilon(4e-3));  // five spacings a radius
  const std::array<int, 3> shift = GENERATE(std::array<int, 3>{10, 0, 0}, std::array<int, 3>{0, 8, 0}, std::array<int, 3>{-10, 9, 10});
  TriangleMesh moved = mesh;
  for (auto& p : moved.vertices)
    for (int d = 0; d < 3; ++d) p[d] += shift[d] * h;
  Inside s(Comm(), cube_of(n, length), all(Type::periodic), {moved});
  s.update();
  CHECK_FALSE(s.cytosol.broken());
  const IndexSpace& index = s.grid.index();
  double most = 0;
  s.visit([&](int c, int i, int j, int k) {
    const int from = index.cell((i - shift[0] + 2 * n) % n, (j - shift[1] + 2 * n) % n, (k - shift[2] + 2 * n) % n);
    most = std::max(most, std::abs(s.fraction(c) - middle.fraction(from)));
  });
  CHECK(most < 1e-5);  // places are rounded to 1e-6 spacings
}

TEST_CASE("each cell has the viscosity of its own kind, and a surface that is not closed is noticed", "[transfer][inside]") {
  const auto one = ellipsoid_mesh({0.8, 0.8, 0.8}, {-1, 0, 0}, 0.1), two = ellipsoid_mesh({0.8, 0.8, 0.8}, {1, 0, 0}, 0.1),
             three = ellipsoid_mesh({0.5, 0.5, 0.5}, {0, 1.7, 0}, 0.1);
  Inside s(Comm(), cube_of(25, 5), all(Type::wall), {one, two, three}, {5, 0.2, 1});
  s.update();
  const auto x = on_host(s.grid.views().x);
  s.visit([&](int c, int, int, int) {
    if (std::hypot(x(c, 0) + 1, x(c, 1), x(c, 2)) < 0.5) CHECK(s.fraction(c) == Approx(5).epsilon(1e-14));
    if (std::hypot(x(c, 0) - 1, x(c, 1), x(c, 2)) < 0.5) CHECK(s.fraction(c) == Approx(0.2).epsilon(1e-14));
    if (std::hypot(x(c, 0), x(c, 1) - 1.7, x(c, 2)) < 0.5) CHECK(s.fraction(c) == 1);
  });
  CHECK_FALSE(s.cytosol.broken());
  const auto position = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), s.surfaces.x);
  position(0, 0) = 1e3;  // nowhere on the grid
  Kokkos::deep_copy(s.surfaces.x, position);
  s.update();
  CHECK(s.cytosol.broken());
}

#ifdef CORPUSCLE_MPI
TEST_CASE("a surface that is not closed is noticed on all ranks, where lines go through several of them", "[transfer][inside][ranks]") {
  const auto mesh = ellipsoid_mesh({1.5, 1.4, 1.3}, {0.1, -0.1, 0.05}, 0.3);
  Inside s(Comm(), cube_of(16, 4), all(Type::wall), {mesh});
  s.update();
  CHECK_FALSE(s.cytosol.broken());
  // A vertex that is nowhere takes its triangles with it: a hole wider than a spacing, at both ends of each direction in turn.
  const auto rest = Kokkos::create_mirror(s.surfaces.x);
  Kokkos::deep_copy(rest, s.surfaces.x);
  for (int d = 0; d < 3; ++d)
    for (const int end : {-1, 1}) {
      const auto position = Kokkos::create_mirror(s.surfaces.x);
      Kokkos::deep_copy(position, rest);
      int farthest = 0;
      for (int v = 0; v < s.surfaces.vertices; ++v)
        if (end * rest(v, d) > end * rest(farthest, d)) farthest = v;
      position(farthest, 0) = 1e3;
      Kokkos::deep_copy(s.surfaces.x, position);
      s.update();
      CHECK(s.cytosol.broken());
    }
}

TEST_CASE("what is inside is the same to the bit on any ranks", "[transfer][inside][ranks]") {
  if (Comm().size() == 1) return;
  const Type type = GENERATE(Type::periodic, Type::wall);
  const double length = 4;
  const Triple center = type == Type::periodic ? Triple{1.7, 0.3, -1.8} : Triple{0.4, 0.1, -0.2};
  const auto mesh = ellipsoid_mesh({1.3, 1, 0.77}, center, 0.1);
  Inside alone(Comm(MPI_COMM_SELF), cube_of(20, length), all(type), {mesh}), shared(Comm(), cube_of(20, length), all(type), {mesh});
  alone.update(), shared.update();
  CHECK_FALSE(shared.cytosol.broken());
  const IndexSpace &whole = alone.grid.index(), &index = shared.grid.index();
  int different = 0;
  shared.visit([&](int c, int i, int j, int k) {
    different += shared.fraction(c) != alone.fraction(whole.cell(i + index.first[0], j + index.first[1], k + index.first[2]));
  });
  CHECK(different == 0);
}
#endif
