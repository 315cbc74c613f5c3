#include "app/modules.hpp"

#include "app/any_cell.hpp"
#include "core/log.hpp"
#include "grid/index_space.hpp"
#include "output/report.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

namespace corpuscle {

namespace {

/// Nodes of all ranks' blocks with their halos; those of a grid from a file are not known yet.
std::optional<double> padded_nodes(const Case& scene) {
  if (!scene.grid || scene.grid->generator == GridSettings::Generator::file) return std::nullopt;
  double nodes = 1;
  for (int n : scene.grid->nodes) nodes *= n - 1 + 2 * IndexSpace::halo;
  return nodes;
}

bool as_forces(const Case& scene) {
  return scene.fluid && scene.has_cells() && scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force;
}

/// Vertices of all cells; none where that takes a file or packing.
std::optional<double> vertices_of(const Case& scene) {
  if (scene.cells.empty() || !scene.populations.empty()) return std::nullopt;
  double vertices = 0;
  for (const auto& cell : scene.cells) {
    if (!cell.mesh.empty()) return std::nullopt;
    vertices += cell.vertices;
  }
  return vertices;
}

/// Counted from the definitions of the modules' arrays and the kernels that their steps launch.
std::optional<ModuleCost> cost_of(const std::string& module, const Case& scene) {
  const auto nodes = padded_nodes(scene);
  if (module == "convection" && nodes) return ModuleCost{5, *nodes * 6 * 8 * 1e-6};
  if (module == "immersed search" && nodes) return ModuleCost{38, *nodes * 51 * 1e-6};
  const auto vertices = vertices_of(scene);
  if (module == "membrane viscosity" && vertices && !as_forces(scene)) return ModuleCost{3, 34 * 8 * *vertices * 1e-6};
  if (module == "slip correction" && vertices && as_forces(scene)) return ModuleCost{3, 8 * *vertices * 1e-6};
  return std::nullopt;
}

}  // namespace

ModuleList list_modules(const Case& scene, int ranks) {
  ModuleList list;
  const auto add = [&](const std::string& name, bool active) { (active ? list.active : list.left_out).push_back(name); };
  const bool fluid = scene.fluid.has_value(), cells = scene.has_cells(), bodies = !scene.bodies.empty();
  const bool files = outputs_left_out(scene.output).empty();
  add("fluid", fluid);
  add("convection", fluid && scene.fluid->convection != FluidSettings::Convection::none);
  const bool force = as_forces(scene);
  add("immersed search", fluid && ((cells && !force) || bodies));
  add("transfer of forces", force);
  add("slip correction", force && scene.coupling->slip);
  add("sharp pressure", force && scene.coupling->pressure == CouplingSettings::Pressure::sharp);
  add("viscosity ratio", any_cell(scene, [](const CellSettings& c) { return c.viscosity_ratio != 1; }));
  add("contact", force && scene.contact);
  add("rigid bodies", bodies);
  add("packing", !scene.populations.empty());
  add("membrane", cells);
  add("membrane viscosity", any_cell(scene, [](const CellSettings& c) { return c.membrane_viscosity_N_s_per_m > 0; }));
  add("coupling", fluid && cells);
  add("blood statistics", force && scene.blood);
  add("stretching", scene.stretching.has_value());
  add("halo exchange between ranks", fluid && ranks > 1);
  add("field output", fluid && files && scene.output.fields);
  add("cell output", (cells || bodies) && files && scene.output.cells);
  add("checkpoint", fluid && files);
  for (const auto& name : list.left_out)
    if (const auto cost = cost_of(name, scene)) list.cost[name] = *cost;
  return list;
}

void print_modules(const ModuleList& modules) {
  std::vector<std::string> left_out;
  for (const auto& name : modules.left_out) {
    const auto cost = modules.cost.find(name);
    if (cost == modules.cost.end()) {
      left_out.push_back(name);
    } else {
      left_out.push_back(fmt::format("{} ({} kernels a step, {:.2g} MB)", name, cost->second.kernels, cost->second.megabytes));
    }
  }
  info("active:   {}", fmt::join(modules.active, ", "));
  info("left out: {}", left_out.empty() ? "nothing" : fmt::format("{}", fmt::join(left_out, ", ")));
}

}  // namespace corpuscle
