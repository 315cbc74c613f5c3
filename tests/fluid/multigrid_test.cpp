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
Outcome solve_box(const std::array<int, 3>& cells, const Triple& upper, const std::array<bool, 3>& periodic, bool body, bool with_outflow,
                  bool by_amg = false) {
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
          if (at >= low && at <= high && across >= wide && across < 3 * wide) kind(index.cell(i, j, k)) = NodeKind::inside;
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

TEST_CASE("the multigrid solve takes few iterations, with bodies, thin cells, odd numbers of them, on any ranks", "[fluid][ranks]") {
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

namespace {

/// A box without bodies, closed but for periodic sides, and its levels.
struct OpenBox {
  OpenBox(const std::array<int, 3>& cells, const Triple& upper, const std::array<bool, 3>& periodic)
      : grid(Comm(), make_node_source(box(cells, upper)), periodic), mask("corpuscle::test::mask", grid.index().size()) {
    for (auto& normal : g.normal) normal = Array<double>("corpuscle::test::normal", grid.index().size());
    viscous_coefficients<false>(grid.views(), g);
    const PressureMask outflow("corpuscle::test::outflow", grid.index().size());
    mark_pressure(grid.views().base_kind, outflow, mask);
    hierarchy = std::make_unique<MultigridHierarchy>(grid, g.normal);
    hierarchy->update(mask);
  }

  Grid grid;
  PressureMask mask;
  ViscousCoefficients g;
  std::unique_ptr<MultigridHierarchy> hierarchy;
};

}  // namespace

TEST_CASE("a team does small levels as one thread does", "[fluid]") {
  const auto [cells, periodic] = GENERATE(std::pair<std::array<int, 3>, std::array<bool, 3>>{{12, 20, 24}, {false, false, true}},
                                          std::pair<std::array<int, 3>, std::array<bool, 3>>{{13, 18, 20}, {true, true, false}});
  OpenBox open(cells, {3, 5, 6}, periodic);
  const IndexSpace index = open.grid.index();
  PressureCycle cycle(*open.hierarchy, std::make_unique<InverseCoarsest>(*open.hierarchy));  // as on devices
  cycle.update(index.cell(0, 0, 0));
  const auto b = cycle.finest().b, x = cycle.finest().x;
  for_owned(
      "corpuscle::test::rhs", index,
      KOKKOS_LAMBDA(int i, int j, int k) { b(index.cell(i, j, k)) = std::sin(0.7f * i + 0.3f * j - 1.1f * k); });
  cycle.run();
  REQUIRE(cycle.small_levels().count > 1);
  const Array<CycleReal> alone("corpuscle::test::alone", index.size());
  Kokkos::deep_copy(alone, x);
  Kokkos::deep_copy(x, CycleReal(0));
  const auto s = cycle.small_levels();
  using Team = Kokkos::TeamPolicy<Exec>;
  Kokkos::parallel_for(
      "corpuscle::test::team", Team(1, Kokkos::AUTO),
      KOKKOS_LAMBDA(const Team::member_type& team) { cycle_small_levels(TeamCells<Team::member_type>{team}, s); });
  double most = 0, size = 0;
  const auto one = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), alone),
             all = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), x);
  for (int k = 0; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) {
        const int c = index.cell(i, j, k);
        most = larger(most, std::abs(double(one(c)) - all(c))), size = larger(size, std::abs(double(one(c))));
      }
  for (int d = 0; d < 3; ++d)
    if (index.periodic[d]) CHECK(all(index.cell(0, 0, 0) + index.n[d] * index.stride(d)) == all(index.cell(0, 0, 0)));
  CHECK(size > 0);
  CHECK(most < 1e-5 * size);  // single precision
}

TEST_CASE("a solve whose outcome is looked at late has the same answer", "[fluid]") {
  OpenBox open({24, 20, 32}, {6, 5, 8}, {false, false, true});
  const IndexSpace index = open.grid.index();
  PressureCycle cycle(*open.hierarchy);
  cycle.update(index.cell(0, 0, 0));
  PressureMultigrid solver(*open.hierarchy, cycle, open.g.normal, 100);
  solver.update(open.mask);
  const Array<double> rhs("corpuscle::test::rhs", index.owned()), x("corpuscle::test::x", index.size()),
      late("corpuscle::test::x", index.size());
  const auto solve = [&](double wave, double tolerance, const Array<double>& to) {
    for_owned(
        "corpuscle::test::rhs", index, KOKKOS_LAMBDA(int i, int j, int k) {
          rhs(index.compact(i, j, k)) = std::sin(0.7 * i + wave * j) * std::cos(6.283185307179586 * k / 32);
        });
    return solver.solve(rhs, to, tolerance);
  };
  for (const double tolerance : {1e-1, 1e-6, 1e-3}) {  // fewer iterations than before, and more
    solver.look_always = true;
    const auto at_once = solve(0.3, tolerance, x);
    solver.look_always = false;
    const auto later = solve(0.3, tolerance, late);
    REQUIRE(at_once.converged);
    CHECK(later.converged);
    CHECK(later.iterations == at_once.iterations);
    const auto a = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), x),
               b = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), late);
    double most = 0, size = 0;
    for (int c = 0; c < index.size(); ++c) most = larger(most, std::abs(a(c) - b(c))), size = larger(size, std::abs(a(c)));
    CHECK(size > 0);
    CHECK(most < 1e-12 * size);         // round-off of the same sums
    solve(0.9, 0.1 * tolerance, late);  // so that the next one is taken for longer than it is
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
  const bool by_inverse = GENERATE(false, true);  // as on devices
  const std::array<bool, 3> periodic =
      GENERATE(std::array<bool, 3>{false, false, false}, std::array<bool, 3>{false, true, false}, std::array<bool, 3>{true, true, true});
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
  for_box(
      "corpuscle::test::mask", {-1, -1, -1}, {cells[0] + 1, cells[1] + 1, cells[2] + 1}, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        mask(c) = kind(c) == NodeKind::fluid && !(plane && j == blocked) ? 1 : 0;
      });
  MultigridHierarchy hierarchy(grid, g.normal);
  hierarchy.update(mask);
  REQUIRE(hierarchy.levels().size() == 1);
  std::unique_ptr<CoarsestSolver> direct;
  if (by_inverse)
    direct = std::make_unique<InverseCoarsest>(hierarchy);
  else
    direct = std::make_unique<BandCoarsest>(hierarchy);
  PressureCycle cycle(hierarchy, std::move(direct));
  cycle.update(index.cell(1, 0, 1));
  // A right-hand side that has a solution: the operator's image of something.
  auto& level = cycle.finest();
  const Array<CycleReal> some("corpuscle::test::some", size);
  const auto views = level.views;
  for_owned(
      "corpuscle::test::some", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        some(c) = views.inverse(c) > 0 ? std::sin(1.7f * i + 2.3f * j) + 0.4f * k : 0.0f;
      });
  grid.halo().exchange(some);
  const auto b = level.b, x = level.x;
  for_owned(
      "corpuscle::test::image", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k);
        b(c) = views.inverse(c) > 0 ? views.apply(some, c) : 0.0f;
      });
  cycle.run();
  grid.halo().exchange(x);
  double left = 0;
  reduce_owned(
      "corpuscle::test::left", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int c = index.cell(i, j, k);
        most = larger(most, std::abs(double(b(c)) - (views.inverse(c) > 0 ? views.apply(x, c) : x(c))));
      },
      Largest(left));
  // Single precision of coefficients and values of up to about 30, and what is cut off is compatible to that only.
  CHECK(left < 1e-4);
}

#ifdef CORPUSCLE_MPI
namespace {

/// The cycles of the pressure and of the velocity on a box with a body.
struct Cycles {
  Cycles(const Comm& comm, const std::array<int, 3>& cells, const Triple& upper, const std::array<bool, 3>& periodic)
      : grid(comm, make_node_source(box(cells, upper)), periodic) {}

  Grid grid;
  std::unique_ptr<MultigridHierarchy> hierarchy;
  std::unique_ptr<PressureCycle> pressure;
  std::unique_ptr<MultigridCycle<Components<CycleReal>>> velocity;
};

PressureMask around_body(Grid& grid) {
  const IndexSpace index = grid.index();
  const Array<std::int8_t> open("corpuscle::test::open", index.size());
  const PressureMask mask("corpuscle::test::mask", index.size());
  const int wide = index.global[0] / 4, middle = index.global[2] / 2;
  for_owned(
      "corpuscle::test::open", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int at = index.first[2] + k, across = index.first[0] + i;
        open(index.cell(i, j, k)) = at >= middle - 1 && at <= middle + 1 && across >= wide && across < 3 * wide ? 0 : 1;
      });
  grid.halo().exchange(open);
  Kokkos::parallel_for(
      "corpuscle::test::mask", Policy(0, index.size()), KOKKOS_LAMBDA(int c) { mask(c) = open(c); });
  return mask;
}

/// Depends on where a cell is in the whole grid.
void fill(const IndexSpace& index, const PressureMask& mask, const Array<CycleReal>& b, const Components<CycleReal>& u) {
  for_owned(
      "corpuscle::test::right_hand_side", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const int c = index.cell(i, j, k), a = index.first[0] + i, e = index.first[1] + j, f = index.first[2] + k;
        b(c) = mask(c) ? std::sin(0.9f * a + 0.3f * e) + std::cos(1.1f * e - 0.7f * f) : 0.0f;
        for (int m = 0; m < 3; ++m) u(c, m) = mask(c) ? std::sin(0.4f * a + 0.5f * e + 0.2f * f + m) : 0.0f;
      });
}

std::unique_ptr<Cycles> make_cycles(const Comm& comm, const std::array<int, 3>& cells, const Triple& upper,
                                    const std::array<bool, 3>& periodic) {
  auto owner = std::make_unique<Cycles>(comm, cells, upper, periodic);
  Cycles& made = *owner;
  const IndexSpace& index = made.grid.index();
  ViscousCoefficients g;
  for (auto& normal : g.normal) normal = Array<double>("corpuscle::test::normal", index.size());
  viscous_coefficients<false>(made.grid.views(), g);
  const PressureMask mask = around_body(made.grid);
  made.hierarchy = std::make_unique<MultigridHierarchy>(made.grid, g.normal);
  made.hierarchy->update(mask);
  made.pressure = std::make_unique<PressureCycle>(*made.hierarchy);
  made.pressure->update(comm.root() ? index.cell(0, 0, 0) : -1);
  made.velocity = std::make_unique<MultigridCycle<Components<CycleReal>>>(*made.hierarchy, Smoothing{2, 0.5, 2.0});
  auto& finest = made.velocity->levels()[0];
  Kokkos::deep_copy(finest.own, 0.2f);
  made.velocity->update();
  fill(index, mask, made.pressure->finest().b, finest.b);
  return owner;
}

/// Largest difference of this rank's values from those of the whole grid, over the largest of these.
template <class Value>
double difference(const IndexSpace& part, const IndexSpace& whole, const Value& of_rank, const Value& of_grid) {
  const auto mine = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), of_rank);
  const auto all = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), of_grid);
  double most = 0, size = 1e-30;
  for (int k = 0; k < part.n[2]; ++k)
    for (int j = 0; j < part.n[1]; ++j)
      for (int i = 0; i < part.n[0]; ++i) {
        const int c = whole.cell(part.first[0] + i, part.first[1] + j, part.first[2] + k);
        most = larger(most, std::abs(double(mine(part.cell(i, j, k))) - all(c)));
        size = larger(size, std::abs(double(all(c))));
      }
  return most / size;
}

}  // namespace

TEST_CASE("coarse levels are gathered on a number of ranks that is no power of two", "[fluid][ranks]") {
  if (Comm().size() < 4) return;
  MPI_Comm some;
  MPI_Comm_split(MPI_COMM_WORLD, Comm().rank() < 3, 0, &some);
  if (Comm().rank() < 3) {
    const std::array<int, 3> cells{24, 20, 33};
    const Comm three(some);
    auto shared = make_cycles(three, cells, {6, 5, 8}, {false, false, true});
    auto alone = make_cycles(Comm::alone(), cells, {6, 5, 8}, {false, false, true});
    shared->pressure->run(), alone->pressure->run();
    CHECK(difference(shared->grid.index(), alone->grid.index(), shared->pressure->finest().x, alone->pressure->finest().x) <
          1e-5);  // single precision
  }
  MPI_Comm_free(&some);
}

TEST_CASE("a multigrid cycle is that of one rank however the grid is cut", "[fluid][ranks]") {
  using Bool = std::array<bool, 3>;
  for (const auto& [cells, upper, periodic] :
       {std::tuple<std::array<int, 3>, Triple, Bool>{{24, 20, 32}, {6, 5, 8}, {false, false, false}},
        {{23, 19, 33}, {6, 5, 24}, {false, false, true}},  // pairs that two ranks share
        {{26, 22, 50}, {6, 5, 24}, {true, false, false}},
        {{14, 16, 18}, {3, 3, 3}, {true, true, true}},
        {{14, 36, 18}, {3, 8, 4}, {true, false, true}},  // cut along a direction before one that wraps
        {{36, 14, 16}, {8, 3, 4}, {false, true, true}},
        {{40, 42, 44}, {3, 3, 3}, {false, true, false}}}) {  // more than one level below the finest is cut
    INFO(cells[0] << " x " << cells[1] << " x " << cells[2] << " cells");
    auto shared = make_cycles(Comm(), cells, upper, periodic), alone = make_cycles(Comm::alone(), cells, upper, periodic);
    const auto& levels = shared->hierarchy->levels();
    REQUIRE(levels.size() == alone->hierarchy->levels().size());
    CHECK(levels.back().comm.size() == 1);  // solved directly
    const IndexSpace &part = shared->grid.index(), &whole = alone->grid.index();
    shared->pressure->run(), alone->pressure->run();
    // Round-off of single precision, since sums of a cell's terms may be contracted in other ways.
    CHECK(difference(part, whole, shared->pressure->finest().x, alone->pressure->finest().x) < 1e-5);
    for (int depth = 0; depth < static_cast<int>(levels.size()); ++depth) {
      shared->velocity->run(depth), alone->velocity->run(depth);
      const auto mine = shared->velocity->levels()[0].x, all = alone->velocity->levels()[0].x;
      for (int m = 0; m < 3; ++m)
        CHECK(difference(part, whole, Kokkos::subview(mine, Kokkos::ALL, m), Kokkos::subview(all, Kokkos::ALL, m)) < 1e-5);
    }
  }
}
#endif
