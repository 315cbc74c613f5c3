#include "coupling/cell_loads.hpp"

#include <algorithm>

#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

bool pushed(const CellSettings& cell) { return cell.push_nN != Triple{}; }

WallSides walls_of(const Case& scene) {
  WallSides walls;
  for (const auto& boundary : scene.boundaries) {
    const int side = static_cast<int>(boundary.side);
    walls.wall[side / 2][side % 2] =
        boundary.type == BoundarySettings::Type::wall || boundary.type == BoundarySettings::Type::moving_wall;
  }
  return walls;
}

}  // namespace

bool CellLoads::wanted(const Case& scene) {
  return scene.contact || std::any_of(scene.cells.begin(), scene.cells.end(), pushed);
}

CellLoads::CellLoads(const Case& scene, SharedCells& cells, const Transfer& transfer, double viscosity,
                     std::shared_ptr<Workspace> workspace)
    : cells_(cells), membranes_(cells.membranes()), comm_(cells.comm()), transfer_(transfer), workspace_(std::move(workspace)) {
  if (scene.contact) {
    const double blend = scene.coupling->slip ? slip_reach * comm_.max(transfer.largest_spacing()) : 0;
    const ContactPeers peers{comm_, [&cells] { cells.to_copies(cells.surfaces().x, true); }, workspace_};
    contact_ = std::make_unique<Contact>(*scene.contact, membranes_.surfaces(), Images{}, viscosity, blend, &peers);
    walls_ = walls_of(scene);
  }
  for (std::size_t c = 0; c < scene.cells.size(); ++c)
    if (pushed(scene.cells[c])) push_[static_cast<int>(c)] = scene.cells[c].push_nN;
  take_up();
}

void CellLoads::take_up() {
  const SurfaceSet& set = membranes_.surfaces();
  if (!force_.data() || force_.extent(0) < static_cast<std::size_t>(set.vertices)) {
    force_ = Components<double>();  // free before taking more
    force_ = Components<double>("corpuscle::coupling::load", set.vertices + set.vertices / 64 + 1, 3);
  }
  Kokkos::deep_copy(force_, 0.0);
  if (contact_) contact_->take_up(set, membranes_.templates(), membranes_.views().type);
  if (push_.empty()) return;
  if (const std::size_t rows = membranes_.cells() + 1; !share_.data() || share_.extent(0) < rows)
    share_ = Table<double>(uninitialised("corpuscle::coupling::push_share"), rows + rows / 16 + 1, 3);
  const auto share = Kokkos::create_mirror_view(share_);
  Kokkos::deep_copy(share, 0.0);
  for (std::size_t c = 0; c < cells_.own().size(); ++c) {
    const auto push = push_.find(cells_.own()[c].number);
    if (push == push_.end()) continue;
    const auto vertices = static_cast<double>(membranes_.types()[cells_.own()[c].type].mesh.vertices.size());
    for (int d = 0; d < 3; ++d) share(c, d) = push->second[d] / vertices;
  }
  Kokkos::deep_copy(share_, share);
}

void CellLoads::look_at_start(double dt) {
  if (!contact_) return;
  contact_->look_at_start(dt);
  note_wall_gap();
}

WallContacts CellLoads::at_walls(double reach) const {
  return {transfer_.block().lattice, transfer_.views(), walls_, membranes_.surfaces().x, reach};
}

void CellLoads::note_wall_gap() {
  if (!contact_ || !walls_.any()) return;
  const double least = least_wall_gap(at_walls(contact_->reach()));
  smallest_wall_gap_ = std::min(smallest_wall_gap_, comm_.min(least));
}

void CellLoads::look(double time, double dt) {
  if (contact_) contact_->look(time, dt);
}

void CellLoads::limit_approach(double time) {
  if (contact_) contact_->limit_approach(time);
}

void CellLoads::limit_ahead() {
  if (contact_) contact_->limit_ahead();
}

void CellLoads::gather(double dt, bool ahead) {
  start_loads(membranes_.vertices(), membranes_.views().force, membranes_.surfaces().vertex_body, share_, force_);
  if (!contact_) return;
  contact_->add_forces(dt, ahead, force_);
  if (walls_.any()) add_walls(dt);
}

/// Each rank knows the walls of its own block; its copies' parts go to their cells.
void CellLoads::add_walls(double dt) {
  const ContactLaw law = contact_->law(dt);
  const std::size_t vertices = membranes_.surfaces().vertices;
  const Components<double> of_walls(workspace_->reserve(3 * vertices), vertices, 3);
  wall_forces(at_walls(law.range), law, contact_->rest_area(), of_walls);
  cells_.add_copies(of_walls);
  add_forces(membranes_.vertices(), of_walls, force_);
}

double CellLoads::power_of_pushes() const {
  if (share_.extent(0) == 0) return 0;
  const auto& set = membranes_.surfaces();
  return comm_.sum(corpuscle::power_of_pushes(membranes_.vertices(), set.vertex_body, share_, set.v));
}

double CellLoads::contact_energy(double dt) const {
  if (!contact_) return 0;
  const double between = contact_->energy(dt);
  if (!walls_.any()) return between;
  const ContactLaw law = contact_->law(dt);
  return between + comm_.sum(wall_energy(at_walls(law.range), law, contact_->rest_area()));
}

std::optional<ContactReport> CellLoads::report() const {
  if (!contact_) return std::nullopt;
  ContactReport report = contact_->report();
  report.smallest_wall_gap = smallest_wall_gap_;
  return report;
}

void CellLoads::resume(const ContactReport& report) {
  if (!contact_) return;
  contact_->resume(report);
  smallest_wall_gap_ = report.smallest_wall_gap;
}

}  // namespace corpuscle
