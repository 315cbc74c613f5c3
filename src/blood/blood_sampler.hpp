// [blood]: what blood people measure of many cells in a flow, as means over time with standard errors.
#pragma once

#include <nlohmann/json.hpp>

#include "blood/flow_profile.hpp"
#include "blood/guided_flow.hpp"
#include "blood/running_means.hpp"
#include "coupling/flow_simulation.hpp"

namespace corpuscle {

/// What one sample found; not a number where it has no meaning.
struct BloodSample {
  double time_us = 0;
  double hematocrit = 0;
  double mean_speed = 0, cell_speed = 0;  // um/us
  double discharge_hematocrit = 0, relative_viscosity = 0;
  double cell_free_layer_um = 0;
};

class BloodSampler {
 public:
  BloodSampler(const Case& scene, FlowSimulation& simulation);

  /// Whether a sample is due at the end of this step.
  bool due() const;
  /// Every rank calls. Kernels, and no allocation but for more cells than before.
  const BloodSample& sample();
  /// The walls' drag at the last sample over that of plasma alone at their rate of shear, whatever else drives or holds the fluid; not a
  /// number without walls that move past each other.
  double drag_of_walls() const { return drag_of_walls_; }

  /// The report's "blood", and why figures are missing there once all are in it.
  nlohmann::json report() const;
  void add_notes(nlohmann::json& block) const;
  /// Across the flow, bin by bin.
  struct Profile {
    std::vector<double> edge_um;      // [bins + 1] distance from the centreline, or from the lower wall
    std::vector<double> velocity_um;  // [bins] where the grid cells are, whose mean a bin's velocity is
    std::vector<double> hematocrit, hematocrit_error, velocity_mm_per_s, velocity_error_mm_per_s;
  };
  /// Empty where the flow has no walls.
  Profile profile() const;
  long samples() const { return means_.samples(); }
  bool tube() const { return frame_.tube(); }

  /// For checkpoints, the same on all ranks.
  std::vector<double> state() const;
  /// What was sampled before, unless it was of another flow or with other settings: then a warning, and sampling begins anew.
  /// @param changed  keys of the case that are others than until the checkpoint, but for those of [blood]
  void resume(const std::vector<double>& state, const std::vector<std::string>& changed);

 private:
  std::vector<std::string> other_settings(const std::vector<double>& state) const;
  void make_profile();
  void measure_cells();
  void measure_flow();
  void measure_layer();
  struct WallShear {
    double stress, rate;
  };
  WallShear wall_shear();
  void mark_walls();
  /// Whether the viscosity is to be had from walls that move past each other.
  bool by_walls() const { return flow_ && flow_->sheared && frame_.guided(); }
  struct Figure {
    std::string name, unit;
    double value, error;
    bool known;  // the error; else it is larger
    int series;
  };
  Figure viscosity_figure() const;
  void put_figure(nlohmann::json& block, const Figure& figure) const;
  void put_steady(nlohmann::json& block) const;

  FlowSimulation& simulation_;
  BloodSettings settings_;
  std::vector<BoundarySettings> boundaries_;
  double every_us_;  // between samples
  std::optional<GuidedFlow> flow_;
  std::string no_flow_;  // why there is none
  FlowFrame frame_;
  double plasma_speed_ = 0;  // um/us; 0: not known
  int bins_ = 0, windows_ = 0;
  ProfileViews profile_;
  std::vector<double> bin_volume_, bin_place_;  // um3, um
  Table<double> cell_parts_, profile_parts_, edge_;
  Array<double> cell_totals_;
  HostCopy<Array<double>> cell_totals_host_;
  HostCopy<Table<double>> profile_parts_host_, edge_host_;
  std::vector<double> cell_sums_, profile_sums_;  // of all ranks
  double drag_of_walls_ = 0;
  Components<double> along_walls_;  // [cell, 3] how the drag on each wall counts; only where walls move past each other
  BloodSample last_;
  RunningMeans means_;
  double began_us_ = 0;  // sampling; later than asked for where a restart has begun it anew
};

}  // namespace corpuscle
