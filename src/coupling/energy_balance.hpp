// Where the energy that drives a flow goes: friction in the fluid and in membranes, storage, work on bodies that move as
// prescribed. What is left over is an error that the run can know of itself.
#pragma once

#include "coupling/flow_simulation.hpp"

#include <optional>

namespace corpuscle {

/// Work done since the first sample and energy stored since then, fJ (1 nW for 1 us).
struct EnergyTotals {
  double boundaries = 0;   // in through the sides of the grid
  double gradient = 0;     // by the imposed pressure gradient
  double dissipation = 0;  // in the fluid, integral of 2 mu D : D
  double kinetic = 0;      // change of the fluid's
  double on_cells = 0;     // by tractions
  double on_bodies = 0;    // by tractions and contacts, on those that move as prescribed
  double pushed = 0;       // on the cells by forces from outside
  double elastic = 0;      // change of the membranes'
  double contact = 0;      // change of that of contacts
  double membrane_dissipation = 0;
  double membrane_kinetic = 0;  // change
};

class EnergyBalance {
 public:
  /// What the balance knows at its last sample, for checkpoints.
  struct State {
    EnergyTotals totals, rates, first;  // rates in nW; contents of the first sample, in fJ
    double driving_pressure = 0, time = 0;
    long samples = 0;
  };

  explicit EnergyBalance(FlowSimulation& simulation) : simulation_(simulation) {}

  const State& state() const { return state_; }
  void resume(const State& state) { state_ = state; }

  /// Add what happened since the last sample, by the trapezoidal rule in time: as exact as the samples are close. The
  /// last tractions must belong to the present state.
  /// @param elastic_fJ  of all membranes at present
  void sample(double elastic_fJ);

  const EnergyTotals& totals() const { return state_.totals; }
  /// The largest term of the whole balance, fJ.
  double largest_fJ() const;
  /// What is not accounted for, over the largest term. None before there are two samples, or where nothing moves.
  std::optional<double> imbalance() const;
  /// The part of it between fluid and membranes: the work of tractions against what the membranes stored and dissipated.
  std::optional<double> coupling_imbalance() const;
  /// Mean pressure that drives the flow through the sides at the last sample: power over volume flow, kPa. Zero where
  /// nothing flows in.
  double driving_pressure_kPa() const { return state_.driving_pressure; }

 private:
  void add_shared_cells(EnergyTotals& now);

  FlowSimulation& simulation_;
  State state_;
};

}  // namespace corpuscle
