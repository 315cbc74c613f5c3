#include "membrane/rest_search.hpp"

#include <cmath>
#include <string>

namespace corpuscle {

namespace {

constexpr int check_every = 50;       // iterations between looks at the residual, which wait for the device
constexpr int estimate_every = 1000;  // iterations between estimates of the stiffness, which limits the step

}  // namespace

double typical_edge(double area_um2, int triangles) { return std::sqrt(4 * area_um2 / (std::sqrt(3.0) * triangles)); }

RestSearch::RestSearch(const MembraneViews& m, const Elasticity& elasticity, double edge, std::function<double()> stiffness)
    : membranes_(m), elasticity_(elasticity), edge_(edge), stiffness_(std::move(stiffness)) {
  const auto label = [](const char* name) { return std::string("corpuscle::membrane::") + name; };
  work_.applied = Components<double>(label("applied_vertex"), m.vertices, 3);
  work_.force = Components<double>(label("relaxation_force_vertex"), m.vertices, 3);
  work_.sums = Table<double>(label("relaxation_sums_section"), m.cells * sections, 3);
  work_.engine = Table<double>(label("relaxation_engine"), 2 * m.cells, 3);
}

RelaxationLimits RestSearch::limits() const {
  const double undamped = stiffness_();
  // Half the stable step at the present shape: links stiffen while the cell moves. A tenth of an edge a move keeps
  // triangles from folding.
  return {0.2 / std::sqrt(undamped), 1 / std::sqrt(undamped), 0.1 * edge_};
}

RestSearch::Outcome RestSearch::run(double force, int max_iterations) {
  Outcome outcome;
  RelaxationLimits now = limits();
  start_relaxation(membranes_, work_, now);
  while (true) {
    relax(membranes_, elasticity_, work_, now, outcome.iterations, check_every);
    outcome.iterations += check_every;
    outcome.force = largest_force(membranes_, work_);
    outcome.at_rest = outcome.force <= force;
    if (outcome.at_rest || outcome.iterations >= max_iterations || !std::isfinite(outcome.force)) break;
    if (outcome.iterations % estimate_every == 0) now = limits();
  }
  Kokkos::deep_copy(membranes_.surface.v, 0.0);
  return outcome;
}

}  // namespace corpuscle
