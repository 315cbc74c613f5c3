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

Images images_of(const PeriodImages& periods) {
  Images images;
  images.count = periods.count;
  for (int m = 0; m < periods.count; ++m) images.shift[m] = periods.shift[m];
  return images;
}

}  // namespace

bool CellLoads::wanted(const Case& scene) {
  return scene.contact || std::any_of(scene.cells.begin(), scene.cells.end(), pushed);
}

CellLoads::CellLoads(const Case& scene, const Comm& comm, const Membranes& membranes, const Transfer& transfer,
                     double viscosity)
    : comm_(comm), membranes_(membranes), transfer_(transfer) {
  const int vertices = membranes.vertices();
  force_ = Components<double>("corpuscle::coupling::load", vertices, 3);
  if (scene.contact) {
    const double blend = scene.coupling->slip ? slip_reach * comm.max(transfer.largest_spacing()) : 0;
    contact_ =
        std::make_unique<Contact>(*scene.contact, membranes.surfaces(), images_of(transfer.images()), viscosity, blend);
    walls_ = walls_of(scene);
  }
  if (walls_.any()) {
    wall_ = Components<double>("corpuscle::contact::wall_load", vertices, 4);
    if (comm.size() > 1) wall_host_ = HostCopy(wall_);
  }
  if (std::none_of(scene.cells.begin(), scene.cells.end(), pushed)) return;
  share_ = Table<double>("corpuscle::coupling::push_share", membranes.cells(), 3);
  const auto share = Kokkos::create_mirror_view(share_);
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), membranes.surfaces().first_vertex);
  for (int c = 0; c < membranes.cells(); ++c)
    for (int d = 0; d < 3; ++d) share(c, d) = scene.cells[c].push_nN[d] / (first(c + 1) - first(c));
  Kokkos::deep_copy(share_, share);
}

void CellLoads::look_at_start(double dt) {
  if (contact_) contact_->look_at_start(dt);
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

/// Each rank knows the walls of its own block; the others' parts are zero.
void CellLoads::add_walls(double dt) {
  wall_forces(transfer_.block().lattice, transfer_.views(), walls_, contact_->law(dt), contact_->rest_area(), wall_);
  if (comm_.size() > 1) {
    comm_.sum(wall_host_.read().data(), static_cast<int>(wall_.span()));
    wall_host_.write();
  }
  wall_energy_ = add_first_three(membranes_.vertices(), wall_, force_);
}

double CellLoads::power_of_pushes() const {
  if (share_.extent(0) == 0) return 0;
  const auto& set = membranes_.surfaces();
  return corpuscle::power_of_pushes(membranes_.vertices(), set.vertex_body, share_, set.v);
}

double CellLoads::contact_energy(double dt) const { return contact_ ? contact_->energy(dt) + wall_energy_ : 0; }

std::optional<ContactReport> CellLoads::report() const {
  if (!contact_) return std::nullopt;
  return contact_->report();
}

void CellLoads::resume(const ContactReport& report) {
  if (contact_) contact_->resume(report);
}

}  // namespace corpuscle
