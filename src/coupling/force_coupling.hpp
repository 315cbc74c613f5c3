// coupling.scheme = "force": membranes are forces in a fluid that is everywhere but in rigid bodies, and move with it.
#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "cells/shared_cells.hpp"
#include "core/error.hpp"
#include "coupling/cell_loads.hpp"
#include "coupling/sharp_coupling.hpp"
#include "parallel/agree.hpp"
#include "populations/populations.hpp"
#include "transfer/cytosol.hpp"
#include "transfer/near_side.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle {

class ForceCoupling : public Coupling {
 public:
  ForceCoupling(const Case& scene, const StepSchedule& schedule, FluidSolver& fluid, Timers& timers, const PackedCells* packed);

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
  CellEnergy energy_of_cells(double dt_us) override;
  double power_on_sides(const Components<double>& of_sides) override;
  double power_of_pushes() override { return loads_ ? loads_->power_of_pushes() : 0; }
  std::optional<ContactReport> contact_report() const override { return loads_ ? loads_->report() : std::nullopt; }
  void resume_contact(const ContactReport& report) override {
    if (loads_) loads_->resume(report);
  }

  /// The largest stable step, where it is not that of cells at rest.
  std::vector<double> state() const override;
  void set_state(const std::vector<double>& state) override;
  void cells_restored(double time_us) override;
  void resume(double time_us) override;
  std::vector<Triple> wrapped_by() const override;
  const SurfaceSet& surfaces() const override { return cells_->surfaces(); }
  Membranes* membranes() override { return membranes_; }
  SharedCells* shared_cells() override { return cells_.get(); }
  RigidBodies* rigid_bodies() override { return bodies_ ? bodies_->rigid_bodies() : nullptr; }
  ImmersedFlow* immersed() override { return bodies_ ? bodies_->immersed() : nullptr; }
  /// And of what falls upon the nodes next to the body when cells' forces are spread.
  std::array<double, 4> contact_load(int body, double dt_us) override;
  int cells() override { return cells_->total(); }
  long vertices() override { return cells_->total_vertices(); }
  const PackingReport* packing() const override { return packing_ ? &*packing_ : nullptr; }
  const PackedShare* packed() const override { return packed_ ? &*packed_ : nullptr; }

 private:
  void take_places(const Case& scene, const PackedCells* packed, double contact_um);
  void check_packing();
  void check_bodies();
  std::array<double, 5> load_beside(int body) const;
  double loss_beside_bodies() const;
  void warn_of_image() const;
  void warn_of_ratios() const;
  void warn_of_walls() const;
  void warn_of_pressed_start() const;
  void inflate();
  void settle_membranes(double size, double& mobility, long step);
  void place(double time_us);
  void check_all_at_home(double time_us);
  void fill_cells(double time_us);
  bool sharp_pressure() const { return scene_.coupling->pressure == CouplingSettings::Pressure::sharp; }
  void check_jumps(double time_us);
  void take_up();
  void watch_outflow();
  void limit_outflow();
  /// What fails on one rank fails on all.
  template <class Work>
  void together(const Work& work) const {
    std::string failure;
    try {
      work();
    } catch (const ComputationError& error) {
      failure = error.what();
    }
    failure = agree(fluid_.grid().comm(), failure);
    if (!failure.empty()) throw ComputationError(failure);
  }
  bool second_order(double dt) const;
  double two_steps_um(double dt) const;
  double resisting_share() const;
  void find_softest();
  double anticipated_reaction(double dt) const;
  double carried_on(double dt) const;
  /// The sum of all forces at the last gathering of loads.
  const Components<double>& forces() const { return loads_ ? loads_->force() : membranes_->views().force; }
  SlipViews slip_of_membranes() const;
  void begin_step(double time_us, double dt_us, double ahead_us);
  void update_copies();
  void hold_volume();
  void after_move(double time_us, double dt_us);
  void look(double time_us, double dt_us);
  void limit_slip(double dt_us);
  std::string vertex_text(int vertex) const;
  double second_order_share() const;
  using Kind = std::pair<int, Triple>;  // type, and by how much a cell starts drawn out
  struct Spacings {
    double narrowest = 1e30, widest = 0;    // um
    std::vector<std::vector<int>> numbers;  // [kind] of the cells that stand for it
  };
  std::vector<std::pair<double, double>> mean_spacings();
  Spacings spacings_of_cells();
  static std::map<int, Kind> farthest(const std::map<int, Kind>& drawn_out);
  Kind kind_of(const CellRecord& cell) const;
  void measure_stability() { measure_stability(*std::max_element(lengths_us_.begin(), lengths_us_.end())); }
  void measure_stability(double longest_us);
  void anticipate_short_waves(const MobilityModel& model, const std::vector<int>& numbers, Membranes& standing);
  void refuse_long_steps();
  static std::string rounded_down(double value);
  double next_step_us(double time_us, double dt_us) const;

  Case scene_;
  FluidSolver& fluid_;
  Timers& timers_;
  StepSchedule schedule_;
  std::vector<double> lengths_us_;  // of all steps there will be
  std::shared_ptr<Workspace> workspace_;
  std::unique_ptr<SharedCells> cells_;
  std::unique_ptr<SharpCoupling> bodies_;  // rigid ones, and the flow around them; null without any
  std::optional<PackingReport> packing_;   // only with populations
  std::optional<PackedShare> packed_;
  double asked_gap_ = 0;        // um, the least of the populations'
  double packed_gap_ = 0;       // um, that which they must have
  bool packed_in_box_ = false;  // some are to start within one
  int packed_listed_ = 0;       // cells of the scene that are not packed
  double small_stable_us_ = 0;  // stable_us_, short_waves_ and held_rate_ of packed cells before they have grown
  double small_short_waves_ = 0, small_held_rate_ = 0;
  bool grows_ = false;    // packed cells are still smaller than they are to be, and must grow
  bool small_ = false;    // or are about to be replaced by those of a checkpoint
  Membranes* membranes_;  // theirs
  std::unique_ptr<Transfer> transfer_;
  Components<double> traction_;       // [vertex, 3] kPa, in the workspace
  std::unique_ptr<Cytosol> cytosol_;  // only where it is not as viscous as the fluid outside
  Components<double> followed_;       // [vertex, 1] share of the forces that slip follows; only with slip
  std::unique_ptr<CellLoads> loads_;  // only where something else than membranes acts on them
  std::map<int, Kind> drawn_out_;     // by number, cells that start so, until the start has been checked
  double quiet_speed_;                // um/us: what counts as rest
  std::string coarse_;                // which cells the grid resolves coarsely
  /// What the fluid resists least, for cells with membrane viscosity; area: um2, of all.
  struct Softest {
    double area = 0, radius = 0, wave_number_square = 0;
  } softest_;
  double stable_us_ = 0;      // largest stable step at the start
  std::string least_stable_;  // which cell, with what it has from the start
  double short_waves_ = 0;    // share of membrane viscosity that the fluid's answer to short waves is taken for
  double held_rate_ = 0;      // 1/us, fastest at which membranes relax against their own viscosity
  double outflow_limit_ = 0;  // um
  NearSide outflow_;          // at the last place()
};

}  // namespace corpuscle
