#include "coupling/restart.hpp"

#ifdef CORPUSCLE_HDF5

#include "cells/cell_state.hpp"
#include "core/error.hpp"
#include "output/checkpoint.hpp"
#include "output/owned_values.hpp"
#include "populations/populations.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace corpuscle {

namespace {

Shape cell_shape(const IndexSpace& index, int components) {
  Shape s{hsize_t(index.global[2]), hsize_t(index.global[1]), hsize_t(index.global[0])};
  if (components > 1) s.push_back(components);
  return s;
}

Slab cell_slab(const IndexSpace& index, int components) {
  Slab s{{hsize_t(index.first[2]), hsize_t(index.first[1]), hsize_t(index.first[0])},
         {hsize_t(index.n[2]), hsize_t(index.n[1]), hsize_t(index.n[0])}};
  if (components > 1) s.offset.push_back(0), s.count.push_back(components);
  return s;
}

/// Face fluxes are stored with one face more than cells along their direction; the extra one belongs to the last rank.
Shape face_shape(const IndexSpace& index, int d) {
  Shape s = cell_shape(index, 1);
  s[2 - d] += 1;
  return s;
}

Slab face_slab(const IndexSpace& index, int d) {
  Slab s = cell_slab(index, 1);
  if (index.first[d] + index.n[d] == index.global[d]) s.count[2 - d] += 1;
  return s;
}

CellBox face_range(const IndexSpace& index, int d) {
  CellBox box{{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
  if (index.first[d] + index.n[d] == index.global[d]) box.upper[d] += 1;
  return box;
}

CellBox owned_box(const IndexSpace& index) { return {{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}}; }

/// The stored state fits no other geometry.
std::vector<CaseChange> allowed_changes(const std::string& path, const CheckpointHeader& before, const std::string& resolved,
                                        const std::string& files) {
  std::vector<CaseChange> allowed;
  std::string refused;
  auto changes = case_changes(before.resolved, resolved);
  for (const auto& change : file_changes(before.files, files)) changes.push_back(change);
  for (const auto& change : changes) {
    if (!change.geometry)
      allowed.push_back(change);
    else
      refused += fmt::format("{}{} = {} (in the checkpoint: {})", refused.empty() ? "" : "; ", change.key, change.now, change.before);
  }
  if (!refused.empty())
    throw InputError(
        fmt::format("{}: this checkpoint is of another scene: {}. A restart may change properties and speeds, not "
                    "the geometry: restore these keys, or run the case from its start",
                    path, refused));
  return allowed;
}

const char* flux_name(int d) { return std::array<const char*, 3>{"flux_i", "flux_j", "flux_k"}[d]; }
const char* old_flux_name(int d) { return std::array<const char*, 3>{"flux_old_i", "flux_old_j", "flux_old_k"}[d]; }

}  // namespace

namespace {

const char* const packed_name = "packed_cells";      // [cell, centre, axis, spin]
const char* const populations_name = "populations";  // [population] cells
const char* const size_name = "packed_size";
constexpr hsize_t packed_columns = 7;

/// Where populations were packed, so that a restart need not pack them again.
void write_packed(CheckpointWriter& file, const PackedShare& share) {
  std::vector<double> rows;
  for (const CellPlace& cell : share.cells) {
    rows.insert(rows.end(), cell.center_um.begin(), cell.center_um.end());
    rows.insert(rows.end(), cell.axis.begin(), cell.axis.end());
    rows.push_back(cell.spin_deg);
  }
  Rows mine;
  mine.add(share.first, share.cells.size());
  file.add(packed_name, {static_cast<hsize_t>(share.total), packed_columns}, mine, rows.data());
  const std::vector<std::int64_t> count(share.count.begin(), share.count.end());
  file.add(populations_name, {count.size()}, count.data());
  file.add(size_name, {1}, &share.size);
}

}  // namespace

PackedCells read_packed_cells(const std::string& path, const Comm& comm, const Case& scene, const std::string& files) {
  const CheckpointReader file(path, comm);
  allowed_changes(path, file.header(), scene.resolved, files);
  PackedCells packed;
  std::vector<std::int64_t> count(scene.populations.size());
  file.read(populations_name, {count.size()}, count.data());
  hsize_t total = 0;
  for (const std::int64_t cells : count) packed.count.push_back(static_cast<int>(cells)), total += cells;
  std::vector<double> rows(packed_columns * total);
  file.read(packed_name, {total, packed_columns}, rows.data());
  file.read(size_name, {1}, &packed.size);
  for (hsize_t c = 0; c < total; ++c) {
    const double* row = rows.data() + packed_columns * c;
    CellPlace cell;
    for (int d = 0; d < 3; ++d) cell.center_um[d] = row[d], cell.axis[d] = row[3 + d];
    cell.spin_deg = row[6];
    packed.cells.push_back(cell);
  }
  return packed;
}

void write_checkpoint(const std::string& path, FlowSimulation& simulation, const CheckpointTexts& texts) {
  const IndexSpace& index = simulation.grid().index();
  const auto progress = simulation.progress();
  CheckpointHeader header;
  header.resolved = texts.resolved;
  header.files = texts.files;
  header.run = texts.run;
  header.cells = {index.global[0], index.global[1], index.global[2]};
  header.step = progress.steps;
  header.time_us = progress.time;
  CheckpointWriter file(path, simulation.grid().comm(), header);
  const auto state = simulation.fluid().state();
  const CellBox owned = owned_box(index);
  const auto vector = [&](const char* name, const Components<double>& field) {
    file.add(name, cell_shape(index, 3), cell_slab(index, 3), interleaved(index, owned, field).data());
  };
  vector("velocity", state.u);
  vector("velocity_old", state.u_old);
  file.add("pressure", cell_shape(index, 1), cell_slab(index, 1), box_values(index, owned, state.p).data());
  for (int d = 0; d < 3; ++d) {
    const CellBox faces = face_range(index, d);
    file.add(flux_name(d), face_shape(index, d), face_slab(index, d), box_values(index, faces, state.flux[d]).data());
    if (state.flux_old[d].data())
      file.add(old_flux_name(d), face_shape(index, d), face_slab(index, d), box_values(index, faces, state.flux_old[d]).data());
  }
  const double numbers[2] = {state.reference_speed, progress.last_step};
  file.add("numbers", {2}, numbers);
  const std::int64_t levels = state.history_levels;
  file.add("history_levels", {1}, &levels);
  if (simulation.coupling()) {
    const auto coupling = simulation.coupling()->state();
    if (!coupling.empty()) file.add("coupling", {coupling.size()}, coupling.data());
  }
  if (simulation.coupling() && simulation.coupling()->packed()) write_packed(file, *simulation.coupling()->packed());
  if (simulation.shared_cells()) {
    write_cells(file, simulation.grid().comm(), *simulation.shared_cells());
  } else if (simulation.membranes()) {
    const auto membranes = simulation.membranes()->state();
    file.add("membranes", {membranes.size()}, membranes.data());
  }
  if (simulation.immersed()) {
    const auto positions = simulation.immersed()->classified_positions();
    file.add("classified_positions", {positions.size() / 3, 3}, positions.data());
  }
  if (simulation.immersed() && simulation.immersed()->boundary().periodic()) {
    const auto laps = simulation.immersed()->boundary().laps_state();
    file.add("laps", {laps.size()}, laps.data());
  }
  file.add_text("totals", texts.totals);
  file.commit();
}

namespace {

FluidState read_fluid(const CheckpointReader& file, FlowSimulation& simulation) {
  const IndexSpace& index = simulation.grid().index();
  auto state = simulation.fluid().state().copy();
  const CellBox owned = owned_box(index);
  const auto vector = [&](const char* name, const Components<double>& field) {
    std::vector<double> values(3 * owned.size());
    file.read(name, cell_shape(index, 3), cell_slab(index, 3), values.data());
    set_interleaved(index, owned, values, field);
  };
  vector("velocity", state.u);
  vector("velocity_old", state.u_old);
  std::vector<double> values(owned.size());
  file.read("pressure", cell_shape(index, 1), cell_slab(index, 1), values.data());
  set_box_values(index, owned, values, state.p);
  for (int d = 0; d < 3; ++d) {
    // Each rank also reads the faces on its upper side, which another rank wrote.
    CellBox faces = owned;
    faces.upper[d] += 1;
    Slab slab = cell_slab(index, 1);
    slab.count[2 - d] += 1;
    std::vector<double> flux(faces.size());
    file.read(flux_name(d), face_shape(index, d), slab, flux.data());
    set_box_values(index, faces, flux, state.flux[d]);
    if (state.flux_old[d].data() && file.has(old_flux_name(d))) {
      file.read(old_flux_name(d), face_shape(index, d), slab, flux.data());
      set_box_values(index, faces, flux, state.flux_old[d]);
    } else if (state.flux_old[d].data()) {  // written without convection: as if the flow had been the same a step before
      Kokkos::deep_copy(state.flux_old[d], state.flux[d]);
    }
  }
  return state;
}

/// Nodes are classified as they were in the last step, and then the surfaces put where that step left them.
void read_surfaces(const CheckpointReader& file, FlowSimulation& simulation) {
  const SurfaceSet& surfaces = simulation.immersed()->surfaces();
  std::vector<double> positions(3 * static_cast<std::size_t>(surfaces.vertices));
  file.read("classified_positions", {positions.size() / 3, 3}, positions.data());
  simulation.immersed()->resume(positions);
  if (!simulation.immersed()->boundary().periodic()) return;
  auto laps = simulation.immersed()->boundary().laps_state();
  file.read("laps", {laps.size()}, laps.data());
  simulation.immersed()->boundary().set_laps_state(laps);
}

void read_coupling(const CheckpointReader& file, FlowSimulation& simulation, bool cells_changed) {
  if (simulation.immersed()) read_surfaces(file, simulation);
  // Another scheme than that of the checkpoint starts without a history of its own.
  auto coupling = simulation.coupling()->state();
  if (!coupling.empty() && file.has("coupling") && file.shape("coupling") == Shape{coupling.size()}) {
    file.read("coupling", {coupling.size()}, coupling.data());
    simulation.coupling()->set_state(coupling);
  }
  if (simulation.shared_cells()) {
    read_cells(file, simulation.grid().comm(), *simulation.shared_cells());
    simulation.coupling()->cells_restored(file.header().time_us);
  } else if (simulation.membranes()) {
    std::vector<double> membranes(simulation.membranes()->state().size());
    file.read("membranes", {membranes.size()}, membranes.data());
    simulation.membranes()->set_state(membranes);
    if (cells_changed) simulation.membranes()->forget_stiffness();
  }
}

}  // namespace

Restored read_checkpoint(const std::string& path, FlowSimulation& simulation, const std::string& resolved, const std::string& files) {
  const IndexSpace& index = simulation.grid().index();
  const CheckpointReader file(path, simulation.grid().comm());
  Restored restored;
  restored.changes = allowed_changes(path, file.header(), resolved, files);
  file.require_grid({index.global[0], index.global[1], index.global[2]});
  double numbers[2];
  std::int64_t levels = 0;
  file.read("numbers", {2}, numbers);
  file.read("history_levels", {1}, &levels);
  const bool cells_changed = std::any_of(restored.changes.begin(), restored.changes.end(),
                                         [](const CaseChange& change) { return change.key.rfind("cell", 0) == 0; });
  if (simulation.coupling()) read_coupling(file, simulation, cells_changed);
  try {
    simulation.resume({file.header().time_us, numbers[1], file.header().step});
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
  auto state = read_fluid(file, simulation);
  state.reference_speed = numbers[0];
  state.time_us = file.header().time_us;
  state.step_us = numbers[1];
  state.history_levels = static_cast<int>(levels);
  simulation.fluid().restore(state);
  if (simulation.coupling() && file.header().step > 0) simulation.coupling()->resume(file.header().time_us);
  restored.totals = file.text("totals");
  return restored;
}

}  // namespace corpuscle

#endif
