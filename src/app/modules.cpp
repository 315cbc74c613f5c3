#include "app/modules.hpp"

#include "core/log.hpp"
#include "output/report.hpp"

#include <fmt/ranges.h>

#include <algorithm>

namespace corpuscle {

ModuleList list_modules(const Case& scene, int ranks) {
  ModuleList list;
  const auto add = [&](const char* name, bool active) { (active ? list.active : list.left_out).push_back(name); };
  const bool fluid = scene.fluid.has_value(), cells = !scene.cells.empty(), bodies = !scene.bodies.empty();
  const bool viscous = std::any_of(scene.cells.begin(), scene.cells.end(),
                                   [](const CellSettings& c) { return c.membrane_viscosity_N_s_per_m > 0; });
  const bool files = outputs_left_out(scene.output).empty();
  add("fluid", fluid);
  add("convection", fluid && scene.fluid->convection != FluidSettings::Convection::none);
  add("iterated projection", fluid && scene.fluid->projection == FluidSettings::Projection::iterated);
  add("immersed search", fluid && (cells || bodies));
  add("rigid bodies", bodies);
  add("membrane", cells);
  add("membrane viscosity", viscous);
  add("coupling", fluid && cells);
  add("stretching", scene.stretching.has_value());
  add("halo exchange between ranks", fluid && ranks > 1);
  add("field output", fluid && files && scene.output.fields);
  add("cell output", (cells || bodies) && files && scene.output.cells);
  add("checkpoint", fluid && files);
  return list;
}

void print_modules(const ModuleList& modules) {
  info("active:   {}", fmt::join(modules.active, ", "));
  info("left out: {}", modules.left_out.empty() ? "nothing" : fmt::format("{}", fmt::join(modules.left_out, ", ")));
}

}  // namespace corpuscle
