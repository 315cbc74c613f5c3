// How packed cells become membranes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/wall_contact.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "coupling/force_coupling.hpp"
#include "fluid/boundary_conditions.hpp"
#include "immersed/surface_geometry.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

constexpr double pace_us = 20;  // steps that contact is to follow: the longest that runs take

}  // namespace

void ForceCoupling::take_places(const Case& scene, const PackedCells* packed, double contact_um) {
  const Grid& grid = fluid_.grid();
  const CellPlaces places = find_places(scene, grid, packed);
  cells_ = std::make_unique<SharedCells>(places, grid, IndexSpace::halo, contact_um, workspace_);
  membranes_ = &cells_->membranes();
  for (std::size_t c = 0; c < places.cells.size(); ++c)
    if (const CellPlace& cell = places.cells[c]; cell.start_stretch != Triple{1, 1, 1})
      drawn_out_[static_cast<int>(c)] = {cell.type, cell.start_stretch};
  drawn_out_ = farthest(drawn_out_);
  if (scene.populations.empty()) return;
  packing_ = report_of(scene, places, grid.total_volume());
  packed_ = share_of(places, grid.comm());
  packed_listed_ = places.names.listed;
  packed_gap_ = 1e30;
  for (const auto& population : scene.populations) {
    packed_gap_ = std::min(packed_gap_, population.gap_um);
    packed_in_box_ = packed_in_box_ || population.lower_um || population.upper_um;
  }
  asked_gap_ = packed_gap_;
  if (places.size == 1) return;
  small_ = packed != nullptr;
  grows_ = packed == nullptr;
  packed_gap_ = 0;
}

namespace {

/// The smallest gap of which one side at least is a packed cell's: the scene's own may be as near to each other as they please.
double least_gap_of_packed(const SurfaceSet& set, const ContactLists& lists, const ContactViews& contacts, int listed) {
  const auto host = [](const auto& view) { return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view); };
  const auto first = host(lists.first_group);
  const auto item = host(contacts.item);
  const auto gap = host(contacts.gap);
  const auto number = host(set.number);
  const auto vertex_body = host(set.vertex_body), triangle_body = host(set.triangle_body);
  double least = 1e30;
  for (int v = 0; v < set.vertices; ++v)
    for (int g = first(v); g < first(v + 1); ++g) {
      if (item(g) < 0) continue;
      const int body = vertex_body(v), other = triangle_body(item_triangle(set, item(g)));
      if (body != other && std::max(number(body), number(other)) >= listed) least = std::min(least, gap(g));
    }
  return least;
}

std::string gap_text(double gap, double seen) {
  return gap < 1e29 ? fmt::format("{:.3g} um", gap) : fmt::format("more than {:.3g} um", seen);
}

}  // namespace

/// Of packed cells that have grown: a restart begins with them as small as packing did.
std::vector<double> ForceCoupling::state() const {
  if (!packed_ || packed_->size == 1) return {};
  return {stable_us_, softest_.area, softest_.radius, small_stable_us_, short_waves_, small_short_waves_, held_rate_, small_held_rate_};
}

/// What is found of the grown cells, which are not at hand: it changes with properties as that of the small ones does.
/// @throws InputError  for steps that are longer
void ForceCoupling::set_state(const std::vector<double>& state) {
  constexpr double rounding = 1e-9;  // on other ranks
  const auto of_grown = [](double small, double small_then, double grown_then) {
    const double change = small / small_then;
    return (std::abs(change - 1) < rounding ? 1 : change) * grown_then;
  };
  small_stable_us_ = stable_us_;
  stable_us_ = of_grown(small_stable_us_, state.at(3), state.at(0));
  small_short_waves_ = short_waves_;
  if (short_waves_ > 0 && state.at(5) > 0) short_waves_ = of_grown(small_short_waves_, state.at(5), state.at(4));
  small_held_rate_ = held_rate_;
  if (held_rate_ > 0 && state.at(7) > 0) held_rate_ = of_grown(small_held_rate_, state.at(7), state.at(6));
  membranes_->take_share_of_resistance(short_waves_);
  if (state.at(1) > 0) {
    softest_.area = state.at(1);
    softest_.radius = state.at(2);
  } else {  // without membrane viscosity nobody has asked
    softest_.area /= packed_->size * packed_->size;
    softest_.radius /= packed_->size;
  }
  refuse_long_steps();
}

/// Packing has seen points and tables: here is what the triangles themselves say.
/// @throws InputError  for cells that are nearer to each other or to a side than they should be
void ForceCoupling::check_packing() {
  constexpr double reach = 0.3;     // um, beyond the gap asked for
  constexpr double rounded = 0.01;  // um, of sides between nodes
  const Comm& comm = fluid_.grid().comm();
  ContactSettings settings;
  settings.range_um = asked_gap_ + reach;
  const ContactPeers peers{comm, [this] { cells_->to_copies(surfaces().x, true); }};
  Contact contact(settings, surfaces(), Images{}, fluid_.viscosity(), 0, &peers);
  contact.take_up(surfaces(), membranes_->templates());
  contact.look_at_start(lengths_us_.front());
  packing_->gaps_seen_um = settings.range_um;
  packing_->smallest_gap_um = comm.min(least_gap_of_packed(surfaces(), contact.lists(), contact.contacts(), packed_listed_));
  const WallSides sides = walls_of(scene_.boundaries);
  const double to_side =
      sides.any() ? least_wall_gap({transfer_->block().lattice, transfer_->views(), sides, surfaces(), settings.range_um}) : 1e30;
  packing_->smallest_wall_gap_um = comm.min(to_side);
  const double least = std::min(packing_->smallest_gap_um, packing_->smallest_wall_gap_um + rounded);
  if (least >= packed_gap_ && least < asked_gap_)
    warn(
        "populations: gap_um = {:g} is asked for, and cells that have grown as membranes keep what contact leaves them: the nearest are {} "
        "from "
        "each other and {} from a wall. Ask for fewer cells (hematocrit, count), or for a smaller gap_um",
        asked_gap_, gap_text(packing_->smallest_gap_um, settings.range_um), gap_text(packing_->smallest_wall_gap_um, settings.range_um));
  if (least >= packed_gap_) return;
  throw InputError(fmt::format(
      "populations: the nearest cells are {} from each other and {} from a wall, and gap_um = {:g} is asked "
      "for: packing them has failed; use another seed, a larger gap_um, or meshes with more vertices",
      gap_text(packing_->smallest_gap_um, settings.range_um), gap_text(packing_->smallest_wall_gap_um, settings.range_um), packed_gap_));
}

/// Where shapes at rest have no room, membranes grow to their size from the largest that have, as contact and their own forces
/// move them.
/// @throws InputError  if they cannot
void ForceCoupling::inflate() {
  constexpr double growth = 1.001;  // a step: some nm
  constexpr int settling = 200;     // steps at the end
  double size = packed_->size, mobility = 0;
  info("packing:  shapes at rest fit with {:.3f} of their size; they grow on as membranes", size);
  if (packed_in_box_)
    warn(
        "populations: lower_um and upper_um hold shapes, not membranes as they grow: cells may start beyond the box by as much as the "
        "others "
        "push them; ask for fewer (hematocrit, count) or for a larger box to have them all within it");
  const auto still = [this] { Kokkos::deep_copy(surfaces().v, 0.0); };
  try {
    membranes_->rest_at_size(size);
    cells_->to_copies(surfaces().x, true);
    find_softest();
    measure_stability();
    small_stable_us_ = stable_us_;
    small_short_waves_ = short_waves_;
    small_held_rate_ = held_rate_;
    still();
    loads_->look(0, pace_us);
    long step = 0;
    for (; size < 1; ++step) {
      size = std::min(1.0, growth * size);
      settle_membranes(size, mobility, step);
    }
    for (int n = 0; n < settling; ++n) settle_membranes(1, mobility, ++step);
  } catch (const ComputationError& error) {
    throw InputError(
        fmt::format("populations: the cells do not fit, even as membranes that bend: at {:.3f} of their size, which is hematocrit "
                    "{:.3f} of {:.3f}, {}; ask for less, or for a wider grid",
                    size, packing_->tube_hematocrit * size * size * size, packing_->tube_hematocrit, error.what()));
  }
  still();
  membranes_->rest_at_size(1);
  loads_->resume(ContactReport());
  grows_ = false;
}

/// One step without a fluid: every vertex has the same mobility, um/us/nN.
void ForceCoupling::settle_membranes(double size, double& mobility, long step) {
  constexpr double share = 0.5;  // of what the stiffest mode can follow
  constexpr long every = 100;
  const Comm& comm = fluid_.grid().comm();
  membranes_->rest_at_size(size);
  begin_step(0, pace_us, 0);
  if (step % every == 0) {
    double stiffness = 0;
    together([&] {
      if (membranes_->cells() > 0) stiffness = membranes_->largest_stiffness_nN_per_um();
    });
    mobility = share / (pace_us * comm.max(stiffness));
  }
  membranes_->set_out(0);
  cells_->to_copies(surfaces().x, true);
  together([&] { membranes_->compute_forces(); });
  update_surface_geometry(surfaces());
  place(0);
  loads_->gather(pace_us, false);
  scale_forces(membranes_->vertices(), mobility, loads_->force(), surfaces().v);
  together([&] { membranes_->drift(pace_us); });
  after_move(0, pace_us);
}

}  // namespace corpuscle
