#include "app/flow_output.hpp"

#include "app/figure_levels.hpp"
#include "cells/cell_state.hpp"
#include "common/extremes.hpp"
#include "core/error.hpp"
#include "core/units.hpp"
#include "coupling/restart.hpp"
#include "output/owned_values.hpp"

#include <fmt/format.h>

#include <cmath>

namespace corpuscle {

namespace {

#ifdef CORPUSCLE_HDF5
std::vector<std::int32_t> to_int32(const HostMirror<Table<int>>& host) { return {host.data(), host.data() + host.span()}; }
#endif

#ifdef CORPUSCLE_HDF5
SurfaceShare share_of(const SharedCells& cells) {
  return {static_cast<hsize_t>(cells.total_vertices()),
          static_cast<hsize_t>(cells.total_triangles()),
          static_cast<hsize_t>(cells.total()),
          vertex_rows(cells),
          triangle_rows(cells),
          cell_rows(cells)};
}

/// Of surfaces that every rank has.
std::unique_ptr<CellWriter> make_writer(const std::string& folder, const Comm& comm, const SurfaceSet& set, const std::string& name,
                                        std::optional<double> restart_us) {
  const auto body = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.triangle_body);
  const std::vector<std::int32_t> bodies(body.data(), body.data() + set.triangles);
  return std::make_unique<CellWriter>(folder, comm, to_int32(triangles_on_host(set)), bodies, set.vertices, restart_us, name);
}

/// Vertices are numbered over all ranks' cells.
std::unique_ptr<CellWriter> make_shared_writer(const std::string& folder, const Comm& comm, const SharedCells& cells,
                                               std::optional<double> restart_us) {
  const auto triangle = triangles_on_host(cells.surfaces());
  const auto first_vertex = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().first_vertex);
  const auto first_triangle = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().first_triangle);
  std::vector<std::int32_t> triangles, bodies;
  for (std::size_t c = 0; c < cells.own().size(); ++c)
    for (int t = first_triangle(c); t < first_triangle(c + 1); ++t) {
      for (int k = 0; k < 3; ++k)
        triangles.push_back(static_cast<std::int32_t>(triangle(t, k) - first_vertex(c) + cells.own()[c].first_vertex));
      bodies.push_back(cells.own()[c].number);
    }
  return std::make_unique<CellWriter>(folder, comm, triangles, bodies, share_of(cells), restart_us);
}
#endif

}  // namespace

FlowOutput::FlowOutput(const Place& place, Case scene, FlowSimulation& simulation, Timers& timers, std::optional<double> restart_us,
                       std::chrono::steady_clock::time_point start)
    : folder_(place.folder),
      run_(place.run),
      files_(place.files),
      scene_(std::move(scene)),
      simulation_(simulation),
      timers_(timers),
      start_(start),
      energy_(simulation) {
  const Comm& comm = simulation.grid().comm();
  if (simulation.coupling()) history_ = std::make_unique<BodyHistory>(folder_, scene_, simulation, restart_us);
  // Nothing on a rank grows with the number of all cells.
  if (history_ && !history_->few_cells()) std::vector<CellSettings>().swap(scene_.cells);
  if (scene_.blood) {
    blood_ = std::make_unique<BloodSampler>(scene_, simulation);
    blood_files_ = std::make_unique<BloodFiles>(folder_, comm, restart_us);
  }
#ifdef CORPUSCLE_HDF5
  if (scene_.output.fields)
    fields_ = std::make_unique<FieldWriter>(folder_, comm, simulation.grid().index(), simulation.grid().owned_nodes().data(), restart_us);
  if (scene_.output.cells && simulation.shared_cells()) {
    cells_ = make_shared_writer(folder_, comm, *simulation.shared_cells(), restart_us);
    if (simulation.immersed()) bodies_ = make_writer(folder_, comm, simulation.immersed()->surfaces(), "bodies", restart_us);
  } else if (scene_.output.cells && simulation.surfaces()) {
    cells_ = make_writer(folder_, comm, *simulation.surfaces(), "cells", restart_us);
  }
#endif
}

/// Whether it is that, or the last.
bool FlowOutput::due(double every_us) const { return simulation_.done() || simulation_.at_outflow() || passed(every_us); }

/// Whether it is the first at or after a multiple of `every_us`.
bool FlowOutput::passed(double every_us) const {
  if (every_us <= 0) return false;
  const double step = simulation_.last_step_us(), now = simulation_.time();
  return std::floor(now / every_us + 1e-9) > std::floor((now - step) / every_us + 1e-9);
}

/// Figures that cost a share of a step are taken, whatever the run stores, at the first steps, where most flows change fastest,
/// and at every eighth.
bool FlowOutput::regular() const {
  constexpr long first = 8, every = 8;
  return simulation_.steps() <= first || simulation_.steps() % every == 0;
}

/// And at the last step: that one counts for this run's report alone, since a run that goes on from here would not have it.
void FlowOutput::sample_flow() {
  const bool regular = this->regular();
  if (!regular && !simulation_.done() && !simulation_.at_outflow()) return;
  const FlowSample sample{simulation_.time(), simulation_.fluid().splitting(),
                          simulation_.immersed() ? simulation_.immersed()->slip()[1] : 0.0,
                          larger(simulation_.fluid().statistics().speed, speed_at_rest)};
  if (regular)
    totals_.add(sample);
  else
    end_sample_ = sample;
}

void FlowOutput::gather() {
  const auto& fluid = simulation_.fluid().statistics();
  totals_.momentum.add(fluid.momentum_iterations);
  totals_.pressure.add(fluid.pressure_iterations);
  totals_.projections.add(fluid.projections);
  totals_.speed = larger(totals_.speed, fluid.speed);
  const double spacing = simulation_.grid().mean_spacing();
  if (fluid.reference_speed > 0)
    totals_.divergence = larger(totals_.divergence, fluid.divergence / (fluid.reference_speed * spacing * spacing));
  totals_.flux_correction = larger(totals_.flux_correction, fluid.flux_correction);
  if (!simulation_.membranes()) return;
  totals_.coupling.add(simulation_.statistics().coupling_iterations);
  totals_.substeps.add(simulation_.statistics().substeps);
  totals_.residual.add(simulation_.statistics().coupling_residual);
}

void FlowOutput::after_step(bool start) {
  const auto scope = timers_.scope("output");
  if (!start) gather();
  const auto& output = scene_.output;
  const bool written = start || output.history_every_us <= 0 || due(output.history_every_us);
  if (written || regular()) {
    if (history_) measure_bodies();
    if (history_ && written) history_->write();
    const EnergyBalance::State before = energy_.state();
    energy_.sample(history_ ? history_->elastic_energy() : 0);
    // As in sample_flow(): what a run takes at its end alone is not there for one that goes on.
    if (!start && !regular() && output.history_every_us > 0 && !passed(output.history_every_us)) {
      end_energy_ = energy_.state();
      energy_.resume(before);
    }
  }
  if (!start) sample_flow();
  if (!start) sample_blood();
  if (start || due(output.every_us)) {
    write_fields();
    write_cells();
  }
  if (!start && due(output.checkpoint_every_us)) write_checkpoint_now();
}

void FlowOutput::measure_bodies() {
  history_->measure();
  totals_.volume_drift = larger(totals_.volume_drift, history_->drifts().volume);
  if (history_->drifts().area > totals_.area_drift) totals_.widest = history_->drifts().widest;
  totals_.area_drift = larger(totals_.area_drift, history_->drifts().area);
}

void FlowOutput::write_fields() {
#ifdef CORPUSCLE_HDF5
  if (!fields_) return;
  const IndexSpace& index = simulation_.grid().index();
  const CellBox owned{{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
  std::vector<CellField> fields;
  std::vector<CellLabels> labels;
  std::vector<double> velocity, pressure, stress;
  std::vector<std::int8_t> kind;
  if (scene_.output.velocity) {
    velocity = interleaved(index, owned, simulation_.fluid().velocity());
    fields.push_back({"velocity_um_per_us", 3, velocity.data()});
  }
  if (scene_.output.pressure) {
    pressure = box_values(index, owned, simulation_.fluid().pressure());
    fields.push_back({"pressure_kPa", 1, pressure.data()});
  }
  if (scene_.output.wall_shear_stress) {
    stress = wall_stress_Pa();
    fields.push_back({"wall_shear_stress_Pa", 3, stress.data()});
  }
  if (scene_.output.kind) {
    for (auto value : box_integers(index, owned, simulation_.fluid().kind())) kind.push_back(static_cast<std::int8_t>(value));
    labels.push_back({"kind", kind.data()});
  }
  fields_->write(simulation_.time(), simulation_.steps(), fields, labels);
#endif
}

/// On this block's cells beside walls.
std::vector<double> FlowOutput::wall_stress_Pa() {
  const IndexSpace& index = simulation_.grid().index();
  if (!wall_stress_.data()) wall_stress_ = Components<double>("corpuscle::blood::wall_stress", index.size(), 3);
  find_wall_stress(scene_.boundaries, simulation_.fluid(), wall_stress_);
  auto values = interleaved(index, {{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}}, wall_stress_);
  for (double& value : values) value /= units::Pa;
  return values;
}

void FlowOutput::write_cells() {
  if (!simulation_.surfaces()) return;
  if (simulation_.steps() > 0) simulation_.coupling()->tractions_for_output();  // for traction_fallbacks as well
#ifdef CORPUSCLE_HDF5
  if (!cells_) return;
  if (!simulation_.shared_cells()) return write_surfaces(*cells_, *simulation_.surfaces(), simulation_.coupling()->tractions_for_output());
  write_shared_cells();
  if (bodies_) write_surfaces(*bodies_, simulation_.immersed()->surfaces(), simulation_.immersed()->last_tractions());
#endif
}

#ifdef CORPUSCLE_HDF5
void FlowOutput::write_surfaces(CellWriter& writer, const SurfaceSet& set, const Components<double>& tractions) const {
  const auto x = vertex_values(set.vertices, set.x), v = vertex_values(set.vertices, set.v);
  const auto traction = vertex_values(set.vertices, tractions);
  writer.write(simulation_.time(), simulation_.steps(), x.data(),
               {{"velocity_um_per_us", 3, v.data()}, {"traction_kPa", 3, traction.data()}});
}
#endif

/// This rank's own, with their figures.
void FlowOutput::write_shared_cells() {
#ifdef CORPUSCLE_HDF5
  const SharedCells& shared = *simulation_.shared_cells();
  const auto& set = shared.surfaces();
  const auto x = vertex_values(set.own_vertices, set.x), v = vertex_values(set.own_vertices, set.v);
  const auto traction = vertex_values(set.own_vertices, simulation_.coupling()->tractions_for_output());
  const CellFigures figures = history_->cell_figures();
  cells_->write(simulation_.time(), simulation_.steps(), share_of(shared), x.data(),
                {{"velocity_um_per_us", 3, v.data()}, {"traction_kPa", 3, traction.data()}}, figures.tables());
#endif
}

void FlowOutput::sample_blood() {
  if (!blood_ || !blood_->due()) return;
  blood_files_->write(blood_->sample());
}

void FlowOutput::write_checkpoint_now() {
#ifdef CORPUSCLE_HDF5
  if (blood_) blood_files_->write_profile(*blood_, simulation_.time());
  const std::string path = folder_ + "/checkpoint.h5";
  std::string totals = to_text(totals_now());
  simulation_.grid().comm().broadcast(totals);
  write_checkpoint(path, simulation_, {scene_.resolved, files_, run_, totals});
  last_checkpoint_ = path;
#endif
}

void FlowOutput::stop() {
  write_checkpoint_now();
  if (history_) measure_bodies();
}

void FlowOutput::started_from(const std::string& checkpoint, const RunTotals& totals, const std::vector<std::string>& changed) {
  last_checkpoint_ = checkpoint;
  totals_ = totals;
  energy_.resume(totals.energy);
  if (simulation_.immersed()) simulation_.immersed()->resume(totals.immersed);
  if (simulation_.coupling()) simulation_.coupling()->resume_contact(totals.contact);
  if (blood_) blood_->resume(totals.blood, changed);
}

/// All that has been counted, of this run and those before it.
RunTotals FlowOutput::totals_now(bool together) {
  const Comm& comm = simulation_.grid().comm();
  const auto largest = [&](double seconds) { return together ? comm.max(seconds) : seconds; };
  RunTotals now = totals_;
  now.energy = energy_.state();
  if (simulation_.immersed() && together) now.immersed = simulation_.immersed()->report();
  if (simulation_.coupling())
    if (const auto contact = simulation_.coupling()->contact_report()) now.contact = *contact;
  if (blood_) now.blood = blood_->state();
  now.wall_s += largest(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
  for (const auto& [part, seconds] : timers_.seconds()) now.wall_s_by_part[part] += largest(seconds);
  return now;
}

FlowRecord FlowOutput::record() const { return {scene_, simulation_, energy_, history_.get(), totals_.widest}; }

void FlowOutput::fill_totals(Report& report, RunTotals now) const {
  if (end_sample_) now.add(*end_sample_);
  report_totals(record(), now, report);
  report.wall_s_this_run = now.wall_s - totals_.wall_s;
}

std::string FlowOutput::worst_error() const {
  nlohmann::json errors{{"max_divergence", totals_.divergence}, {"flux_correction", totals_.flux_correction}};
  if (totals_.splitting_until_us > 0) errors["splitting"] = totals_.splitting_us / totals_.splitting_until_us;
  if (simulation_.immersed()) errors["slip"] = totals_.slip();
  if (simulation_.membranes()) {
    errors["volume_drift"] = totals_.volume_drift;
    if (simulation_.membranes()->any_holds_area()) errors["area_drift"] = totals_.area_drift;
  }
  if (const auto whole = energy_.imbalance()) errors["energy_balance"] = *whole;
  return worst_figure(errors, scales_of(record()));
}

void FlowOutput::fill_broken(Report& report, bool together) {
  if (end_energy_) energy_.resume(*end_energy_);
  fill_totals(report, totals_now(together));
  judge_figures(record(), report);
}

void FlowOutput::fill_blood(Report& report, const ContactReport& contact) const {
  if (!blood_) return;
  auto block = blood_->report();
  if (simulation_.coupling()->contact_report()) {
    block["crossings"] = contact.crossings;
    if (contact.smallest() < 1e30) block["smallest_gap_um"] = contact.smallest();
  }
  blood_->add_notes(block);
  report.extra["blood"] = block;
}

/// So that a comparison of runs gives bars to them.
void FlowOutput::fill_blood_quantities(Report& report) const {
  if (!blood_) return;
  const auto& block = report.extra["blood"];
  for (const char* name :
       {"mean_speed_mm_per_s", "cell_speed_mm_per_s", "discharge_hematocrit", "relative_apparent_viscosity", "cell_free_layer_um"})
    if (block.contains(name)) report.quantities[std::string("blood_") + name] = block[name];
}

void FlowOutput::fill(Report& report) {
  if (end_energy_) energy_.resume(*end_energy_);
  const RunTotals totals = totals_now();
  fill_totals(report, totals);
  fill_blood(report, totals.contact);
  if (blood_) blood_files_->write_profile(*blood_, simulation_.time());
  report_state(record(), report);
  fill_blood_quantities(report);
}

}  // namespace corpuscle
