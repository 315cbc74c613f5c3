#include "app/reference_flows.hpp"

#include "fluid/reference_flow.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

using Type = BoundarySettings::Type;

const BoundarySettings* find_side(const Case& scene, BoundarySettings::Side side) {
  for (const auto& b : scene.boundaries)
    if (b.side == side) return &b;
  return nullptr;
}

std::map<std::string, double> tube_errors(const Case& scene, FlowSimulation& simulation) {
  const auto* inlet = find_side(scene, BoundarySettings::Side::k_min);
  if (!inlet || inlet->type != Type::velocity_inlet || inlet->velocity || !inlet->time_table.empty() ||
      simulation.time() < inlet->ramp_us)
    return {};
  Grid& grid = simulation.grid();
  const IndexSpace& index = grid.index();
  const double radius = 0.5 * scene.grid->diameter_um, mean = inlet->speed;
  const int layer = index.global[2] * 3 / 4 - index.first[2];
  const bool here = layer >= 0 && layer < index.n[2];
  const double difference = grid.comm().max(
      here ? poiseuille_difference(grid.views(), simulation.fluid().velocity(), layer, mean, radius) : 0.0);
  double layers[4] = {0, 0, 0, 0};
  const int other = layer - index.global[2] / 8;
  double sums[2] = {0, 0};
  if (here) layer_pressure(grid.views(), simulation.fluid().pressure(), layer, sums);
  layers[0] = sums[0], layers[1] = sums[1];
  sums[0] = sums[1] = 0;
  if (other >= 0 && other < index.n[2]) layer_pressure(grid.views(), simulation.fluid().pressure(), other, sums);
  layers[2] = sums[0], layers[3] = sums[1];
  grid.comm().sum(layers, 4);
  const double distance = scene.grid->length_um * (index.global[2] / 8) / index.global[2];
  const double gradient = (layers[0] / layers[1] - layers[2] / layers[3]) / distance;
  const double exact = -8 * simulation.fluid().viscosity() * mean / (radius * radius);
  return {{"poiseuille_velocity", difference / (2 * mean)}, {"poiseuille_gradient", std::abs(gradient / exact - 1)}};
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
    const auto velocity = [&](const BoundarySettings* b) {
      if (b->type == Type::wall) return Vec3{};
      const double factor = b->ramp_us > 0 ? std::min(1.0, simulation.time() / b->ramp_us) : 1.0;
      return factor * Vec3{(*b->velocity)[0], (*b->velocity)[1], (*b->velocity)[2]};
    };
    const Vec3 a = velocity(low), b = velocity(high);
    const double speed = std::max(norm(a), norm(b));
    const auto& p = scene.fluid->pressure_gradient_Pa_per_um;
    if (speed == 0 || p[0] != 0 || p[1] != 0 || p[2] != 0) return {};
    Grid& grid = simulation.grid();
    const double difference = grid.comm().max(couette_difference(
        grid.views(), simulation.fluid().velocity(), d, scene.grid->lower_um[d], scene.grid->upper_um[d], a, b));
    return {{"couette_velocity", difference / speed}};
  }
  return {};
}

}  // namespace

std::map<std::string, double> reference_errors(const Case& scene, FlowSimulation& simulation) {
  if (simulation.surfaces() || !scene.grid) return {};
  if (scene.grid->generator == GridSettings::Generator::straight_tube) return tube_errors(scene, simulation);
  if (scene.grid->generator == GridSettings::Generator::box) return couette_errors(scene, simulation);
  return {};
}

}  // namespace corpuscle
