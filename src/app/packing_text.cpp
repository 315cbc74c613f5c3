#include "app/packing_text.hpp"

#include "core/log.hpp"
#include "populations/packing_report.hpp"

namespace corpuscle {

namespace {

const PackingReport* packing_of(FlowSimulation& simulation) { return simulation.coupling() ? simulation.coupling()->packing() : nullptr; }

std::string gap_text(double gap, double seen) {
  return gap < 1e29 ? fmt::format("{:.3g} um", gap) : fmt::format("more than {:.3g} um", seen);
}

}  // namespace

void print_packing(FlowSimulation& simulation) {
  const PackingReport* packing = packing_of(simulation);
  if (!packing) return;
  for (std::size_t p = 0; p < packing->populations.size(); ++p) {
    const auto& one = packing->populations[p];
    info("populations.{}: {} cell{} \"{}\", hematocrit {:.4f}{}", p, one.cells, one.cells == 1 ? "" : "s", one.type, one.hematocrit,
         one.asked > 0 ? fmt::format(" (asked for {:g})", one.asked) : "");
  }
  if (packing->smallest_gap_um > 0)
    info("packing:  tube hematocrit {:.4f}; smallest gap between cells {}, to the sides of the grid {}", packing->tube_hematocrit,
         gap_text(packing->smallest_gap_um, packing->gaps_seen_um), gap_text(packing->smallest_wall_gap_um, packing->gaps_seen_um));
}

void fill_packing(Report& report, FlowSimulation& simulation) {
  const PackingReport* packing = packing_of(simulation);
  if (!packing) return;
  auto list = nlohmann::json::array();
  for (const auto& one : packing->populations) {
    nlohmann::json entry{{"type", one.type}, {"cells", one.cells}, {"hematocrit", one.hematocrit}};
    if (one.asked > 0) entry["asked"] = one.asked;
    list.push_back(entry);
  }
  report.extra["populations"] = list;
  report.extra["tube_hematocrit"] = packing->tube_hematocrit;
}

}  // namespace corpuscle
