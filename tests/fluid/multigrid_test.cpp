#include <catch2/catch.hpp>

#include "fluid/flux.hpp"
#include "fluid/pressure_multigrid.hpp"
#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

struct Outcome {
  int iterations = 0;
  double left = 0;  // 2-norm of what the flux correction leaves over that of the right-hand side
};

/// Solve on a box of cells `thin` times as long as wide, with a slab-like body in it, for a right-hand side that an
/// arbitrary potential makes; then see what divergence the solution leaves.
/// @param by_amg  leave the coarsest level to BoomerAMG, whatever its size
Outcome solve_box(const std::array<int, 3>& cells, const Triple& upper, const std::array<bool, 3>& periodic, bool body,
                  bool with_outflow, bool by_amg = false) {
  const Comm comm;
  Grid grid(comm, make_node_source(box(cells, upper)), periodic);
  const IndexSpace index = grid.index();
  const int size = index.size();
  ViscousCoefficients g;
  for (auto& normal : g.normal) normal = Array<double>("corpuscle::test::normal", size);
  viscous_coefficients<false>(grid.views(), g);
  Array<NodeKind> kind("corpuscle::test::kind", size);
  Kokkos::deep_copy(kind, grid.views().base_kind);
  const int low = cells[2] / 2 - 1, high = cells[2] / 2 + 1, wide = cells[0] / 4;
  if (body)
    for_owned(
        "corpuscle::test::body", index, KOKKOS_LAMBDA(int i, int j, int k) {
          const int at = index.first[2] + k, across = index.first[0] + i;
          if (at >= low && at <= high && across >= wide && across < 3 * wide)
            kind(index.cell(i, j, k)) = NodeKind::inside;
        });
  grid.halo().exchange(kind);
  PressureMask outflow("corpuscle::test::outflow", size), mask("corpuscle::test::mask", size);
  if (with_outflow && index.first[2] + index.n[2] == cells[2])
    mark_box(index, {{0, 0, index.n[2]}, {index.n[0], index.n[1], index.n[2] + 1}}, outflow);
  mark_pressure(kind, outflow, mask);
  MultigridHierarchy hierarchy(grid, g.normal);
  hierarchy.update(mask);
  PressureCycle cycle(hierarchy, by_amg ? std::make_unique<AmgCoarsest>(hierarchy) : nullptr);
  cycle.update(with_outflow || !comm.root() ? -1 : index.cell(0, 0, 0));
  PressureMultigrid solver(hierarchy, cycle, g.normal, 100);
  solver.update(mask);

  const Array<double> psi("corpuscle::test::psi", size), rhs("corpuscle::test::rhs", index.owned());
  Array<double> flux[3];
  for (auto& f : flux) f = Array<double>("corpuscle::test::flux", size);
  for_owned(
      "corpuscle::test::psi", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int a = index.first[0] + i, b = index.first[1] + j, c = index.first[2] + k;
        if (kind(index.cell(i, j, k)) == NodeKind::fluid)
          psi(index.cell(i, j, k)) = std::sin(0.9 * a + 0.3 * b) + std::cos(1.1 * b - 0.7 * c) + 0.01 * c;
      });
  grid.halo().exchange(psi);
  correct_flux<false>(grid.views(), g.normal, mask, psi, flux);
  negative_divergence(grid.views(), kind, flux, rhs);
  const auto square = [&] {
    double sum = 0;
    const auto values = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), rhs);
    for (int r = 0; r < index.owned(); ++r) sum += values(r) * values(r);
    return comm.sum(sum);
  };
  const double start = std::sqrt(square());
  Kokkos::deep_copy(psi, 0.0);
  const auto result = solver.solve(rhs, psi, 1e-9 * start);
  CHECK(result.converged);
  grid.halo().exchange(psi);
  correct_flux<false>(grid.views(), g.normal, mask, psi, flux);
  negative_divergence(grid.views(), kind, flux, rhs);
  return {result.iterations, std::sqrt(square()) / start};
}

}  // namespace

TEST_CASE("Chebyshev steps reduce a residual as their polynomial does", "[fluid]") {
  const double lowest = 0.1, highest = 1.9;
  for (const double eigenvalue : {0.1, 0.37, 1.0, 1.6, 1.9, 0.02}) {
    ChebyshevSteps steps(lowest, highest);
    double x = 0, previous = 0;
    for (int n = 1; n <= 12; ++n) {
      const auto step = steps.next();
      const double next = x + step.momentum * (x - previous) + step.weight * (1 - eigenvalue * x);
      previous = x, x = next;
      const auto polynomial = [n](double t) {
        return std::abs(t) <= 1 ? std::cos(n * std::acos(t)) : std::pow(t < 0 ? -1 : 1, n) * std::cosh(n * std::acosh(std::abs(t)));
      };
      const double centre = (highest + lowest) / 2, radius = (highest - lowest) / 2;
      const double expected = polynomial((centre - eigenvalue) / radius) / polynomial(centre / radius);
      CHECK(1 - eigenvalue * x == Approx(expected).margin(1e-13));  // round-off
    }
  }
}

TEST_CASE("the multigrid solve takes few iterations, with bodies, thin cells, odd numbers of them, on any ranks",
          "[fluid][ranks]") {
  const bool body = GENERATE(false, true);
  const std::array<bool, 3> closed{false, false, false}, along{false, false, true};
  const int most = 13;  // 9 or 10 for nine digits on one rank; blocks of other ranks' cells join differently
  for (const auto& [cells, upper] : {std::pair<std::array<int, 3>, Triple>{{24, 20, 32}, {6, 5, 8}},
                                     {{24, 20, 32}, {6, 5, 24}},
                                     {{23, 19, 33}, {6, 5, 24}},
                                     {{12, 12, 12}, {6, 6, 6}}}) {
    INFO(cells[0] << " x " << cells[1] << " x " << cells[2] << " cells, body " << body);
    const Outcome open = solve_box(cells, upper, closed, body, true);
    CHECK(open.iterations <= most);
    CHECK(open.left < 1.1e-9);  // the tolerance, and round-off
    const Outcome pinned = solve_box(cells, upper, along, body, false);
    CHECK(pinned.iterations <= most + 4);  // one outlying eigenvalue for the pinned node
    CHECK(pinned.left < 1.1e-9 * 100);     // the pinned row's own residual is the sum of all others'
  }
}

TEST_CASE("twice as fine a grid needs about as many multigrid iterations", "[fluid]") {
  const Outcome coarse = solve_box({16, 16, 20}, {5, 5, 12}, {false, false, false}, true, true);
  const Outcome fine = solve_box({32, 32, 40}, {5, 5, 12}, {false, false, false}, true, true);
  INFO(coarse.iterations << " and " << fine.iterations << " iterations");
  CHECK(fine.iterations <= coarse.iterations + 2);
}

TEST_CASE("solving the coarsest level directly takes no more iterations than BoomerAMG", "[fluid]") {
  const bool body = GENERATE(false, true);
  for (const bool along : {false, true}) {
    const std::array<bool, 3> periodic{false, false, along};
    const Outcome direct = solve_box({24, 20, 32}, {6, 5, 24}, periodic, body, !along);
    const Outcome amg = solve_box({24, 20, 32}, {6, 5, 24}, periodic, body, !along, true);
    INFO("body " << body << ", periodic " << along << ": " << direct.iterations << " and " << amg.iterations);
    CHECK(direct.iterations <= amg.iterations);
  }
}

TEST_CASE("a small level is solved directly, whatever is periodic, pinned, cut off or without an unknown", "[fluid]") {
  const std::array<bool, 3> periodic = GENERATE(std::array<bool, 3>{false, false, false}, std::array<bool, 3>{false, true, false},
                                                std::array<bool, 3>{true, true, true});
  const std::array<int, 3> cells = GENERATE(std::array<int, 3>{6, 7, 5}, std::array<int, 3>{3, 8, 4});
  Grid grid(Comm(), make_node_source(box(cells, {3, 4, 2})), periodic);
  const IndexSpace index = grid.index();
  const int size = index.size();
  ViscousCoefficients g;
  for (auto& normal : g.normal) normal = Array<double>("corpuscle::test::normal", size);
  viscous_coefficients<false>(grid.views(), g);
  // One plane of cells has no unknown. In a closed or periodic box what lies behind it is then cut off from the pinned cell.
  PressureMask mask("corpuscle::test::mask", size);
  const auto kind = grid.views().base_kind;
  const bool plane = GENERATE(false, true);
  const int blocked = cells[1] / 2;
  for_box("corpuscle::test::mask", {-1, -1, -1}, {cells[0] + 1, cells[1] + 1, cells[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    mask(c) = kind(c) == NodeKind::fluid && !(plane && j == blocked) ? 1 : 0;
  });
  MultigridHierarchy hierarchy(grid, g.normal);
  hierarchy.update(mask);
  REQUIRE(hierarchy.levels().size() == 1);
  PressureCycle cycle(hierarchy, std::make_unique<BandCoarsest>(hierarchy));
  cycle.update(index.cell(1, 0, 1));
  // A right-hand side that has a solution: the operator's image of something.
  auto& level = cycle.finest();
  const Array<CycleReal> some("corpuscle::test::some", size);
  const auto views = level.views;
  for_owned("corpuscle::test::some", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    some(c) = views.inverse(c) > 0 ? std::sin(1.7f * i + 2.3f * j) + 0.4f * k : 0.0f;
  });
  grid.halo().exchange(some);
  const auto b = level.b, x = level.x;
  for_owned("corpuscle::test::image", index, KOKKOS_LAMBDA(int i, int j, int k) {
    const int c = index.cell(i, j, k);
    b(c) = views.inverse(c) > 0 ? views.apply(some, c) : 0.0f;
  });
  cycle.run();
  grid.halo().exchange(x);
  double left = 0;
  reduce_owned("corpuscle::test::left", index, KOKKOS_LAMBDA(int i, int j, int k, double& most) {
    const int c = index.cell(i, j, k);
    most = larger(most, std::abs(double(b(c)) - (views.inverse(c) > 0 ? views.apply(x, c) : x(c))));
  }, Largest(left));
  // Single precision of coefficients and values of up to about 30, and what is cut off is compatible to that only.
  CHECK(left < 1e-4);
}
