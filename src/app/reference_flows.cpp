#include "app/reference_flows.hpp"

#include "fluid/reference_flow.hpp"

#include <cmath>

namespace corpuscle {

namespace {

using Type = BoundarySettings::Type;

const BoundarySettings* find_side(const Case& scene, BoundarySettings::Side side) {
  for (const auto& b : scene.boundaries)
    if (b.side == side) return &b;
  return nullptr;
}

/// Whether what the side prescribes has come to its last value; `factor` is that.
bool settled(const BoundarySettings& side, double time, double& factor) {
  factor = side.time_table.empty() ? 1 : side.time_table.back()[1];
  return time >= side.ramp_us && (side.time_table.empty() || time >= side.time_table.back()[0]);
}

/// Whether the flow through a tube is Poiseuille's: one way in, one out, walls at rest.
bool is_poiseuille(const Case& scene) {
  using Side = BoundarySettings::Side;
  for (Side side : {Side::i_min, Side::i_max, Side::j_min, Side::j_max})
    if (const auto* b = find_side(scene, side); !b || b->type != Type::wall) return false;
  const auto *inlet = find_side(scene, Side::k_min), *outlet = find_side(scene, Side::k_max);
  return inlet && outlet && inlet->type == Type::velocity_inlet && !inlet->velocity && outlet->type == Type::outflow;
}

std::map<std::string, double> tube_errors(const Case& scene, FlowSimulation& simulation) {
  if (!is_poiseuille(scene)) return {};
  const auto* inlet = find_side(scene, BoundarySettings::Side::k_min);
  double factor = 1;
  if (!settled(*inlet, simulation.time(), factor)) return {};
  const double mean = factor * inlet->speed;
  if (!(mean > 0)) return {};  // at rest, or driven from the other end
  Grid& grid = simulation.grid();
  const IndexSpace& index = grid.index();
  const double radius = 0.5 * scene.grid->diameter_um;
  const int layer = index.global[2] * 3 / 4 - index.first[2];
  const bool here = layer >= 0 && layer < index.n[2];
  const double difference =
      grid.comm().max(here ? poiseuille_difference(grid.views(), simulation.fluid().velocity(), layer, mean, radius) : 0.0);
  const std::map<std::string, double> velocity{{"poiseuille_velocity", difference / (2 * mean)}};
  const int apart = index.global[2] / 8;
  if (apart == 0) return velocity;  // too few layers for a gradient away from the ends
  double layers[4] = {0, 0, 0, 0};
  const int other = layer - apart;
  double sums[2] = {0, 0};
  if (here) layer_pressure(grid.views(), simulation.fluid().pressure(), layer, sums);
  layers[0] = sums[0], layers[1] = sums[1];
  sums[0] = sums[1] = 0;
  if (other >= 0 && other < index.n[2]) layer_pressure(grid.views(), simulation.fluid().pressure(), other, sums);
  layers[2] = sums[0], layers[3] = sums[1];
  grid.comm().sum(layers, 4);
  const double distance = scene.grid->length_um * apart / index.global[2];
  const double gradient = (layers[0] / layers[1] - layers[2] / layers[3]) / distance;
  const double exact = -8 * simulation.fluid().viscosity() * mean / (radius * radius);
  auto errors = velocity;
  errors["poiseuille_gradient"] = std::abs(gradient / exact - 1);
  return errors;
}

std::map<std::string, double> couette_errors(const Case& scene, FlowSimulation& simulation) {
  for (int d = 0; d < 3; ++d) {
    const auto* low = find_side(scene, static_cast<BoundarySettings::Side>(2 * d));
    const auto* high = find_side(scene, static_cast<BoundarySettings::Side>(2 * d + 1));
    const auto wall = [](const BoundarySettings* b) {
      return b && (b->type == Type::wall || (b->type == Type::moving_wall && b->velocity));
    };
    if (!wall(low) || !wall(high)) continue;
    for (int e = 0; e < 3; ++e) {
      const auto* side = find_side(scene, static_cast<BoundarySettings::Side>(2 * e));
      if (e != d && (!side || side->type != Type::periodic)) return {};
    }
    double of_low = 1, of_high = 1;
    if (!settled(*low, simulation.time(), of_low) || !settled(*high, simulation.time(), of_high)) return {};
    const auto velocity = [&](const BoundarySettings* b, double factor) {
      if (b->type == Type::wall) return Vec3{};
      return factor * Vec3{(*b->velocity)[0], (*b->velocity)[1], (*b->velocity)[2]};
    };
    const Vec3 a = velocity(low, of_low), b = velocity(high, of_high);
    const double speed = std::max(norm(a), norm(b));
    const auto& p = scene.fluid->pressure_gradient_Pa_per_um;
    if (speed == 0 || p[0] != 0 || p[1] != 0 || p[2] != 0) return {};
    Grid& grid = simulation.grid();
    const double difference = grid.comm().max(
        couette_difference(grid.views(), simulation.fluid().velocity(), d, scene.grid->lower_um[d], scene.grid->upper_um[d], a, b));
    return {{"couette_velocity", difference / speed}};
  }
  return {};
}

}  // namespace

std::map<std::string, double> reference_errors(const Case& scene, FlowSimulation& simulation) {
  if (simulation.surfaces() || !scene.grid) return {};
  std::map<std::string, double> errors;
  if (scene.grid->generator == GridSettings::Generator::straight_tube) errors = tube_errors(scene, simulation);
  if (scene.grid->generator == GridSettings::Generator::box) errors = couette_errors(scene, simulation);
  std::erase_if(errors, [](const auto& error) { return !std::isfinite(error.second); });
  return errors;
}

}  // namespace corpuscle
