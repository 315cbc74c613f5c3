#include "app/flow_output.hpp"

#include "app/figure_levels.hpp"
#include "app/reference_flows.hpp"
#include "blood/guided_flow.hpp"
#include "cells/cell_state.hpp"
#include "common/extremes.hpp"
#include "core/error.hpp"
#include "core/units.hpp"
#include "coupling/restart.hpp"
#include "fluid/flow_balances.hpp"
#include "membrane/shape_measures.hpp"
#include "output/owned_values.hpp"

#include <fmt/format.h>

#include <cmath>

namespace corpuscle {

namespace {

/// Further columns of cells that move in a flow, before those of their shapes.
const std::vector<std::string> parachute_columns = {"rear_hollow_um", "front_dimple_um", "length_um", "diameter_um",
                                                "asymmetry"};
/// Further columns of rigid bodies: the force from the fluid's momentum balance, beside that from tractions.
const std::vector<std::string> balance_columns = {"balance_force_x_nN", "balance_force_y_nN", "balance_force_z_nN"};

#ifdef CORPUSCLE_HDF5
std::vector<std::int32_t> to_int32(const Table<int>& table) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), table);
  return {host.data(), host.data() + host.span()};
}
#endif

#ifdef CORPUSCLE_HDF5
SurfaceShare share_of(const SharedCells& cells) {
  return {static_cast<hsize_t>(cells.total_vertices()), static_cast<hsize_t>(cells.total_triangles()),
          static_cast<hsize_t>(cells.total()), vertex_rows(cells), triangle_rows(cells), cell_rows(cells)};
}

/// Vertices are numbered over all ranks' cells.
std::unique_ptr<CellWriter> make_shared_writer(const std::string& folder, const Comm& comm, const SharedCells& cells,
                                               std::optional<double> restart_us) {
  const auto triangle = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().triangle);
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

/// Share of the surfaces' vertices whose last traction did not come from a full fit.
/// @param fits  how many came about in which way, by TractionFallback
double poor_share(const std::vector<long>& fits) {
  long all = 0, poor = 0;
  for (int how = traction_fitted; how <= traction_nothing; ++how) all += fits[how];
  for (int how : {traction_gradient, traction_normal, traction_nothing, pressure_average, pressure_nothing}) poor += fits[how];
  return all > 0 ? static_cast<double>(poor) / static_cast<double>(all) : 0;
}

}  // namespace

FlowOutput::FlowOutput(const Place& place, Case scene, FlowSimulation& simulation, Timers& timers,
                       std::optional<double> restart_us, std::chrono::steady_clock::time_point start)
    : folder_(place.folder), run_(place.run), files_(place.files), scene_(std::move(scene)), simulation_(simulation),
      timers_(timers), restart_us_(restart_us), start_(start), energy_(simulation) {
  const Comm& comm = simulation.grid().comm();
  HistoryColumns columns;
  columns.cells = simulation.cells() > 0;
  columns.bodies = simulation.rigid_bodies() != nullptr;
  if (columns.cells) columns.more = find_columns();
  if (columns.bodies) columns.more.insert(columns.more.end(), balance_columns.begin(), balance_columns.end());
  if (simulation.coupling()) history_ = std::make_unique<HistoryWriter>(folder_, comm, columns, restart_us);
  if (scene_.blood) {
    blood_ = std::make_unique<BloodSampler>(scene_, simulation);
    blood_files_ = std::make_unique<BloodFiles>(folder_, comm, restart_us);
  }
#ifdef CORPUSCLE_HDF5
  if (scene_.output.fields)
    fields_ = std::make_unique<FieldWriter>(folder_, comm, simulation.grid().index(),
                                            simulation.grid().owned_nodes().data(), restart_us);
  few_cells_ = simulation.cells() <= scene_.output.cells_in_history || !simulation.shared_cells();
  if (!few_cells_) std::vector<CellSettings>().swap(scene_.cells);  // nothing on a rank grows with the number of all cells
  // A file a sample, so not in every step.
  if (!few_cells_ && scene_.output.history_every_us > 0)
    series_ = std::make_unique<CellSeries>(folder_, comm, simulation.cells(), cell_rows(*simulation.shared_cells()), restart_us);
  if (scene_.output.cells && simulation.shared_cells()) {
    cells_ = make_shared_writer(folder_, comm, *simulation.shared_cells(), restart_us);
  } else if (scene_.output.cells && simulation.surfaces()) {
    const auto& set = *simulation.surfaces();
    const auto body = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.triangle_body);
    const std::vector<std::int32_t> bodies(body.data(), body.data() + set.triangles);
    cells_ = std::make_unique<CellWriter>(folder_, comm, to_int32(set.triangle), bodies, set.vertices, restart_us);
  }
#endif
}

/// Of the history, of cells; what measures them is made for it.
const std::vector<std::string>& FlowOutput::find_columns() {
  const auto flow = find_guided_flow(scene_, simulation_.fluid());
  shapes_ = std::make_unique<CellShapes>(simulation_.membranes()->types(), flow ? &flow->frame : nullptr);
  shape_columns_ = parachute_columns;
  shape_columns_.insert(shape_columns_.end(), shapes_->columns().begin(), shapes_->columns().end());
  return shape_columns_;
}

const std::vector<std::vector<double>>& FlowOutput::measure_shapes() {
  const Membranes& membranes = *simulation_.membranes();
  return shapes_->measure(membranes.surfaces(), membranes.cells(), membranes.views().type);
}

/// Whether this step is the last, or the first at or after a multiple of `every_us`.
bool FlowOutput::due(double every_us) const {
  if (simulation_.done() || simulation_.at_outflow()) return true;
  if (every_us <= 0) return false;
  const double step = simulation_.last_step_us(), now = simulation_.time();
  return std::floor(now / every_us + 1e-9) > std::floor((now - step) / every_us + 1e-9);
}

/// Figures that cost a share of a step are taken, whatever the run stores, at the first steps, where most flows change fastest,
/// at every eighth, and at the last: that one counts for this run's report alone, since a run that goes on from here would not
/// have it.
void FlowOutput::sample_flow() {
  constexpr long first = 8, every = 8;
  const long step = simulation_.steps();
  const bool regular = step <= first || step % every == 0;
  if (!regular && !simulation_.done() && !simulation_.at_outflow()) return;
  const FlowSample sample{simulation_.time(), simulation_.fluid().splitting(),
                          simulation_.immersed() ? simulation_.immersed()->slip()[1] : 0.0};
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
  if (start || output.history_every_us <= 0 || due(output.history_every_us)) {
    if (history_) write_history();
    energy_.sample(elastic_energy_);
  }
  if (!start) sample_flow();
  if (!start) sample_blood();
  if (start || due(output.every_us)) {
    write_fields();
    write_cells();
  }
  if (!start && due(output.checkpoint_every_us)) write_checkpoint_now();
}

void FlowOutput::watch_cells(const std::vector<CellDiagnostics>& cells) {
  const Membranes& membranes = *simulation_.membranes();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    totals_.volume_drift = larger(totals_.volume_drift, std::abs(cells[c].volume_um3 / cells[c].rest_volume_um3 - 1));
    const int cell = static_cast<int>(c);
    // A capsule's sheet may grow; a red cell's bilayer may not, and what holds it says so.
    if (!std::holds_alternative<WlcPow>(membranes.law(cell)) && !membranes.holds_area(cell)) continue;
    totals_.area_drift = larger(totals_.area_drift, std::abs(cells[c].area_um2 / cells[c].rest_area_um2 - 1));
  }
  if (!simulation_.shared_cells()) return;
  double drifts[2] = {totals_.volume_drift, totals_.area_drift};
  simulation_.grid().comm().max(drifts, 2);
  totals_.volume_drift = drifts[0], totals_.area_drift = drifts[1];
}

/// z for those that were packed.
Triple FlowOutput::axis_at_start(int number) const {
  return number < static_cast<int>(scene_.cells.size()) ? scene_.cells[number].axis : Triple{0, 0, 1};
}

/// @param travelled  by how much the cell has been moved back through periodic sides, um
/// @param turned     what CellShapes has found
HistorySample FlowOutput::cell_sample(int cell, const CellDiagnostics& d, const Triple& travelled,
                                      const std::vector<double>& turned) const {
  HistorySample sample;
  sample.time_us = simulation_.time();
  sample.cell = simulation_.membranes()->number(cell);
  sample.centroid_um = {d.centroid_um[0] + travelled[0], d.centroid_um[1] + travelled[1], d.centroid_um[2] + travelled[2]};
  sample.velocity_um_per_us = d.velocity_um_per_us;
  sample.extent_um = d.extent_um();
  sample.area_um2 = d.area_um2;
  sample.volume_um3 = d.volume_um3;
  sample.elastic_energy_fJ = d.energy_fJ();
  if (!few_cells_) return sample;
  const auto& v = d.velocity_um_per_us;
  const bool moving = std::hypot(v[0], v[1], v[2]) > 1e-9;
  const auto shape = parachute_measures(body_mesh(*simulation_.surfaces(), cell), d.centroid_um,
                                        moving ? v : axis_at_start(sample.cell));
  sample.more = {shape.rear_hollow_um, shape.front_dimple_um, shape.length_um, shape.diameter_um, shape.asymmetry};
  sample.more.insert(sample.more.end(), turned.begin(), turned.end());
  return sample;
}

void FlowOutput::write_history() {
  measure();
  for (const auto& sample : last_) history_->write(sample);
#ifdef CORPUSCLE_HDF5
  if (!series_) return;
  const CellFigures figures = cell_figures();
  series_->write(simulation_.time(), simulation_.steps(), cell_rows(*simulation_.shared_cells()), figures.tables());
#endif
}

void FlowOutput::measure() {
  last_.clear();
  if (auto* membranes = simulation_.membranes()) {
    const auto cells = membranes->diagnostics();
    watch_cells(cells);
    elastic_energy_ = 0;
    for (const auto& cell : cells) elastic_energy_ += cell.energy_fJ();
    const auto travelled = simulation_.coupling()->wrapped_by();
    static const std::vector<std::vector<double>> none;
    const auto& turned = few_cells_ ? measure_shapes() : none;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      auto sample = cell_sample(static_cast<int>(c), cells[c], travelled[c], few_cells_ ? turned[c] : std::vector<double>());
      if (simulation_.rigid_bodies()) sample.more.resize(shape_columns_.size() + balance_columns.size(), std::nan(""));
      last_.push_back(sample);
    }
    if (simulation_.shared_cells()) gather_samples();
  }
  if (simulation_.rigid_bodies()) measure_bodies();
}

/// Every rank's samples to all, if cells are few, and else their mean.
void FlowOutput::gather_samples() {
  const Comm& comm = simulation_.grid().comm();
  elastic_energy_ = comm.sum(elastic_energy_);
  constexpr std::size_t width = 12;
  const std::size_t more = few_cells_ ? shape_columns_.size() : 0, rows = few_cells_ ? simulation_.cells() : 1;
  std::vector<double> table(rows * (width + more), 0.0);
  for (const auto& sample : last_) {
    double* row = table.data() + (few_cells_ ? sample.cell * (width + more) : 0);
    for (int d = 0; d < 3; ++d) {
      row[d] += (*sample.centroid_um)[d];
      row[3 + d] += (*sample.velocity_um_per_us)[d];
      row[6 + d] += (*sample.extent_um)[d];
    }
    row[9] += *sample.area_um2, row[10] += *sample.volume_um3, row[11] += *sample.elastic_energy_fJ;
    for (std::size_t n = 0; n < more; ++n) row[width + n] += sample.more[n];
  }
  comm.sum(table.data(), static_cast<int>(table.size()));
  last_.clear();
  for (std::size_t n = 0; n < rows; ++n) {
    double* row = table.data() + n * (width + more);
    if (!few_cells_)
      for (std::size_t k = 0; k < width; ++k) row[k] /= simulation_.cells();
    HistorySample sample;
    sample.time_us = simulation_.time();
    sample.cell = few_cells_ ? static_cast<int>(n) : -1;
    sample.centroid_um = {row[0], row[1], row[2]};
    sample.velocity_um_per_us = {row[3], row[4], row[5]};
    sample.extent_um = {row[6], row[7], row[8]};
    sample.area_um2 = row[9], sample.volume_um3 = row[10], sample.elastic_energy_fJ = row[11];
    sample.more.assign(row + width, row + width + more);
    last_.push_back(sample);
  }
}

void FlowOutput::measure_bodies() {
  const auto* bodies = simulation_.rigid_bodies();
  auto& immersed = *simulation_.immersed();
  simulation_.coupling()->tractions_for_output();
  std::vector<Triple> centre(simulation_.surfaces()->bodies);
  for (int b = 0; b < bodies->count(); ++b) centre[simulation_.cells() + b] = bodies->centre(b);
  const auto loads = immersed.loads(centre);
  const auto balance_force = immersed.balance_forces();
  for (int b = 0; b < bodies->count(); ++b) {
    const int number = simulation_.cells() + b;
    HistorySample sample;
    sample.time_us = simulation_.time();
    sample.cell = number;
    sample.centroid_um = bodies->centre(b);
    sample.velocity_um_per_us = bodies->velocity(b);
    sample.force_nN = loads[number][0];
    sample.torque_nN_um = loads[number][1];
    if (simulation_.membranes()) sample.more.assign(shape_columns_.size(), std::nan(""));
    for (double f : balance_force[number]) sample.more.push_back(f);
    last_.push_back(sample);
  }
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
    for (auto value : box_integers(index, owned, simulation_.fluid().kind()))
      kind.push_back(static_cast<std::int8_t>(value));
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
  if (simulation_.shared_cells()) return write_shared_cells();
  const auto& set = *simulation_.surfaces();
  const auto x = vertex_values(set.vertices, set.x), v = vertex_values(set.vertices, set.v);
  const auto traction = vertex_values(set.vertices, simulation_.coupling()->tractions_for_output());
  cells_->write(simulation_.time(), simulation_.steps(), x.data(),
                {{"velocity_um_per_us", 3, v.data()}, {"traction_kPa", 3, traction.data()}});
#endif
}

#ifdef CORPUSCLE_HDF5
/// Of each of this rank's cells what the history has of few.
CellFigures FlowOutput::cell_figures() {
  const auto travelled = simulation_.coupling()->wrapped_by();
  const auto cells = simulation_.membranes()->diagnostics();
  const auto& names = shapes_->columns();
  CellFigures figures({{"centroid_um", 3},
                       {"velocity_um_per_us", 3},
                       {"extent_um", 3},
                       {"area_um2", 1},
                       {"volume_um3", 1},
                       {"elastic_energy_fJ", 1}});
  for (const auto& shape : names) figures.add({shape, 1});
  const auto& shapes = measure_shapes();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Triple size = cells[c].extent_um();
    for (int d = 0; d < 3; ++d) {
      figures.values[0].push_back(cells[c].centroid_um[d] + travelled[c][d]);
      figures.values[1].push_back(cells[c].velocity_um_per_us[d]);
      figures.values[2].push_back(size[d]);
    }
    figures.values[3].push_back(cells[c].area_um2);
    figures.values[4].push_back(cells[c].volume_um3);
    figures.values[5].push_back(cells[c].energy_fJ());
    for (std::size_t n = 0; n < names.size(); ++n) figures.values[6 + n].push_back(shapes[c][n]);
  }
  return figures;
}
#endif

/// This rank's own, with their figures.
void FlowOutput::write_shared_cells() {
#ifdef CORPUSCLE_HDF5
  const SharedCells& shared = *simulation_.shared_cells();
  const auto& set = shared.surfaces();
  const auto x = vertex_values(set.own_vertices, set.x), v = vertex_values(set.own_vertices, set.v);
  const auto traction = vertex_values(set.own_vertices, simulation_.coupling()->tractions_for_output());
  const CellFigures figures = cell_figures();
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
  if (history_) measure();
}

void FlowOutput::started_from(const std::string& checkpoint, const RunTotals& totals) {
  last_checkpoint_ = checkpoint;
  totals_ = totals;
  energy_.resume(totals.energy);
  if (simulation_.immersed()) simulation_.immersed()->resume(totals.immersed);
  if (simulation_.coupling()) simulation_.coupling()->resume_contact(totals.contact);
  if (blood_) blood_->resume(totals.blood);
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

void FlowOutput::fill_energy(Report& report) const {
  if (const auto whole = energy_.imbalance()) report.errors["energy_balance"] = *whole;
  const auto& t = energy_.totals();
  auto& terms = report.extra["energy_fJ"];
  terms = {{"boundaries", t.boundaries}, {"pressure_gradient", t.gradient}, {"dissipation", t.dissipation},
           {"kinetic", t.kinetic}};
  if (simulation_.rigid_bodies()) terms["on_bodies"] = t.on_bodies;
  if (!simulation_.membranes()) return;
  if (const auto own = energy_.coupling_imbalance()) report.errors["energy_balance_coupling"] = *own;
  terms["on_cells"] = t.on_cells;
  terms["elastic"] = t.elastic;
  if (t.pushed != 0) terms["pushed"] = t.pushed;
  if (scene_.contact) terms["contact"] = t.contact;
  terms["membrane_dissipation"] = t.membrane_dissipation;
  terms["membrane_kinetic"] = t.membrane_kinetic;
}

void FlowOutput::fill_quantities(Report& report) const {
  auto& all = report.quantities;
  const char* axes[] = {"x", "y", "z"};
  for (const auto& sample : last_) {
    if (sample.cell < 0) continue;
    const bool cell = sample.cell < simulation_.cells();
    const std::string of = fmt::format("{}_{}_", cell ? "cell" : "body", sample.cell);
    if (cell) {
      const auto& v = *sample.velocity_um_per_us;
      all[of + "speed_mm_per_s"] = std::hypot(v[0], v[1], v[2]) / units::mm_per_s;
      all[of + "area_um2"] = *sample.area_um2;
      all[of + "elastic_energy_fJ"] = *sample.elastic_energy_fJ;
      for (std::size_t n = 0; n < shape_columns_.size(); ++n) all[of + shape_columns_[n]] = sample.more[n];
    }
    for (int d = 0; d < 3; ++d) {
      if (cell) all[of + "centroid_" + axes[d] + "_um"] = (*sample.centroid_um)[d];
      // The momentum balance converges faster: 0.4 to 1.4 % off where the sum of tractions is 4 to 22 % low.
      if (!cell) all[of + "force_" + axes[d] + "_nN"] = sample.more[sample.more.size() - 3 + d];
      if (!cell) all[of + "traction_force_" + axes[d] + "_nN"] = (*sample.force_nN)[d];
      if (!cell) all[of + "torque_" + axes[d] + "_nN_um"] = (*sample.torque_nN_um)[d];
    }
  }
  const Triple mean = mean_velocity(simulation_.fluid());
  all["superficial_speed_mm_per_s"] = std::hypot(mean[0], mean[1], mean[2]) / units::mm_per_s;
  if (energy_.driving_pressure_kPa() > 0) all["driving_pressure_Pa"] = 1e3 * energy_.driving_pressure_kPa();
}

void FlowOutput::fill_totals(Report& report, RunTotals now) const {
  if (end_sample_) now.add(*end_sample_);
  auto& errors = report.errors;
  errors["max_divergence"] = now.divergence;
  errors["flux_correction"] = now.flux_correction;
  errors["splitting"] = now.splitting_until_us > 0 ? now.splitting_us / now.splitting_until_us : 0.0;
  errors["splitting_max"] = now.splitting_max;
  if (simulation_.immersed()) {
    // Of the flow's own speed, prescribed or computed: the solvers' reference may be that of a membrane's return to its shape.
    errors["slip"] = now.slip_speed / std::max({simulation_.fluid().boundaries().largest_speed(), now.speed, speed_at_rest});
    const auto& search = now.immersed;
    report.extra["immersed"] = {{"classifications", search.classifications},
                                {"immersed_nodes", search.immersed},
                                {"inside_nodes", search.inside},
                                {"isolated_nodes", search.isolated},
                                {"uncovered_nodes", search.uncovered},
                                {"velocity_fallbacks", search.velocity_fallbacks},
                                {"least_wall_spacings", search.least_wall_spacings}};
    if (search.least_wall_spacings < 1e30) errors["least_wall_spacings"] = search.least_wall_spacings;
    if (search.least_body_spacings < 1e30)
      errors["least_body_spacings"] = report.extra["immersed"]["least_body_spacings"] = search.least_body_spacings;
  }
  if (simulation_.coupling() && simulation_.coupling()->contact_report()) {
    errors["crossings"] = now.contact.crossings;
    report.extra["contact"] = {{"crossings", now.contact.crossings}, {"limited_approaches", now.contact.limited}, {"lists", now.contact.lists}};
    for (const auto& [name, gap] : {std::pair{"smallest_gap_um", now.contact.smallest()},
                                    {"smallest_gap_between_cells_um", now.contact.smallest_gap},
                                    {"smallest_gap_within_cells_um", now.contact.smallest_own_gap},
                                    {"smallest_gap_to_walls_um", now.contact.smallest_wall_gap}})
      report.extra["contact"][name] = gap < 1e30 ? nlohmann::json(gap) : nlohmann::json();
  }
  if (simulation_.membranes()) {
    errors["volume_drift"] = now.volume_drift;
    errors["area_drift"] = now.area_drift;
    if (simulation_.immersed()) {
      errors["coupling_residual"] = now.residual.samples ? now.residual.sum / static_cast<double>(now.residual.samples) : 0.0;
      errors["coupling_residual_max"] = now.residual.largest;
    }
    report.extra["stability"] = simulation_.coupling()->report(simulation_.last_step_us());
  }
  fill_energy(report);
  report.momentum_iterations = now.momentum;
  report.pressure_iterations = now.pressure;
  report.projections = now.projections;
  report.coupling_iterations = now.coupling;
  report.membrane_substeps = now.substeps;
  report.extra["cells"] = {simulation_.grid().index().global[0], simulation_.grid().index().global[1],
                           simulation_.grid().index().global[2]};
  report.wall_s = now.wall_s;
  report.wall_s_this_run = now.wall_s - totals_.wall_s;
  report.wall_s_by_part = now.wall_s_by_part;
  report.steps = simulation_.steps();
  report.simulated_us = simulation_.time();
}

void FlowOutput::judge_figures(Report& report) const {
  report.warnings = judge(report.errors, {simulation_.fluid().statistics().reference_speed, energy_.largest_fJ(),
                                          scene_.fluid->convection == FluidSettings::Convection::none});
}

void FlowOutput::fill_broken(Report& report, bool together) {
  fill_totals(report, totals_now(together));
  judge_figures(report);
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

void FlowOutput::fill(Report& report) {
  const RunTotals totals = totals_now();
  fill_totals(report, totals);
  fill_blood(report, totals.contact);
  if (blood_) blood_files_->write_profile(*blood_, simulation_.time());
  auto& errors = report.errors;
  errors["convection_over_viscosity"] = convection_over_viscosity(simulation_.fluid());
  if (simulation_.immersed()) {
    const auto fits = simulation_.immersed()->traction_fits();
    report.extra["immersed"]["traction_fits"] = fits;
    errors["traction_fallbacks"] = poor_share(fits);
  }
  judge_figures(report);
  fill_quantities(report);
  for (const auto& [name, value] : reference_errors(scene_, simulation_)) errors[name] = value;
  Triple mean = mean_velocity(simulation_.fluid());
  for (double& component : mean) component /= units::mm_per_s;
  report.extra["superficial_velocity_mm_per_s"] = mean;
}

}  // namespace corpuscle
