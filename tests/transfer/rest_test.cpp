#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "../fluid/fluid_fixture.hpp"
#include "held_surface.hpp"
#include "transfer/delta.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;
using namespace corpuscle::testing;

namespace {

using Kernel = CouplingSettings::Kernel;

FluidSettings stokes() {
  FluidSettings settings;
  settings.density_pg_per_um3 = 1;
  settings.kinematic_viscosity_um2_per_us = 1;
  settings.convection = FluidSettings::Convection::none;
  return settings;
}

struct Rest {
  double at_vertices = 0, in_cells = 0, jump = 0;
};

/// Unit load along the outward normal, radius and viscosity one: the largest velocities, and the jump of the mean pressure
/// between what lies two and more spacings inside and outside.
Rest at_rest(HeldSurface& held, const Triple& semi_axes, double h, int steps) {
  held.set_force([](const Vec3&, const Vec3& area) { return area; });
  held.settle(steps, 40 * h * h);
  Rest rest;
  rest.at_vertices = held.largest_vertex_speed();
  double inside = 0, outside = 0, within = 0, without = 0;
  held.visit_cells([&](const Vec3& x, double p, const Vec3& u) {
    rest.in_cells = std::max(rest.in_cells, norm(u));
    const double r =
        std::sqrt(std::pow(x.x / semi_axes[0], 2) + std::pow(x.y / semi_axes[1], 2) + std::pow(x.z / semi_axes[2], 2));
    const double distance = (r - 1) * semi_axes[2];  // at least
    if (distance < -2 * h) inside += p, ++within;
    if (distance > 2 * h) outside += p, ++without;
  });
  const Comm& comm = held.grid.comm();
  rest.in_cells = comm.max(rest.in_cells);
  for (double* sum : {&inside, &outside, &within, &without}) *sum = comm.sum(*sum);
  rest.jump = outside / without - inside / within;
  return rest;
}

}  // namespace

TEST_CASE("membranes under a uniform normal load leave the fluid at rest", "[transfer][ranks]") {
  const int n = 20;
  const double h = 0.2;
  auto nodes = box({n, n, n}, {2, 2, 2});
  nodes.lower_um = {-2, -2, -2};
  const auto closed = sides({Type::wall, Type::wall, Type::wall, Type::wall, Type::wall, Type::wall});
  const Triple axes = GENERATE(Triple{1, 1, 1}, Triple{1.3, 1, 0.77});
  // The mesh is finer than a cell needs: with edges of 0.7 h its own area is 0.5 % too small.
  HeldSurface held(make_node_source(nodes), closed, stokes(), ellipsoid_mesh(axes, {0.03, -0.02, 0.01}, 0.4 * h),
                   Kernel::three_point);
  const Rest rest = at_rest(held, axes, h, 4);
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("{} vertices: {:.3g} at vertices, {:.3g} in cells, jump {:.5f}", held.surface.vertices, rest.at_vertices,
                     rest.in_cells, rest.jump));
  CHECK(rest.at_vertices < 1.5e-3);
  CHECK(rest.in_cells < 1.5e-3);
  CHECK(rest.jump == Approx(1).epsilon(3e-3));
}

TEST_CASE("the slip correction gives spheres their size, whatever the spacings and the direction", "[transfer]") {
  // A uniform force over a sphere in a periodic box moves it with U = F / (6 pi mu) (1 / a - 2.8373 / L + 4 pi / 3 a^2 / L^3):
  // Hasimoto, J. Fluid Mech. 5, 1959, without the terms of a rigid sphere's uneven traction.
  const double pi = std::acos(-1.0), a = 1, length = 6, total = 6 * pi;
  const auto all = sides({Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic});
  struct Setting {
    std::array<int, 3> cells;
    Vec3 along;
    Kernel kernel;
    double least, most;  // radius too large by this many of the widest spacing, without slip
  };
  const Setting s = GENERATE(values<Setting>({{{15, 15, 15}, {1, 0, 0}, Kernel::three_point, 0.1, 0.2},
                                              {{27, 27, 9}, {0, 0, 1}, Kernel::three_point, 0.05, 0.2},
                                              {{9, 27, 9}, {0.6, 0, 0.8}, Kernel::three_point, 0.05, 0.2},
                                              {{12, 12, 12}, {0, 0.6, 0.8}, Kernel::four_point, 0.4, 0.6}}));
  const double h = length / *std::min_element(s.cells.begin(), s.cells.end()),
               fine = length / *std::max_element(s.cells.begin(), s.cells.end());
  auto nodes = box(s.cells, {3, 3, 3});
  nodes.lower_um = {-3, -3, -3};
  auto settings = stokes();
  const Vec3 gradient = (1e3 * total / std::pow(length, 3)) * s.along;
  settings.pressure_gradient_Pa_per_um = {gradient.x, gradient.y, gradient.z};
  HeldSurface held(make_node_source(nodes), all, settings, ellipsoid_mesh({a, a, a}, {0.07, 0.13, -0.05}, 0.7 * fine),
                   s.kernel);
  const auto area = on_host(held.surface.area);
  double whole = 0;
  for (int i = 0; i < held.surface.vertices; ++i) whole += area(i);
  const auto f = Kokkos::create_mirror_view(held.force);
  for (int i = 0; i < held.surface.vertices; ++i) store(f, i, (total * area(i) / whole) * s.along);
  Kokkos::deep_copy(held.force, f);
  held.settle(6, 2 * length * length);
  const auto too_large = [&] {
    const double speed = dot(held.mean_velocity(), s.along);
    return (1 / (6 * pi * speed / total + 2.837297 / length - 4 * pi / 3 * a * a / std::pow(length, 3)) - a) / h;
  };
  const double without = too_large();
  held.take_velocity(true);
  const double with = too_large();
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("radius too large by {:.3f} h without slip, {:.3f} h with", without, with));
  CHECK(without > s.least);
  CHECK(without < s.most);
  CHECK(std::abs(with) < 0.05);
}

TEST_CASE("a marker alone moves as a sphere of its kernel's radius", "[transfer]") {
  // Hasimoto: F / (6 pi mu) (1 / a - 2.8373 / L), wherever it is in the grid.
  const Kernel kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const int n = 24, places = 4;
  const double pi = std::acos(-1.0), length = n;
  auto nodes = box({n, n, n}, {length, length, length});
  auto settings = stokes();
  settings.pressure_gradient_Pa_per_um = {1e3 / std::pow(length, 3), 0, 0};
  const std::array<bool, 3> periodic{true, true, true};
  const auto all = sides({Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic});
  double mean = 0;
  for (int place = 0; place < places; ++place) {
    Grid grid(Comm(), make_node_source(nodes), periodic);
    FluidSolver fluid(grid, settings, all);
    fluid.raise_reference_speed(1e-2);
    Transfer transfer(grid, all, kernel, 1);
    fluid.set_face_force(transfer.faces());
    Components<double> x("corpuscle::test::x", 1, 3), force("corpuscle::test::force", 1, 3), v("corpuscle::test::v", 1, 3);
    Kokkos::deep_copy(x, 12.1 + 0.27 * place);
    Kokkos::deep_copy(Kokkos::subview(force, 0, 0), 1.0);
    transfer.place(x);
    transfer.spread(force);
    for (int step = 0; step < 6; ++step) {
      fluid.begin_step(2 * length * length);
      fluid.solve((step + 1) * 2 * length * length, nullptr);
    }
    transfer.interpolate(fluid.flux(), fluid.velocity(), nullptr, v);
    mean += on_host(v)(0, 0) / places;
  }
  const double radius = 1 / (6 * pi * mean + 2.837297 / length);
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{}: radius {:.3f}", kernel == Kernel::three_point ? 3 : 4, radius));
  CHECK(radius == Approx(kernel == Kernel::three_point ? ThreePointDelta::radius : FourPointDelta::radius).epsilon(0.05));
}
