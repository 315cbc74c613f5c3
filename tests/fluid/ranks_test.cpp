// The decomposition must not change the flow: every rank also runs the whole problem on its own.
#include <catch2/catch.hpp>

#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

struct Flow {
  GridSettings shape;
  std::vector<BoundarySettings> sides;
  std::array<bool, 3> periodic;
  FluidSettings settings;
};

struct Result {
  IndexSpace index;
  HostMirror<Components<double>> u;
  HostMirror<Array<double>> p;
  double divergence;
};

Result solve(const Comm& comm, const Flow& flow, int steps) {
  Grid grid(comm, make_node_source(flow.shape), flow.periodic);
  FluidSolver solver(grid, flow.settings, flow.sides, &flow.shape);
  for (int n = 1; n <= steps; ++n) {
    solver.begin_step(1);
    solver.solve(n, nullptr);
  }
  return {grid.index(), on_host(solver.velocity()), on_host(solver.pressure()), divergence_over_uh2(solver)};
}

Flow tube_flow(FluidSettings::Convection convection) {
  Flow flow{tube(9, 14, GridSettings::CrossSection::elliptical), tube_sides(2), {false, false, false}, {}};
  flow.settings.convection = convection;
  return flow;
}

/// Driven along the periodic direction past a wall that moves across: no outflow, so one cell fixes the pressure.
Flow channel_flow() {
  Flow flow{box({8, 7, 12}, {5, 6, 9}),
            sides({Type::wall, Type::wall, Type::wall, Type::moving_wall, Type::periodic, Type::periodic}),
            {false, false, true},
            {}};
  flow.sides[3].velocity = Triple{2e-3, 0, 1e-3};
  flow.settings.pressure_gradient_Pa_per_um = {0, 0, -0.5};
  return flow;
}

}  // namespace

TEST_CASE("velocities and pressures do not depend on the decomposition", "[fluid][ranks]") {
#ifdef CORPUSCLE_MPI
  const Comm comm, alone(MPI_COMM_SELF);
#else
  const Comm comm, alone;
#endif
  using Convection = FluidSettings::Convection;
  Flow flow = GENERATE(tube_flow(Convection::none), tube_flow(Convection::extrapolated), tube_flow(Convection::implicit), channel_flow());
  // Solver tolerances far below the difference that is looked for.
  flow.settings.momentum_tolerance = 1e-12;
  flow.settings.divergence_tolerance = 1e-12;
  constexpr int steps = 4;
  const Result mine = solve(comm, flow, steps), whole = solve(alone, flow, steps);
  CHECK(mine.divergence < 1e-10);
  CHECK(mine.divergence > 0);
  double worst[4] = {0, 0, 0, 0};  // differences and magnitudes of u and p
  visit_owned(mine.index, [&](int i, int j, int k, int c) {
    const int w = whole.index.cell(i + mine.index.first[0], j + mine.index.first[1], k + mine.index.first[2]);
    for (int m = 0; m < 3; ++m) {
      worst[0] = larger(worst[0], std::abs(mine.u(c, m) - whole.u(w, m)));
      worst[1] = larger(worst[1], std::abs(whole.u(w, m)));
    }
    worst[2] = larger(worst[2], std::abs(mine.p(c) - whole.p(w)));
    worst[3] = larger(worst[3], std::abs(whole.p(w)));
  });
  comm.max(worst, 4);
  INFO("velocity " << worst[0] / worst[1] << " pressure " << worst[2] / worst[3]);
  CHECK(worst[1] > 1e-3);
  CHECK(worst[0] < 1e-8 * worst[1]);
  CHECK(worst[2] < 1e-7 * worst[3]);  // mass / dt times the potential's error: a digit less
}
