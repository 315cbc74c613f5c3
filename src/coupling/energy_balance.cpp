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
  for (double term : {t.boundaries, t.gradient, t.dissipation, t.kinetic, t.on_bodies, t.pushed, t.elastic})
    largest = larger(largest, std::abs(term));
  return largest;
}

/// What the membranes have kept of the work done on them.
double kept_by_membranes(const EnergyTotals& t) { return t.elastic + t.membrane_dissipation + t.membrane_kinetic; }

/// Modulus of a sheet, nN/um.
double modulus(const MembraneLaw& law) {
  return std::visit(
      [](const auto& l) {
        if constexpr (requires { l.spring; })
          return l.spring.stiffness;
        else
          return l.material.shear_modulus;
      },
      law);
}

/// Below which all terms are rounding of the membranes' energy, fJ.
double floor_of(FlowSimulation& simulation) {
  constexpr double rounding = 1e-12;
  if (!simulation.membranes()) return 0;
  double most = 0;
  for (const CellReference& type : simulation.membranes()->types()) {
    const CellLaw& law = type.law;
    most = larger(most, law.bending + (modulus(type.in_plane) + law.area + law.local_area) * law.rest_area);
  }
  return rounding * most * simulation.cells();
}

std::optional<double> share(double left_over, double scale, double floor) {
  if (scale <= floor) return std::nullopt;
  return std::abs(left_over) / scale;
}

}  // namespace

/// Of membranes that are forces.
void EnergyBalance::add_shared_cells(EnergyTotals& now) {
  Coupling& coupling = *simulation_.coupling();
  const double dt = simulation_.last_step_us() > 0 ? simulation_.last_step_us() : simulation_.next_step_us();
  const CellEnergy here = coupling.energy_of_cells(dt);
  double all[5] = {here.on_cells, here.on_sides, here.unresolved, here.contact, simulation_.membranes()->dissipation_nW()};
  simulation_.grid().comm().sum(all, 5);
  now.on_cells = all[0];
  now.boundaries -= all[1];
  now.dissipation += all[2];
  now.contact = all[3];
  now.membrane_dissipation = all[4];
  now.pushed = coupling.power_of_pushes();
  const int bodies = coupling.rigid_bodies() ? coupling.rigid_bodies()->count() : 0;
  for (int body = 0; body < bodies; ++body) now.on_bodies += coupling.contact_load(body, dt)[3];
}

void EnergyBalance::sample(double elastic_fJ) {
  FluidSolver& fluid = simulation_.fluid();
  const bool cut = simulation_.immersed() != nullptr;  // fluid outside bodies only
  const FluidEnergy flow = flow_energy(fluid, cut ? enclosed_volume(simulation_.immersed()->surfaces()) : 0.0);
  EnergyTotals now;
  now.boundaries = flow.boundaries_nW;
  now.gradient = flow.gradient_nW;
  now.dissipation = flow.dissipation_nW;
  now.kinetic = flow.kinetic_fJ;
  // Power over flow means nothing where all but nothing flows through: beside walls and inlets that only slide along.
  const double through = 1e-3 * fluid.statistics().reference_speed * std::pow(fluid.grid().total_volume(), 2.0 / 3);
  state_.driving_pressure = flow.inflow_um3_per_us > through ? flow.boundaries_nW / flow.inflow_um3_per_us : 0;
  if (cut) {
    const SurfaceSet& cutting = simulation_.immersed()->surfaces();
    const auto& stress = simulation_.immersed()->last_stress();
    const int of_cells = cutting.cells > 0 ? simulation_.membranes()->vertices() : 0;
    if (of_cells > 0) now.on_cells = fluid_power(cutting, stress, 0, of_cells);
    if (of_cells < cutting.vertices) now.on_bodies = fluid_power(cutting, stress, of_cells, cutting.vertices);
    now.dissipation -= fluid.viscosity() * surface_gradient_work(cutting);
  }
  if (simulation_.shared_cells()) add_shared_cells(now);
  if (auto* membranes = simulation_.membranes()) {
    now.elastic = elastic_fJ;
    if (!simulation_.shared_cells()) {
      now.membrane_dissipation = membranes->dissipation_nW();
      now.membrane_kinetic = membranes->kinetic_energy_fJ();
    }
  }
  if (state_.samples == 0) {
    state_.first = now;
  } else {
    const double half = 0.5 * (simulation_.time() - state_.time);
    for (auto rate : {&EnergyTotals::boundaries, &EnergyTotals::gradient, &EnergyTotals::dissipation, &EnergyTotals::on_cells,
                      &EnergyTotals::on_bodies, &EnergyTotals::pushed, &EnergyTotals::membrane_dissipation})
      state_.totals.*rate += half * (state_.rates.*rate + now.*rate);
    for (auto content : {&EnergyTotals::kinetic, &EnergyTotals::elastic, &EnergyTotals::contact, &EnergyTotals::membrane_kinetic})
      state_.totals.*content = now.*content - state_.first.*content;
  }
  state_.rates = now;
  state_.time = simulation_.time();
  ++state_.samples;
}

double EnergyBalance::largest_fJ() const { return largest_term(state_.totals); }

std::optional<double> EnergyBalance::imbalance() const {
  const EnergyTotals& t = state_.totals;
  const double in = t.boundaries + t.gradient + t.pushed;
  return share(in - t.dissipation - t.kinetic - t.on_bodies - t.contact - kept_by_membranes(t), largest_term(t), floor_of(simulation_));
}

std::optional<double> EnergyBalance::coupling_imbalance() const {
  return share(state_.totals.on_cells - kept_by_membranes(state_.totals), largest_term(state_.totals), floor_of(simulation_));
}

}  // namespace corpuscle
