// coupling.scheme = "force": membranes are forces in a fluid that is everywhere, and move with it.
#pragma once

#include "coupling/coupling.hpp"
#include "immersed/wrap.hpp"
#include "transfer/cytosol.hpp"
#include "transfer/near_side.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle {

class ForceCoupling : public Coupling {
 public:
  ForceCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers);

  void check_start() override;
  /// Forces at the present shape, one fluid solve with them, and a step with the velocity that the fluid has then.
  StepStatistics advance(double time_us, double dt_us) override;
  /// What the fluid does to the membranes: minus their own force over the vertices' areas.
  const Components<double>& tractions_for_output() override;
  std::string stability_text(double dt_us) const override;
  bool at_outflow(double dt_us) const override;
  std::string nearest_outflow() const override;
  std::string outflow_limit(double dt_us) const override;
  std::string coarse() const override { return coarse_; }
  std::map<std::string, double> report(double dt_us) const override;
  double power_on_cells() override;
  double unresolved_dissipation() override;

  /// Periods taken off each cell since the start, and the force on the fluid in the last step.
  std::vector<double> state() const override;
  void set_state(const std::vector<double>& state) override;
  std::vector<Triple> wrapped_by() const override;
  const SurfaceSet& surfaces() const override { return membranes_->surfaces(); }
  Membranes* membranes() override { return membranes_.get(); }

 private:
  void place(double time_us);
  void fill_cells(double time_us);
  void wrap();
  void collect();
  bool second_order(double dt) const;
  double two_steps_um(double dt) const;
  double resisting_share() const;
  void find_softest();
  double anticipated_reaction(double dt) const;
  /// On the fluid, in the last step.
  const Components<double>& forces() const { return membranes_->views().force; }
  SlipViews slip_of_membranes() const;
  std::string vertex_text(int vertex) const;
  void measure_stability();

  Case scene_;
  FluidSolver& fluid_;
  Timers& timers_;
  std::vector<double> lengths_us_;  // of all steps there will be
  std::unique_ptr<Membranes> membranes_;
  std::unique_ptr<Transfer> transfer_;
  std::unique_ptr<Cytosol> cytosol_;            // only where it is not as viscous as the fluid outside
  Components<double> traction_;                 // [vertex, 3] kPa
  Array<double> slip_share_;                    // [vertex] empty: 1
  HostCopy<Components<double>> velocity_host_;  // only on several ranks
  PeriodicFrame frame_;
  double quiet_speed_;        // um/us: what counts as rest
  Table<int> laps_;           // [cell, 3] only in periodic domains
  std::string coarse_;        // which cells the grid resolves coarsely
  /// What the fluid resists least, for cells with membrane viscosity; area: um2, of all.
  struct Softest {
    double area = 0, radius = 0, wave_number_square = 0;
  } softest_;
  double stable_us_ = 0;      // largest stable step at the start
  double outflow_limit_ = 0;  // um
  NearSide outflow_;          // at the last place()
};

}  // namespace corpuscle
