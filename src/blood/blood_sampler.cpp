#include "blood/blood_sampler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "blood/cell_flow.hpp"
#include "blood/core_edge.hpp"
#include "core/log.hpp"
#include "core/units.hpp"

namespace corpuscle {

namespace {

/// What means are taken of; then the hematocrit of each bin, and then its velocity. Drag: stress of walls that move past
/// each other, towards where they go.
enum Quantity { hematocrit, mean_speed, cell_speed, discharge, drag, wall_rate, layer, first_bin };

const double unknown = std::nan("");

/// A spacing or so wide, and as many as there is room for.
int default_bins(const Case& scene, const GuidedFlow& flow, const Grid& grid) {
  constexpr int least = 4;
  if (flow.frame.tube()) return std::clamp(static_cast<int>(flow.frame.width / grid.mean_spacing()), least, most_bins);
  int bins = scene.grid->nodes[flow.across] - 1;
  while (bins > most_bins) bins = (bins + 1) / 2;
  return std::max(bins, 1);
}

template <class View>
void add_ranks(const Comm& comm, const View& host, std::vector<double>& values) {
  values.assign(host.data(), host.data() + values.size());
  comm.sum(values.data(), static_cast<int>(values.size()));
}

std::string to_text(double value, const std::string& unit) {
  return fmt::format("{:.3g}{}", value, unit.empty() ? "" : unit == "_um" ? " um" : " mm/s");
}

}  // namespace

BloodSampler::BloodSampler(const Case& scene, FlowSimulation& simulation)
    : simulation_(simulation),
      settings_(*scene.blood),
      boundaries_(scene.boundaries),
      every_us_(scene.blood->interval_us(scene.time.step_us)),
      flow_(find_guided_flow(scene, simulation.fluid())),
      began_us_(scene.blood->from_us) {
  if (!flow_) no_flow_ = why_unguided(scene);
  if (flow_) frame_ = flow_->frame;
  if (flow_ && flow_->gradient != 0) {
    const auto scope = simulation.timers().scope("set-up");
    plasma_speed_ = plasma_speed(simulation.grid().comm(), scene, *flow_);
  }
  bins_ = !frame_.guided() ? 0 : settings_.bins > 0 ? settings_.bins : default_bins(scene, *flow_, simulation.grid());
  if (frame_.guided()) windows_ = std::max(1, static_cast<int>(std::lround(frame_.length / settings_.layer_window_um)));
  means_ = RunningMeans(first_bin + 2 * bins_);
  make_profile();
  if (by_walls()) mark_walls();
  cell_totals_ = Array<double>("corpuscle::blood::cell_totals", CellFlowColumn::within + bins_);
  cell_totals_host_ = HostCopy(cell_totals_);
  cell_sums_.resize(cell_totals_.size());
  if (windows_ > 0) {
    edge_ = Table<double>(uninitialised("corpuscle::blood::edge"), windows_, view_count(frame_) + filled_columns);
    edge_host_ = HostCopy(edge_);
  }
}

/// Owned cells by their bins; where the flow has no direction across, all in one.
void BloodSampler::make_profile() {
  const Grid& grid = simulation_.grid();
  const IndexSpace& index = grid.index();
  const int bins = std::max(bins_, 1), owned = index.owned();
  const Array<int> bin(uninitialised("corpuscle::blood::bin"), owned);
  const Array<double> across(uninitialised("corpuscle::blood::across"), owned);
  find_bins(grid.views(), frame_, bins, bin, across);
  const auto host_bin = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), bin);
  const auto host_across = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), across);
  const auto volume = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid.views().volume);
  profile_.cell = Array<int>(uninitialised("corpuscle::blood::profile_cell"), owned);
  profile_.start = Array<int>("corpuscle::blood::profile_start", bins + 1);
  const auto cell = Kokkos::create_mirror_view(profile_.cell);
  const auto start = Kokkos::create_mirror_view(profile_.start);
  std::vector<double> sums(2 * bins, 0.0);
  std::vector<int> next(bins + 1, 0);
  for (int e = 0; e < owned; ++e) ++next[host_bin(e) + 1];
  start(0) = 0;
  for (int b = 0; b < bins; ++b) start(b + 1) = next[b + 1] += next[b];
  for (int e = 0; e < owned; ++e) {
    const int c = index.visit_compact(e, [&](int i, int j, int k) { return index.cell(i, j, k); });
    cell(next[host_bin(e)]++) = c;
    sums[2 * host_bin(e)] += volume(c);
    sums[2 * host_bin(e) + 1] += volume(c) * host_across(e);
  }
  Kokkos::deep_copy(profile_.cell, cell);
  Kokkos::deep_copy(profile_.start, start);
  grid.comm().sum(sums.data(), static_cast<int>(sums.size()));
  for (int b = 0; b < bins_; ++b) bin_place_.push_back(sums[2 * b] > 0 ? sums[2 * b + 1] / sums[2 * b] : unknown);
  if (frame_.kind == FlowFrame::Kind::swept) {
    profile_.direction = Components<double>(uninitialised("corpuscle::blood::direction"), owned, 3);
    profile_.lengthening = Array<double>(uninitialised("corpuscle::blood::lengthening"), owned);
    find_directions(grid.views(), frame_, profile_);
  }
  profile_parts_ = Table<double>(uninitialised("corpuscle::blood::profile_parts"), bins * sections, ProfileColumn::count);
  profile_parts_host_ = HostCopy(profile_parts_);
  profile_sums_.resize(bins * ProfileColumn::count);
  // The share of the whole that a bin is, of the grid's volume: exact for tubes, bent ones too, and between walls.
  for (int b = 0; b < bins_; ++b) {
    const double inner = static_cast<double>(b) / bins_, outer = static_cast<double>(b + 1) / bins_;
    bin_volume_.push_back(grid.total_volume() * (frame_.tube() ? outer * outer - inner * inner : outer - inner));
  }
}

bool BloodSampler::due() const {
  const double now = simulation_.time(), before = now - simulation_.last_step_us();
  constexpr double rounding = 1e-9;
  if (now < settings_.from_us * (1 - rounding)) return false;
  return std::floor(now / every_us_ + rounding) > std::floor(before / every_us_ + rounding);
}

/// Volumes and flows of the cells, of all ranks.
void BloodSampler::measure_cells() {
  const Membranes& membranes = *simulation_.membranes();
  const int cells = membranes.cells();
  if (const auto rows = static_cast<std::size_t>(cells) * sections; !cell_parts_.data() || cell_parts_.extent(0) < rows)
    cell_parts_ = Table<double>(uninitialised("corpuscle::blood::cell_parts"), rows + rows / 10 + sections, cell_totals_.size());
  sum_cell_flow(membranes.surfaces(), cells, frame_, bins_, cell_parts_, cell_totals_);
  add_ranks(simulation_.grid().comm(), cell_totals_host_.read(), cell_sums_);
}

/// Volumes and velocities of the bins, of all ranks.
void BloodSampler::measure_flow() {
  const int bins = std::max(bins_, 1);
  sum_profile(simulation_.grid().views(), profile_, frame_.tangent, simulation_.fluid().velocity(), bins, profile_parts_);
  const auto& parts = profile_parts_host_.read();
  for (int b = 0; b < bins; ++b)
    for (int q = 0; q < ProfileColumn::count; ++q) {
      double& sum = profile_sums_[b * ProfileColumn::count + q];
      sum = 0;
      for (int s = 0; s < sections; ++s) sum += parts(b * sections + s, q);
    }
  simulation_.grid().comm().sum(profile_sums_.data(), static_cast<int>(profile_sums_.size()));
}

void BloodSampler::measure_layer() {
  const Membranes& membranes = *simulation_.membranes();
  find_core_edge(membranes.surfaces(), membranes.views().triangles, frame_, windows_, edge_);
  const auto& host = edge_host_.read();
  std::vector<double> edge(host.data(), host.data() + edge_.size());
  simulation_.grid().comm().max(edge.data(), static_cast<int>(edge.size()));
  last_.cell_free_layer_um = cell_free_layer(frame_, windows_, edge.data());
}

/// Forward along the lower wall and backward along the upper one.
void BloodSampler::mark_walls() {
  Grid& grid = simulation_.grid();
  const IndexSpace& index = grid.index();
  along_walls_ = Components<double>("corpuscle::blood::along_walls", index.size(), 3);
  const auto host = Kokkos::create_mirror_view(along_walls_);
  Kokkos::deep_copy(host, 0.0);
  const int d = flow_->across, halo = IndexSpace::halo;
  for (int end = 0; end < 2; ++end) {
    if (grid.halo().neighbour(d, end) >= 0) continue;
    int low[3], high[3];
    for (int e = 0; e < 3; ++e) low[e] = -halo, high[e] = index.n[e] + halo - 1;
    low[d] = high[d] = end == 0 ? -1 : index.n[d];
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i) store(host, index.cell(i, j, k), (end == 0 ? 1.0 : -1.0) * frame_.tangent);
  }
  Kokkos::deep_copy(along_walls_, host);
}

/// Stress on the walls, kPa, that of the forces included which cells beside them have on them through the kernel, and the rate at
/// which they move past each other, 1/us.
BloodSampler::WallShear BloodSampler::wall_shear() {
  const FluidSolver& fluid = simulation_.fluid();
  Grid& grid = simulation_.grid();
  const int d = flow_->across;
  double sums[4] = {};
  Vec3 velocity[2];
  for (int end = 0; end < 2; ++end) {
    const BoundarySettings& wall = boundaries_[flow_->wall[end]];
    const double factor = wall.velocity ? time_factor(wall, simulation_.time()) : 0;
    for (int m = 0; m < 3; ++m) velocity[end][m] = wall.velocity ? factor * (*wall.velocity)[m] : 0;
    if (grid.halo().neighbour(d, end) >= 0) continue;
    const auto force_on = fluid.skewed() ? wall_force<true> : wall_force<false>;
    const auto side = force_on(grid.views(), fluid.coefficients(), d, end, fluid.viscosity(), fluid.velocity(), frame_.tangent);
    sums[2 * end] = side[0], sums[2 * end + 1] = side[1];
  }
  grid.comm().sum(sums, 4);
  const double rate = dot(velocity[1] - velocity[0], frame_.tangent) / frame_.width;
  const double of_cells = simulation_.coupling()->power_on_sides(along_walls_);
  // What drags one wall forward holds the other back.
  return {0.5 * (sums[0] / sums[1] - sums[2] / sums[3] + of_cells / sums[1]), rate};
}

const BloodSample& BloodSampler::sample() {
  using Cells = CellFlowColumn;
  measure_cells();
  measure_flow();
  last_ = {};
  last_.time_us = simulation_.time();
  const double volume = cell_sums_[Cells::volume];
  last_.hematocrit = volume / simulation_.grid().total_volume();
  double fluid_volume = 0, flow = 0;
  for (std::size_t b = 0; b < profile_sums_.size(); b += ProfileColumn::count)
    fluid_volume += profile_sums_[b + ProfileColumn::volume], flow += profile_sums_[b + ProfileColumn::flow];
  const bool driven = flow_ && flow_->driven;
  last_.mean_speed = driven ? flow / fluid_volume : unknown;
  last_.cell_speed = driven ? cell_sums_[Cells::flow] / volume : unknown;
  last_.discharge_hematocrit = last_.hematocrit * last_.cell_speed / last_.mean_speed;
  last_.relative_viscosity = unknown;
  if (plasma_speed_ != 0) last_.relative_viscosity = plasma_speed_ / last_.mean_speed;
  WallShear walls{unknown, unknown};
  if (by_walls()) walls = wall_shear();
  drag_of_walls_ = std::abs(walls.rate) > 0 ? walls.stress / (simulation_.fluid().viscosity() * walls.rate) : unknown;
  if (flow_ && flow_->no_viscosity.empty() && by_walls()) last_.relative_viscosity = drag_of_walls_;
  last_.cell_free_layer_um = unknown;
  if (windows_ > 0) measure_layer();
  const bool moving = std::abs(walls.rate) > 0;  // at rest there is no viscosity to see
  std::vector<double> values{last_.hematocrit,
                             last_.mean_speed,
                             last_.cell_speed,
                             last_.discharge_hematocrit,
                             moving ? std::copysign(1, walls.rate) * walls.stress : unknown,
                             moving ? std::abs(walls.rate) : unknown,
                             last_.cell_free_layer_um};
  for (int b = 0; b < bins_; ++b)
    values.push_back((cell_sums_[Cells::within + b] - (b > 0 ? cell_sums_[Cells::within + b - 1] : 0)) / bin_volume_[b]);
  for (int b = 0; b < bins_; ++b) {
    const double* sums = profile_sums_.data() + b * ProfileColumn::count;
    values.push_back(sums[ProfileColumn::volume] > 0 ? sums[ProfileColumn::speed] / sums[ProfileColumn::volume] : unknown);
  }
  means_.add(values);
  return last_;
}

/// Why a figure is missing, and how those that are there were found.
void BloodSampler::add_notes(nlohmann::json& block) const {
  if (!block.contains("left_out")) block["left_out"] = nlohmann::json::object();
  auto& missing = block["left_out"];
  const auto leave = [&](const char* name, const std::string& why) {
    if (!block.contains(name)) missing[name] = why;
  };
  if (samples() == 0) {
    missing["all"] =
        "nothing was sampled: the run ended before blood.from_us, or before the first multiple of blood.sample_every_us after it";
    return;
  }
  const std::string undriven = "no flow is driven through the grid in one direction" + (flow_ ? "" : ": " + no_flow_);
  const std::string still = flow_ && flow_->driven ? "nothing flowed"
                            : flow_ && flow_->gradient == 0 && norm(simulation_.fluid().imposed_gradient()) > 0
                                ? "walls that move carry the fluid along, besides what the pressure gradient drives"
                                : undriven;
  leave("discharge_hematocrit", still);
  leave("mean_speed_mm_per_s", still);
  leave("cell_speed_mm_per_s", still);
  leave("relative_apparent_viscosity", !flow_                         ? undriven
                                       : !flow_->no_viscosity.empty() ? flow_->no_viscosity
                                       : by_walls()                   ? "the walls were at rest at all samples"
                                                                      : "nothing flowed");
  leave("cell_free_layer_um", frame_.guided()             ? "there was no cell along the flow at any sample"
                              : flow_ && flow_->duct >= 0 ? "between four walls it is not measured"
                              : flow_                     ? "the flow has no walls to the sides"
                                                          : undriven);
  leave("smallest_gap_um", simulation_.coupling()->contact_report() ? "nothing came within reach of the contact" : "there is no [contact]");
  leave("crossings", "there is no [contact]");
  if (missing.empty()) block.erase("left_out");
}

/// A figure, the standard error of its mean or why that is not known, and for how many samples its own count.
void BloodSampler::put_figure(nlohmann::json& block, const Figure& figure) const {
  if (!std::isfinite(figure.value)) return;
  const RunningMean& series = means_.of(figure.series);
  const std::string error_name = figure.name + "_error" + figure.unit;
  block[figure.name + figure.unit] = figure.value;
  if (series.samples() < samples())
    block["samples_left_out"][figure.name] = fmt::format("{} of {}, in which it has no value", samples() - series.samples(), samples());
  const double time = series.correlation() * every_us_, effective = series.effective_samples();
  if (figure.known) {
    block[error_name] = figure.error;
    block["correlation"][figure.name] = {{"time_us", time}, {"effective_samples", effective}};
    return;
  }
  block[error_name] = nullptr;
  block["left_out"][error_name] =
      series.samples() < RunningMean::least_blocks
          ? fmt::format("{} samples are too few, {} are needed at least", series.samples(), RunningMean::least_blocks)
          : fmt::format(
                "at least {}: samples are alike for {:.2g} us at least and count for {:.2g} at most, too few to tell; run "
                "for longer (time.end_us)",
                to_text(figure.error, figure.unit), time, effective);
}

/// What the walls' drag says; each sample counts with its rate of shear.
BloodSampler::Figure BloodSampler::viscosity_figure() const {
  Figure figure{"relative_apparent_viscosity", "", unknown, unknown, false, drag};
  const double speed = means_.mean(mean_speed);
  if (plasma_speed_ != 0) {
    const RunningMean& series = means_.of(mean_speed);
    figure.series = mean_speed;
    figure.value = plasma_speed_ / speed;
    figure.error = std::abs(figure.value / speed) * series.least_error();
    figure.known = series.error_known();
  } else if (by_walls() && flow_->no_viscosity.empty()) {
    const RunningMean &stress = means_.of(drag), &rate = means_.of(wall_rate);
    const double viscosity = simulation_.fluid().viscosity();
    figure.value = stress.mean() / (viscosity * rate.mean());
    figure.error = (stress.least_error() / viscosity + std::abs(figure.value) * rate.least_error()) / rate.mean();
    figure.known = stress.error_known() && rate.error_known();
  }
  return figure;
}

/// Whether what varies slowest has come to vary by chance only; null where that cannot be told from a slow drift.
void BloodSampler::put_steady(nlohmann::json& block) const {
  constexpr double surely = 3;
  bool drifts = false, all_known = true, any = false;
  for (const int q : {int(discharge), int(plasma_speed_ != 0 ? mean_speed : drag), int(layer)}) {
    const RunningMean& series = means_.of(q);
    if (series.samples() == 0) continue;
    const double drift = series.drift_over_chance();
    any = true;
    all_known = all_known && series.error_known() && std::isfinite(drift);
    drifts = drifts || drift > surely;
  }
  if (any && (drifts || all_known)) {
    block["steady"] = !drifts;
    return;
  }
  block["steady"] = nullptr;
  block["left_out"]["steady"] = any     ? "the samples are too few, or too much alike, to tell a drift from chance"
                                : flow_ ? "nothing that could drift has a value"
                                        : "no figure of a flow has a value: " + no_flow_;
}

nlohmann::json BloodSampler::report() const {
  nlohmann::json block;
  block["cells"] = simulation_.cells();
  block["from_us"] = began_us_;
  block["samples"] = samples();
  if (samples() == 0) return block;
  block["sampled_every_us"] = every_us_;
  const double speed = means_.mean(mean_speed), cells = means_.mean(cell_speed), share = means_.mean(hematocrit);
  const auto put = [&](const char* name, const char* unit, double value, double scale, Quantity q) {
    put_figure(block, {name, unit, value, scale * means_.of(q).least_error(), means_.of(q).error_known(), q});
  };
  block["tube_hematocrit"] = share;
  put("mean_speed", "_mm_per_s", speed / units::mm_per_s, 1 / units::mm_per_s, mean_speed);
  put("cell_speed", "_mm_per_s", cells / units::mm_per_s, 1 / units::mm_per_s, cell_speed);
  put("discharge_hematocrit", "", share * cells / speed, 1, discharge);
  put_figure(block, viscosity_figure());
  if (plasma_speed_ != 0) block["plasma_mean_speed_mm_per_s"] = plasma_speed_ / units::mm_per_s;
  put("cell_free_layer", "_um", means_.mean(layer), 1, layer);
  if (block.contains("cell_free_layer_um"))
    block["cell_free_layer_is"] = fmt::format(
        "between the wall and the outermost membrane in windows of {:.3g} um along the flow, seen from {} sides; where "
        "there is no "
        "cell along the flow there is no layer. It is the mean over all sides: of a cell that is alone in its window it tells how wide "
        "the cell is, wherever it is; how near cells come to the wall is contact.smallest_gap_to_walls_um",
        frame_.length / windows_, view_count(frame_));
  put_steady(block);
  block["errors_are"] = fmt::format(
      "standard errors over time: the largest from blocks of 1, 2, 4, ... samples of which there are {} at least, where the "
      "longest know next to nothing of each other",
      RunningMean::least_blocks);
  return block;
}

BloodSampler::Profile BloodSampler::profile() const {
  Profile profile;
  if (bins_ == 0) return profile;
  for (int b = 0; b <= bins_; ++b) profile.edge_um.push_back(frame_.width * b / bins_);
  profile.velocity_um = bin_place_;
  for (int b = 0; b < bins_; ++b) {
    const int share = first_bin + b, speed = first_bin + bins_ + b;
    profile.hematocrit.push_back(means_.mean(share));
    profile.hematocrit_error.push_back(means_.error(share));
    profile.velocity_mm_per_s.push_back(means_.mean(speed) / units::mm_per_s);
    profile.velocity_error_mm_per_s.push_back(means_.error(speed) / units::mm_per_s);
  }
  return profile;
}

}  // namespace corpuscle
