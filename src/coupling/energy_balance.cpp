#include "coupling/energy_balance.hpp"

#include "common/extremes.hpp"
#include "fluid/flow_balances.hpp"
#include "immersed/surface_work.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// The largest term of the whole balance: what imbalances are measured against.
double largest_term(const EnergyTotals& t) {
  double largest = 0;
  for (double term : {t.boundaries, t.gradient, t.dissipation, t.kinetic, t.on_bodies, t.elastic})
    largest = larger(largest, std::abs(term));
  return largest;
}

/// What the membranes have kept of the work done on them.
double kept_by_membranes(const EnergyTotals& t) { return t.elastic + t.membrane_dissipation + t.membrane_kinetic; }

std::optional<double> share(double left_over, double scale) {
  if (scale <= 0) return std::nullopt;
  return std::abs(left_over) / scale;
}

}  // namespace

void EnergyBalance::sample(double elastic_fJ) {
  const SurfaceSet* surfaces = simulation_.surfaces();
  FluidSolver& fluid = simulation_.fluid();
  const FluidEnergy flow = flow_energy(fluid, surfaces ? enclosed_volume(*surfaces) : 0.0);
  EnergyTotals now;
  now.boundaries = flow.boundaries_nW;
  now.gradient = flow.gradient_nW;
  now.dissipation = flow.dissipation_nW;
  now.kinetic = flow.kinetic_fJ;
  driving_pressure_ = flow.inflow_um3_per_us > 0 ? flow.boundaries_nW / flow.inflow_um3_per_us : 0;
  if (surfaces) {
    const auto& stress = simulation_.immersed()->last_stress();
    const int of_cells = simulation_.membranes() ? simulation_.membranes()->vertices() : 0;
    if (of_cells > 0) now.on_cells = fluid_power(*surfaces, stress, 0, of_cells);
    if (of_cells < surfaces->vertices) now.on_bodies = fluid_power(*surfaces, stress, of_cells, surfaces->vertices);
    now.dissipation -= fluid.viscosity() * surface_gradient_work(*surfaces);
  }
  if (auto* membranes = simulation_.membranes()) {
    now.elastic = elastic_fJ;
    now.membrane_dissipation = membranes->dissipation_nW();
    now.membrane_kinetic = membranes->kinetic_energy_fJ();
  }
  if (samples_ == 0) {
    first_ = now;
  } else {
    const double half = 0.5 * (simulation_.time() - time_);
    for (auto rate : {&EnergyTotals::boundaries, &EnergyTotals::gradient, &EnergyTotals::dissipation,
                      &EnergyTotals::on_cells, &EnergyTotals::on_bodies, &EnergyTotals::membrane_dissipation})
      totals_.*rate += half * (rates_.*rate + now.*rate);
    for (auto content : {&EnergyTotals::kinetic, &EnergyTotals::elastic, &EnergyTotals::membrane_kinetic})
      totals_.*content = now.*content - first_.*content;
  }
  rates_ = now;
  time_ = simulation_.time();
  ++samples_;
}

double EnergyBalance::largest_fJ() const { return largest_term(totals_); }

std::optional<double> EnergyBalance::imbalance() const {
  const EnergyTotals& t = totals_;
  const double in = t.boundaries + t.gradient;
  return share(in - t.dissipation - t.kinetic - t.on_bodies - kept_by_membranes(t), largest_term(t));
}

std::optional<double> EnergyBalance::coupling_imbalance() const {
  return share(totals_.on_cells - kept_by_membranes(totals_), largest_term(totals_));
}

}  // namespace corpuscle
