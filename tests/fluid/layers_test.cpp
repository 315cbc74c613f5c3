// Two fluids one above the other between plates, as a viscosity that varies.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

/// A layer of `ratio` times the viscosity below y = 1 + offset spacings, in a channel of height 2, spacing h, along x.
/// Steady flow under a plate that moves (Couette) or a gradient (Poiseuille): the largest error over the largest speed,
/// and the same of the work that the energy balance has.
struct Errors {
  double velocity = 0, dissipation = 0;
};

/// @param layered  the solver is told that a cell holds two fluids
Errors two_layers(int n, double ratio, double offset, bool couette, bool layered = true) {
  auto walls =
      sides({Type::periodic, Type::periodic, Type::wall, couette ? Type::moving_wall : Type::wall, Type::periodic, Type::periodic});
  if (couette) walls[3].velocity = Triple{1, 0, 0};
  FluidSettings settings;
  settings.density_pg_per_um3 = settings.kinematic_viscosity_um2_per_us = 1;
  settings.convection = FluidSettings::Convection::none;
  settings.momentum_tolerance = 1e-11;
  if (!couette) settings.pressure_gradient_Pa_per_um = {-1e3, 0, 0};  // 1 kPa/um
  const double h = 2.0 / n, face = 1 + offset * h;
  Grid grid(Comm(), make_node_source(box({4, n, 4}, {4 * h, 2, 4 * h})), {true, false, true});
  FluidSolver solver(grid, settings, walls);
  const IndexSpace& index = grid.index();
  const Array<double> relative("corpuscle::test::relative", index.size());
  const Array<double> fluidity("corpuscle::test::fluidity", index.size());
  const auto host = Kokkos::create_mirror_view(relative), inverse = Kokkos::create_mirror_view(fluidity);
  for (int c = 0; c < index.size(); ++c) {
    int i, j, k;
    index.unpack(c, i, j, k);
    const double below = std::clamp(face / h - j, 0.0, 1.0);
    host(c) = j < 0 ? ratio : 1 + (ratio - 1) * below;
    inverse(c) = j < 0 ? 1 / ratio : 1 + (1 / ratio - 1) * below;
  }
  Kokkos::deep_copy(relative, host);
  Kokkos::deep_copy(fluidity, inverse);
  solver.set_viscosity(relative, std::min(1.0, ratio), layered ? fluidity : Array<double>());
  for (int step = 0; step < 40; ++step) {
    solver.begin_step(20);
    solver.solve(20 * (step + 1), nullptr);
  }
  // Couette: shear s above, s / ratio below. Poiseuille: viscosity du/dy = t - y, t from the plates' speeds.
  const double above = 2 - face, s = 1 / (above + face / ratio);
  const double t = 0.5 * ((4 - face * face) + face * face / ratio) * s;
  const auto exact = [&](double y) {
    const double low = std::min(y, face);
    if (couette) return s * (low / ratio + std::max(0.0, y - face));
    const double u = (t * low - 0.5 * low * low) / ratio;
    return y <= face ? u : u + t * (y - face) - 0.5 * (y * y - face * face);
  };
  const auto u = on_host(solver.velocity());
  const auto x = on_host(grid.views().x);
  double most = 0, error = 0;
  for (int j = 0; j < n; ++j) {
    const int c = index.cell(1, j, 1);
    error = std::max(error, std::abs(u(c, 0) - exact(x(c, 1))));
    most = std::max(most, exact(x(c, 1)));
  }
  const FluidEnergy energy = flow_energy(solver, 0);
  const double in = energy.boundaries_nW + energy.gradient_nW;
  return {error / most, std::abs(in - energy.dissipation_nW) / in};
}

}  // namespace

TEST_CASE("two layers of fluid flow as they should, and lose what drives them", "[fluid][viscosity]") {
  const bool couette = GENERATE(true, false);
  const double ratio = GENERATE(0.2, 5.0);
  Errors coarse, fine;
  double averaged = 0;
  for (double offset : {0.0, 0.25, 0.5, 0.8}) {
    const Errors a = two_layers(16, ratio, offset, couette), b = two_layers(32, ratio, offset, couette);
    coarse = {std::max(coarse.velocity, a.velocity), std::max(coarse.dissipation, a.dissipation)};
    averaged = std::max(averaged, two_layers(32, ratio, offset, couette, false).velocity);
    fine = {std::max(fine.velocity, b.velocity), std::max(fine.dissipation, b.dissipation)};
  }
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("{} {}: {:.4f} averaged; velocity {:.4f}, {:.4f}; energy {:.1e}, {:.1e}", couette ? "Couette" : "Poiseuille", ratio,
                     averaged, coarse.velocity, fine.velocity, coarse.dissipation, fine.dissipation));
  // The interface is smeared over a spacing: of first order.
  CHECK(fine.velocity < 0.03);
  CHECK(fine.velocity < 0.9 * averaged);          // shear across an interface is borne by one fluid after the other
  CHECK(fine.velocity < 0.75 * coarse.velocity);  // the largest of several places between nodes
  CHECK(fine.dissipation < 1e-6);                 // the solver's tolerance
}

TEST_CASE("a fluid that is many times as viscous in places takes few more iterations", "[fluid][viscosity]") {
  FluidSettings settings;
  settings.convection = FluidSettings::Convection::none;
  settings.pressure_gradient_Pa_per_um = {-100, 0, 0};
  const int n = 24;
  const double h = 0.5, middle = 0.5 * n * h;
  const auto iterations = [&](double ratio) {
    Grid grid(Comm(), make_node_source(box({n, n, n}, {n * h, n * h, n * h})), {true, false, true});
    FluidSolver solver(grid, settings, sides({Type::periodic, Type::periodic, Type::wall, Type::wall, Type::periodic, Type::periodic}));
    const IndexSpace& index = grid.index();
    const Array<double> relative("corpuscle::test::relative", index.size());
    const auto host = Kokkos::create_mirror_view(relative);
    for (int c = 0; c < index.size(); ++c) {
      int at[3];
      index.unpack(c, at[0], at[1], at[2]);
      double square = 0;
      for (int d = 0; d < 3; ++d) square += std::pow((at[d] + 0.5) * h - middle, 2);
      host(c) = square < 9 ? ratio : 1;  // a ball of 3 um
    }
    Kokkos::deep_copy(relative, host);
    solver.set_viscosity(relative, std::min(1.0, ratio));
    solver.begin_step(20);  // nu dt / h^2 = 88
    solver.solve(20, nullptr);
    return static_cast<double>(solver.statistics().momentum_iterations) / solver.statistics().projections;
  };
  const double one = iterations(1), five = iterations(5), twenty = iterations(20);
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format("{}, {} and {} iterations a projection at ratios of 1, 5 and 20", one, five, twenty));
  // The preconditioner knows of the viscosity, though not of the transpose.
  CHECK(five < 2.5 * one);
  CHECK(twenty < 4 * one);
}
