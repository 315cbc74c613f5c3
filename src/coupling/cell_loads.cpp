#include "coupling/cell_loads.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "cells/rank_blocks.hpp"
#include "core/error.hpp"
#include "coupling/periodic_frame.hpp"
#include "fluid/boundary_conditions.hpp"
#include "parallel/agree.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

bool pushed(const CellSettings& cell) { return cell.push_nN != Triple{}; }

template <class View>
auto host_of(const View& view) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
}

void widen(SpaceBox& box, double by) {
  for (int d = 0; d < 3; ++d) box.lower[d] -= by, box.upper[d] += by;
}

SpaceBox box_of(const HostMirror<Components<double>>& x, int first, int last) {
  SpaceBox box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  for (int v = first; v < last; ++v)
    for (int d = 0; d < 3; ++d) {
      box.lower[d] = std::min(box.lower[d], x(v, d));
      box.upper[d] = std::max(box.upper[d], x(v, d));
    }
  return box;
}

/// How far from its middle a cell may reach: three times as far as at rest, um.
double farthest(const SurfaceSet& templates) {
  constexpr double stretched = 3;
  const auto x = host_of(templates.x);
  const auto first = host_of(templates.first_vertex);
  double most = 0;
  for (int type = 0; type < templates.bodies; ++type) {
    const SpaceBox box = box_of(x, first(type), first(type + 1));
    most = std::max(most, 0.5 * norm(box.upper - box.lower));
  }
  return stretched * most;
}

bool moves(const BodySettings& body) { return body.velocity_um_per_us != Triple{} || body.angular_velocity_rad_per_us != Triple{}; }

/// Images of rigid bodies that this rank's cells may come to meet, whose middles are within `block`. Those of bodies that move are all.
std::vector<std::pair<int, Vec3>> images_of(const Case& scene, const SurfaceSet& rigid, const Grid& grid, SpaceBox block, double reach) {
  const auto x = host_of(rigid.x);
  const auto first = host_of(rigid.first_vertex);
  widen(block, reach);
  std::vector<std::pair<int, Vec3>> images;
  for (int b = 0; b < rigid.bodies; ++b) {
    const SpaceBox here = box_of(x, first(b), first(b + 1));
    for (const Vec3& shift : period_shifts(grid))
      if (moves(scene.bodies[b]) || overlap(block, {here.lower + shift, here.upper + shift})) images.emplace_back(b, shift);
  }
  return images;
}

}  // namespace

bool CellLoads::wanted(const Case& scene) { return scene.contact || std::any_of(scene.cells.begin(), scene.cells.end(), pushed); }

CellLoads::CellLoads(const Case& scene, SharedCells& cells, const Transfer& transfer, const Grid& grid, double viscosity,
                     std::shared_ptr<Workspace> workspace, ImmersedFlow* rigid)
    : cells_(cells), membranes_(cells.membranes()), comm_(cells.comm()), transfer_(transfer), workspace_(std::move(workspace)) {
  if (scene.contact) {
    const double blend = scene.coupling->slip ? slip_reach * comm_.max(transfer.largest_spacing()) : 0;
    const ContactPeers peers{comm_,
                             [this] {
                               if (joined_) joined_->give_back(cells_.surfaces());
                               cells_.to_copies(cells_.surfaces().x, true);
                               follow_bodies();
                             },
                             workspace_,
                             {transfer.search().lower, transfer.search().upper}};
    contact_ = std::make_unique<Contact>(*scene.contact, membranes_.surfaces(), Images{}, viscosity, blend, &peers);
    walls_ = walls_of(scene.boundaries);
    links_ = links_across_walls(transfer.block().lattice);
    refuse_thin_blocks(scene.contact->range_um);
    if (rigid) {
      const double reach = farthest(membranes_.templates()) + 2 * contact_->reach();
      const SpaceBox block{transfer.search().lower, transfer.search().upper};
      const PeriodicFrame frame = periodic_frame(grid);
      joined_ = std::make_unique<JoinedSurfaces>(rigid->surfaces(), images_of(scene, rigid->surfaces(), grid, block, reach),
                                                 rigid->boundary().laps(), frame.period);
      bodies_move_ = rigid->boundary().periodic() && std::any_of(scene.bodies.begin(), scene.bodies.end(), moves);
    }
  }
  for (std::size_t c = 0; c < scene.cells.size(); ++c)
    if (pushed(scene.cells[c])) push_[static_cast<int>(c)] = scene.cells[c].push_nN;
  take_up();
}

/// A rank knows the walls of its own block alone.
/// @throws InputError  where some are within reach of the next block
void CellLoads::refuse_thin_blocks(double range) const {
  const Lattice& lattice = transfer_.block().lattice;
  std::string wrong;
  for (int d = 0; d < 3; ++d)
    for (int end = 0; end < 2; ++end) {
      const bool here = end == 0 ? lattice.boundary_below[d] : lattice.boundary_above[d];
      const bool ends_too = end == 0 ? lattice.boundary_above[d] : lattice.boundary_below[d];
      if (!walls_.wall[d][end] || !here || ends_too) continue;
      const double thickness = least_thickness(lattice, d, end);
      if (thickness < range)
        wrong = fmt::format(
            "contact.range_um = {:g}: the block of rank {} beside a wall is only {:.3g} um thick along {}, and the next "
            "one would not feel the wall: use fewer ranks, or a smaller contact.range_um",
            range, comm_.rank(), thickness, "ijk"[d]);
    }
  wrong = agree(comm_, wrong);
  if (!wrong.empty()) throw InputError(wrong);
}

void CellLoads::take_up() {
  const SurfaceSet& set = membranes_.surfaces();
  if (!force_.data() || force_.extent(0) < static_cast<std::size_t>(set.vertices)) {
    force_ = Components<double>();  // free before taking more
    force_ = Components<double>("corpuscle::coupling::load", set.vertices + set.vertices / 64 + 1, 3);
  }
  Kokkos::deep_copy(force_, 0.0);
  if (joined_) {
    joined_->take_up(set, membranes_.templates(), membranes_.views().type);
    contact_->take_up(joined_->set(), membranes_.templates(), &joined_->rigid());
  } else if (contact_) {
    contact_->take_up(set, membranes_.templates());
  }
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

void CellLoads::follow_bodies() {
  if (joined_) joined_->update(membranes_.surfaces());
}

void CellLoads::look_at_start(double dt) {
  if (!contact_) return;
  follow_bodies();
  contact_->look_at_start(dt);
  note_wall_gap();
}

WallContacts CellLoads::at_walls(double reach) const {
  return {transfer_.block().lattice, transfer_.views(), walls_, membranes_.surfaces(), reach, links_};
}

void CellLoads::note_wall_gap() {
  if (!contact_ || !walls_.any()) return;
  const double least = least_wall_gap(at_walls(contact_->reach()));
  smallest_wall_gap_ = std::min(smallest_wall_gap_, comm_.min(least));
}

void CellLoads::look(double time, double dt) {
  follow_bodies();
  if (contact_) contact_->look(time, dt);
}

bool CellLoads::limit_approach(double time) {
  follow_bodies();
  return contact_ && contact_->limit_approach(time);
}

void CellLoads::limit_ahead() {
  follow_bodies();
  if (contact_) contact_->limit_ahead();
}

void CellLoads::gather(double dt, bool ahead) {
  start_loads(membranes_.vertices(), membranes_.views().force, membranes_.surfaces().vertex_body, share_, force_);
  if (!contact_) return;
  follow_bodies();
  contact_->add_forces(dt, ahead, force_);
  if (walls_.any()) add_walls(dt);
}

/// Each rank knows the walls of its own block; its copies' parts go to their cells.
void CellLoads::add_walls(double dt) {
  const ContactLaw law = contact_->law(dt);
  const std::size_t vertices = membranes_.surfaces().vertices;
  const Components<double> of_walls(workspace_->reserve(3 * vertices), vertices, 3);
  wall_forces(at_walls(law.range), law, contact_->at_rest(), of_walls);
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
  const ContactLaw law = contact_->law(dt);
  double here = contact_->energy(dt);
  if (walls_.any()) here += wall_energy(at_walls(law.range), law, contact_->at_rest());
  return here;
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
