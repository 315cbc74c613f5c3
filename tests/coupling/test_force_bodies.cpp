// Rigid bodies beside membranes that are forces.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "balls.hpp"
#include "core/error.hpp"
#include "coupling/energy_balance.hpp"
#include "transfer/transfer.hpp"

using namespace corpuscle;
using namespace corpuscle::scenes;

namespace {

using Type = BoundarySettings::Type;

double largest_speed(FlowSimulation& simulation) {
  const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), simulation.shared_cells()->surfaces().v);
  double most = 0;
  for (int i = 0; i < simulation.shared_cells()->surfaces().own_vertices; ++i) most = std::max(most, norm(load(v, i)));
  return most;
}

double largest_change(FlowSimulation& a, FlowSimulation& b) {
  const auto u = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.fluid().velocity());
  const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), b.fluid().velocity());
  const auto kind = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.fluid().kind());
  const IndexSpace& index = a.grid().index();
  double most = 0, largest = 0;
  for (int k = 0; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) {
        const int c = index.cell(i, j, k);
        most = std::max(most, norm(load(u, c) - load(v, c)));
        largest = std::max(largest, norm(load(u, c)));
      }
  return most / largest;
}

bool show() { return std::getenv("CORPUSCLE_SHOW") != nullptr; }

}  // namespace

TEST_CASE("the flow around a body is the same with a cell at rest beside it", "[coupling][force][bodies]") {
  const Case scene = past_a_ball(20);
  Case alone = scene;
  alone.cells.clear();
  alone.coupling.reset();
  alone.contact.reset();
  alone.fluid->repeat_projection = false;  // as with cells
  Timers timers;
  FlowSimulation with(Comm(), scene, timers), without(Comm(), alone, timers);
  REQUIRE(with.immersed());
  with.step(), without.step();
  // A capsule as it is made has no forces: the solvers end with residuals of 1e-11.
  CHECK(largest_change(without, with) < 1e-9);
  if (show()) WARN(fmt::format("flows differ by {:.2e}, cell moves at {:.3e} um/us", largest_change(without, with), largest_speed(with)));
}

TEST_CASE("nothing moves beside a body at rest", "[coupling][force][bodies]") {
  Timers timers;
  Case scene = pushed_onto_a_ball(0, 100);
  scene.cells[0].center_um[0] = -4.3;  // beyond the range of contact
  FlowSimulation simulation(Comm(), scene, timers);
  while (!simulation.done()) simulation.step();
  CHECK(largest_speed(simulation) < 1e-12);
}

TEST_CASE("a cell that is pushed onto a body comes to rest before it", "[coupling][force][bodies][contact]") {
  constexpr double push = 2e-3;
  Timers timers;
  FlowSimulation simulation(Comm(), pushed_onto_a_ball(push, 2000), timers);
  EnergyBalance energy(simulation);
  const auto sample = [&] {
    simulation.coupling()->tractions_for_output();
    double elastic = 0;
    for (const auto& cell : simulation.membranes()->diagnostics()) elastic += cell.energy_fJ();
    energy.sample(elastic);
  };
  sample();
  while (!simulation.done()) {
    simulation.step();
    sample();
    if (!show() || simulation.steps() % 10 > 0) continue;
    const auto load = simulation.coupling()->contact_load(0, 20);
    const double balance = simulation.immersed()->balance_forces()[0][0];
    WARN(fmt::format("{} us: gap {:.3f} um, on the body {:.5f} + {:.5f} nN, {:.2e} um/us, energy {:.3e}, coupling {:.3e}",
                     simulation.time(), simulation.coupling()->contact_report()->smallest_body_gap, load[0], balance,
                     largest_speed(simulation), energy.imbalance().value_or(-1), energy.coupling_imbalance().value_or(-1)));
  }
  const ContactReport contact = *simulation.coupling()->contact_report();
  CHECK(contact.crossings == 0);
  CHECK(contact.smallest_body_gap > 0.05);
  CHECK(contact.smallest_body_gap < 0.25);
  // All of the push comes to the body: from the fluid, from contact, and through what there is of the film that the grid does not show.
  const auto touch = simulation.coupling()->contact_load(0, 20);
  const Triple fluid = simulation.immersed()->balance_forces()[0];
  CHECK(touch[0] > 0.3 * push);
  CHECK(touch[0] + fluid[0] == Approx(push).epsilon(0.01));  // what is left of the fluid's inertia
  CHECK(std::hypot(touch[1] + fluid[1], touch[2] + fluid[2]) < 0.01 * push);
  CHECK(energy.imbalance().value() < 0.02);
}

TEST_CASE("cells that begin in a body, or around one, are refused", "[coupling][force][bodies]") {
  Timers timers;
  const auto refused = [&](const Triple& centre, double ball_radius, const Triple& ball_centre) {
    Case scene = pushed_onto_a_ball(0, 20);
    scene.cells = {capsule(ball_radius < 1.4 ? 3 : 1.5, centre, 1)};
    scene.cells[0].vertices = 400;
    scene.bodies = {ball(ball_radius, ball_centre)};
    try {
      FlowSimulation simulation(Comm(), scene, timers);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto named = [](const std::string& text) {
    INFO(text);
    for (const char* part : {"cells.0", "bodies.0", "center_um"}) CHECK(text.find(part) != std::string::npos);
  };
  named(refused({1, 0, 0}, 2.5, {0, 0, 0}));         // all of it
  named(refused({-3, 0, 0}, 2.5, {0, 0, 0}));        // a part
  named(refused({-3.9, 0.2, 0.1}, 2.5, {0, 0, 0}));  // by 0.1 um
  named(refused({5.2, 0, 0}, 2.5, {-4.5, 0, 0}));    // beyond a periodic side
  named(refused({0.1, 0, 0}, 1.3, {0, 0, 0}));       // the body in the cell
  CHECK(refused({-4.3, 0, 0}, 2.5, {0, 0, 0}) == "accepted");
}

TEST_CASE("bodies that move push cells on, through periodic sides, and the energy closes", "[coupling][force][bodies][contact]") {
  Timers timers;
  const Case scene = balls_among_capsules(500);
  Case alone = scene;
  alone.cells.clear();
  alone.coupling.reset();
  alone.contact.reset();
  FlowSimulation simulation(Comm(), scene, timers), without(Comm(), alone, timers);
  EnergyBalance energy(simulation), balance(without);
  const auto sample = [&] {
    simulation.coupling()->tractions_for_output();
    double elastic = 0;
    for (const auto& cell : simulation.membranes()->diagnostics()) elastic += cell.energy_fJ();
    energy.sample(elastic);
    without.coupling()->tractions_for_output();
    balance.sample(0);
  };
  sample();
  while (!simulation.done()) {
    simulation.step(), without.step();
    sample();
    if (!show() || simulation.steps() % 10 > 0) continue;
    const auto load = simulation.coupling()->contact_load(1, 20);
    WARN(fmt::format("{} us: gap {:.3f} um, on the body {:.4f} nN {:.5f} nW, energy {:.3e}, coupling {:.3e}", simulation.time(),
                     simulation.coupling()->contact_report()->smallest_body_gap, load[1], load[3], energy.imbalance().value_or(-1),
                     energy.coupling_imbalance().value_or(-1)));
  }
  const ContactReport contact = *simulation.coupling()->contact_report();
  CHECK(contact.crossings == 0);
  CHECK(contact.smallest_body_gap > 0.02);
  CHECK(contact.smallest_body_gap < 0.25);
  // Back on the one, on to the other.
  const double back = simulation.coupling()->contact_load(1, 20)[1], on = simulation.coupling()->contact_load(2, 20)[1];
  CHECK(back < 0);
  CHECK(on == Approx(-back).epsilon(0.5));
  // On so coarse a grid the flow around the balls alone misses a tenth.
  if (show()) WARN(fmt::format("energy off by {:.4f}, without cells by {:.4f}", energy.imbalance().value(), balance.imbalance().value()));
  CHECK(std::abs(energy.imbalance().value() - balance.imbalance().value()) < 0.03);
}

#ifdef CORPUSCLE_HDF5
TEST_CASE("cells among moving bodies go on from a checkpoint with the same bits", "[coupling][force][bodies][restart]") {
  const SharedFile file("bodies");
  Timers timers;
  FlowSimulation whole(Comm(), balls_among_capsules(300), timers), after(Comm(), balls_among_capsules(300), timers);
  go_on_from_checkpoint(file, whole, after, 8);
  CHECK(whole.coupling()->contact_report()->smallest_body_gap < 0.25);
  CHECK(positions(whole) == positions(after));
}
#endif

#ifdef CORPUSCLE_MPI
TEST_CASE("cells among moving bodies go on several ranks as on one", "[coupling][force][bodies][ranks]") {
  if (Comm().size() == 1) return;
  Case scene = balls_among_capsules(240);
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-12;
  Timers timers;
  FlowSimulation alone(Comm(MPI_COMM_SELF), scene, timers), shared(Comm(), scene, timers);
  while (!alone.done()) alone.step(), shared.step();
  CHECK(alone.coupling()->contact_report()->smallest_body_gap < 0.25);
  const double difference = largest_difference(positions(alone), positions(shared));
  if (show()) WARN(fmt::format("ranks differ by {:.2e} um", difference));
  CHECK(difference < 1e-8);  // um: round-off, and the solvers' last residuals
  for (int body = 0; body < 3; ++body)
    for (int n = 0; n < 4; ++n)
      CHECK(alone.coupling()->contact_load(body, 20)[n] == Approx(shared.coupling()->contact_load(body, 20)[n]).epsilon(1e-6).margin(1e-9));
}
#endif

TEST_CASE("beside a body cells have the flow's velocity, and that of the body where they touch it", "[coupling][force][bodies]") {
  // A ball that turns in a fluid at rest: omega a^3 / r^2 times the sine of the latitude.
  constexpr double radius = 2.5, rate = 1e-9, spacing = 0.625;  // 1/us: no way to speak of
  Case scene = past_a_ball(40000);
  scene.time.step_us = 20000;
  scene.grid = cube(15, 24);
  scene.fluid->pressure_gradient_Pa_per_um = {0, 0, 0};
  scene.boundaries = sides(Type::wall);
  scene.cells.clear();
  scene.coupling.reset();
  scene.contact.reset();
  scene.bodies = {ball(radius, {0.11, -0.07, 0.05})};
  scene.bodies[0].angular_velocity_rad_per_us = {0, 0, rate};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  while (!simulation.done()) simulation.step();
  constexpr int points = 60;
  const Vec3 centre{0.11, -0.07, 0.05};
  for (const double gap : {0.0, 0.25, 0.5, 0.75, 1.0, 1.5}) {
    Transfer transfer(simulation.grid(), scene.boundaries, CouplingSettings::Kernel::three_point, points);
    const Components<double> x("corpuscle::test::x", points, 3), velocity("corpuscle::test::velocity", points, 3);
    const auto host = Kokkos::create_mirror_view(x);
    for (int n = 0; n < points; ++n) {
      const double z = -1 + (2.0 * n + 1) / points, angle = 2.399963 * n, r = std::sqrt(1 - z * z);
      store(host, n, centre + (radius + gap * spacing) * Vec3{r * std::cos(angle), r * std::sin(angle), z});
    }
    Kokkos::deep_copy(x, host);
    transfer.place(x);
    transfer.interpolate(simulation.fluid().flux(), simulation.fluid().velocity(), nullptr, velocity);
    const auto found = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), velocity);
    double along = 0, scale = 0;
    for (int n = 0; n < points; ++n) {
      const Vec3 at = load(host, n) - centre;
      const Vec3 exact = rate * std::pow(radius / norm(at), 3) * Vec3{-at.y, at.x, 0};
      along += dot(load(found, n), exact), scale += dot(exact, exact);
    }
    // Over the shear along the surface, three times the rate: by how much another place would have that velocity, in spacings. Inside
    // the body the velocity is the body's, and does not go on as outside; the box is 3 radii away.
    const double off = (along / scale - 1) * radius / (3 * spacing);
    if (show()) WARN(fmt::format("gap {} spacings: {:.4f} of the speed, {:.3f} spacings off", gap, along / scale, off));
    CHECK(std::abs(off) < (gap == 0 ? 0.12 : 0.04));
  }
}

TEST_CASE("a fast body drives a cell before it through a periodic side, and never has it inside", "[coupling][force][bodies][contact]") {
  // 0.4 um a step, further than contact reaches; the ball comes back at the other end after 306 us.
  Case scene = pushed_onto_a_ball(0, 400);
  scene.cells[0].center_um = {-5.5, 0, 0};
  scene.bodies[0].velocity_um_per_us = {-2e-2, 0, 0};
  Timers timers;
  FlowSimulation simulation(Comm(), scene, timers);
  double least = 1e300;  // from the body's middle
  while (!simulation.done()) {
    simulation.step();
    const auto x = positions(simulation);
    for (std::size_t v = 0; v + 2 < x.size(); v += 3) {
      const Triple& middle = simulation.rigid_bodies()->centre(0);
      least = std::min(least, std::hypot(x[v] - middle[0], x[v + 1] - middle[1], x[v + 2] - middle[2]));
    }
  }
  if (show()) WARN(fmt::format("{:.3f} um from the middle", least));
  CHECK(simulation.immersed()->wrapped_by()[0][0] < -1);
  CHECK(least > 2.5 * 0.98);  // its facets lie inside the ball
  CHECK(simulation.coupling()->contact_report()->crossings == 0);
}
