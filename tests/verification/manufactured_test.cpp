#include "manufactured.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "order.hpp"

using namespace corpuscle;
using namespace corpuscle::manufactured;
using Convection = FluidSettings::Convection;

namespace {

FluidSettings settings_of(Convection convection) {
  FluidSettings s;
  s.convection = convection;
  s.momentum_tolerance = 1e-9;
  return s;
}

void show(const std::string& text) {
  if (std::getenv("CORPUSCLE_SHOW")) WARN(text);
}

std::string name(const FluidSettings& s) {
  return fmt::format("convection {}",
                     s.convection == Convection::none ? "none" : (s.convection == Convection::implicit ? "implicit" : "extrapolated"));
}

}  // namespace

TEST_CASE("the manufactured flow converges in space on a skewed grid", "[verification]") {
  const Comm comm;
  const FluidSettings s = settings_of(GENERATE(Convection::extrapolated, Convection::implicit, Convection::none));
  std::vector<double> spacing, velocity, pressure;
  for (int n : {12, 16, 24}) {
    // The step shrinks with the spacing, so that the error in time falls at second order as well.
    const Errors e = run(comm, skewed_cube(n), 0.4 / n, n, s);
    spacing.push_back(1.0 / n), velocity.push_back(e.velocity), pressure.push_back(e.pressure);
    CHECK(e.divergence < 1e-10);
    show(fmt::format("{}: {} cells: velocity {:.3e}, pressure {:.3e}", name(s), n, e.velocity, e.pressure));
  }
  INFO(name(s) << ": orders " << fitted_order(spacing, velocity) << " and " << fitted_order(spacing, pressure));
  CHECK(fitted_order(spacing, velocity) >= 1.9);
  CHECK(fitted_order(spacing, pressure) >= 1.5);
  CHECK(velocity.back() < 1.3e-3);  // of a flow of rms 1.1 um/us; measured 1.05e-3 to 1.1e-3, spacing 0.083 um
  CHECK(pressure.back() < 5e-3);    // of a pressure of rms 0.5 kPa; measured 3.6e-3 to 4.1e-3
}

TEST_CASE("the manufactured flow converges in space where the viscosity varies", "[verification]") {
  const Comm comm;
  const bool skewed = GENERATE(false, true);
  const FluidSettings s = settings_of(Convection::none);
  Flow flow;
  flow.contrast = 0.8;  // viscosities from 0.45 to 2.2 times the mean
  const auto straight = [](int n) {
    return NodeSource{{n, n, n}, [n](int i, int j, int k) { return Triple{2.0 * i / n, 2.0 * j / n, 2.0 * k / n}; }};
  };
  std::vector<double> spacing, velocity, pressure;
  for (int n : {12, 18, 27}) {
    const Errors e = run(comm, skewed ? skewed_cube(n) : straight(n), 0.4 / n, n, s, nullptr, flow);
    spacing.push_back(1.0 / n), velocity.push_back(e.velocity), pressure.push_back(e.pressure);
    CHECK(e.divergence < 1e-10);
    show(fmt::format("skewed {}: {} cells: velocity {:.3e}, pressure {:.3e}", skewed, n, e.velocity, e.pressure));
  }
  INFO("skewed " << skewed << ": orders " << fitted_order(spacing, velocity) << " and " << fitted_order(spacing, pressure));
  CHECK(fitted_order(spacing, velocity) >= 1.9);
  CHECK(fitted_order(spacing, pressure) >= 1.5);
}

TEST_CASE("the manufactured flow converges in time", "[verification]") {
  const Comm comm;
  const double ratio = GENERATE(1, 2);  // of every second step to the others
  const FluidSettings s = settings_of(GENERATE(Convection::extrapolated, Convection::implicit, Convection::none));
  Flow flow;
  flow.from_rest = true;
  const double end = 0.8;
  const NodeSource source = skewed_cube(10);
  Fields reference;
  run(comm, source, end / 256, 256, s, &reference, flow);
  std::vector<double> step, velocity, pressure;
  for (int n : {8, 16, 32}) {
    Fields fields;
    run(comm, source, end / n, n, s, &fields, flow, ratio);
    // The same grid for both: the error in space drops out. The reference's own error raises the order by 0.01.
    const Errors e = difference(comm, source, fields, reference);
    step.push_back(end / n), velocity.push_back(e.velocity), pressure.push_back(e.pressure);
    show(fmt::format("{}: step {} us, ratio {}: velocity {:.3e}, pressure {:.3e}", name(s), end / n, ratio, e.velocity, e.pressure));
  }
  INFO(name(s) << ", ratio " << ratio << ": orders " << fitted_order(step, velocity) << " and " << fitted_order(step, pressure));
  CHECK(fitted_order(step, velocity) >= 1.9);
  CHECK(fitted_order(step, pressure) >= 1.5);
  CHECK(velocity.back() < 6e-4);  // measured 4.4e-4 to 4.7e-4; (rate dt)^2 is 2.5e-3
  CHECK(pressure.back() < 8e-3);  // the convective terms' extrapolation is most of it: measured 1.4e-3 to 4.8e-3
}
