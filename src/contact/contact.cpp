#include "contact/contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cells/topology.hpp"
#include "contact/contact_pushes.hpp"
#include "contact/find_contacts.hpp"
#include "contact/keep_apart.hpp"
#include "contact/step_ways.hpp"
#include "core/error.hpp"
#include "membrane/interface.hpp"

namespace corpuscle {

namespace {

constexpr double far_away = 1e30;      // um
constexpr double keep_share = 0.5;     // of a gap, in one step
constexpr double followed_way = 1.0 / 3;  // of a cell's radius, in one step: lists of what is near take in all within several such ways
constexpr double opening = 0.15;       // rate at which a film's gap follows its pressure, over gap and viscosity
constexpr double followed = 0.5;       // of a gap's excess, that one step may undo
constexpr double healed_share = 0.1;   // of the range, to which crossings are opened again
constexpr double deepest_share = 0.8;  // of the range, from which crossings are put back
constexpr int most_passes = 8, most_repairs = 20;

template <class View, class... Extents>
View make(const char* name, Extents... extents) {
  return View(uninitialised(std::string("corpuscle::contact::") + name), extents...);
}

/// Where the gap times its whole stiffness reaches the limit, kPa, on the way down from the range.
double knee_of(const ContactLaw& law, double limit) {
  double below = law.knee, above = law.range;
  for (int halving = 0; halving < 50; ++halving) {
    const double d = 0.5 * (below + above);
    (d * (law.steep_stiffness(d) + law.steep_well(d).stiffness) > limit ? below : above) = d;
  }
  return above;
}

/// um, of a sphere of the smallest body's surface, of the first so many.
double smallest_radius(const SurfaceSet& set, int bodies) {
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.first_vertex);
  const auto area = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), set.area);
  double least = far_away;
  for (int body = 0; body < bodies; ++body) {
    double sum = 0;
    for (int v = first(body); v < first(body + 1); ++v) sum += area(v);
    least = std::min(least, std::sqrt(sum / (4 * std::acos(-1.0))));
  }
  return least;
}

int last_value(const Array<int>& view, int at) {
  int value = 0;
  Kokkos::deep_copy(value, Kokkos::subview(view, at));
  return value;
}

}  // namespace

Contact::Contact(const ContactSettings& settings, const SurfaceSet& surfaces, const Images& images, double viscosity,
                 double blend_um, const ContactPeers* peers)
    : settings_(settings), surface_(surfaces), images_(images), viscosity_(viscosity) {
  if (peers) peers_ = *peers;
  constexpr double apart = 1.5;  // of the range: a sheet that is compressed by a third does not repel itself
  reach_.own = settings.range_um;
  reach_.other =
      std::max({settings.range_um, blend_um, settings.aggregation_energy > 0 ? settings.aggregation_range_um : 0.0});
  reach_.apart = apart * settings.range_um;
  make_arrays();
  if (peers) return;  // take_up() follows
  longest_way_ = followed_way * smallest_radius(surfaces, surfaces.cells);
  Kokkos::deep_copy(rest_.x, surfaces.x);
  Kokkos::deep_copy(rest_.area, surfaces.area);
}

void Contact::take_up(const SurfaceSet& set, const SurfaceSet& types, const Array<int>& type, const SurfaceSet* rigid) {
  surface_ = set;
  make_arrays();
  fill_rest(types, type, surface_, 0, movable_, rest_.x, rest_.area);
  if (rigid) fill_rest(*rigid, type, surface_, movable_, surface_.vertices, rest_.x, rest_.area);
  if (longest_way_ == 0) longest_way_ = followed_way * smallest_radius(types, types.bodies);
}

/// For the present surfaces, of whose contacts nothing is known.
void Contact::make_arrays() {
  const int vertices = surface_.vertices;
  rest_ = {make<Components<double>>("rest_x", vertices, 3), make<Array<double>>("rest_area", vertices)};
  movable_ = last_value(surface_.first_vertex, surface_.cells);
  own_ = peers_ ? surface_.own_vertices : movable_;
  lists_.first = make<Array<int>>("first_item", vertices + 1);
  lists_.first_group = make<Array<int>>("first_contact", vertices + 1);
  listed_ = make<Components<double>>("listed_x", vertices, 3);
  side_ = make<Array<int>>("own_side", vertices);
  Kokkos::deep_copy(side_, -1);
  gap_ = make<Array<double>>("gap", vertices);
  bins_.order = make<Array<int>>("bin_order", surface_.triangles);
  now_ = ahead_ = {};
  lists_.items = lists_.groups = item_room_ = group_room_ = 0;
  skin_ = -1;
}

void Contact::make_bins(double width) {
  const TriangleBounds bounds = bounds_of_triangles(surface_);
  bins_.radius = bounds.radius;
  bins_.width = width + bounds.radius;
  const double most = 2.0 * surface_.triangles + 1000;
  double count;
  do {
    count = 1;
    for (int d = 0; d < 3; ++d) {
      bins_.lower[d] = bounds.lower[d];
      const double along = std::floor((bounds.upper[d] - bounds.lower[d]) / bins_.width) + 1;
      bins_.n[d] = static_cast<int>(std::min(along, 1e6));
      count *= along;
    }
    if (count > most) bins_.width *= 1.3;
  } while (count > most);
  if (bins_.count() + 1 > bin_room_) {
    bin_room_ = bins_.count() + 1 + bins_.count() / 4;
    bins_.start = make<Array<int>>("bin_start", bin_room_);
  }
  sort_triangles(surface_, bins_);
}

/// @param shares  the arrays of pushes and hits are those of the other contacts, which are never needed at the same
/// time
ContactViews Contact::make_contacts(const ContactViews* shares) const {
  ContactViews c;
  if (shares) c = *shares;
  c.item = make<Array<int>>("contact_item", group_room_);
  c.gap = make<Array<double>>("contact_gap", group_room_);
  c.weight = make<Table<double>>("contact_weight", group_room_, 3);
  c.normal = make<Table<double>>("contact_normal", group_room_, 3);
  if (shares) return c;
  c.push = make<Array<double>>("contact_push", group_room_);
  c.hit = make<Array<int>>("contact_hit", group_room_);
  c.hit_start = now_.hit_start.data() ? now_.hit_start : make<Array<int>>("hit_start", surface_.triangles + 1);
  return c;
}

/// Anew where something may have come from beyond the skin. It is wide enough for several steps at the present speed.
/// @param way  um, from the present lists to the end of the next step
void Contact::make_lists(double way, double dt) {
  constexpr double steps = 6, least = 0.5;  // of the range
  if (surface_.vertices == 0) return;  // on this rank, at present
  if (skin_ >= 0 && way < 0.5 * skin_) return;
  copy_vertices(surface_.vertices, surface_.x, listed_);
  if (skin_ >= 0) way = step_ways(surface_, listed_, 0, dt).whole;
  skin_ = std::max(least * settings_.range_um, std::min(steps * way, 2 * reach_.other) + 2 * way);
  const ContactReach with_skin{reach_.other + skin_, reach_.own + skin_, reach_.apart};
  make_bins(std::max(with_skin.other, with_skin.own));
  const ContactSearch search{surface_, images_, bins_, rest_, with_skin};
  lists_.items = countable_items(count_items(search, lists_));
  if (lists_.items > item_room_) {
    item_room_ = lists_.items + lists_.items / 4;
    lists_.item = make<Array<int>>("items", item_room_);
  }
  fill_items(search, lists_);
  lists_.groups = number_groups(lists_, surface_.vertices);
  if (lists_.groups > group_room_ || !now_.hit_start.data()) {
    group_room_ = lists_.groups + lists_.groups / 4;
    now_ = make_contacts(nullptr);
  }
  ++report_.lists;
}

StepWays Contact::ways(double dt) const {
  if (surface_.vertices == 0) return {};
  return step_ways(surface_, skin_ < 0 ? surface_.x : listed_, std::max(0.0, skin_), dt);
}

void Contact::find(const ContactViews& contacts) {
  find_contacts(surface_, images_, reach_, lists_, contacts);
  gaps_to_others(surface_, lists_, contacts, far_away, gap_);
}

/// Moves surfaces until no gap is below its goal. @returns what was short before
Shortfall Contact::correct(double share, double least) {
  constexpr double relax = 0.6, enough = 1e-3;
  const GapGoal goal{share, least, relax, movable_};
  Shortfall before;
  for (int pass = 0; pass < most_passes; ++pass) {
    const Shortfall now = shortfall(goal);
    if (pass == 0) before = now;
    if (now.most <= enough) break;
    push(now_, surface_.x);
    if (peers_) peers_->update_copies();
  }
  return before;
}

/// Adds the contacts' pushes to `sum` [vertex, 3] of this rank's own.
void Contact::push(const ContactViews& contacts, const Components<double>& sum) {
  if (surface_.vertices == 0) return;
  sort_hits(surface_, lists_.groups, contacts);
  add_pushes(surface_, lists_, contacts, own_, sum);
}

void Contact::limit_ahead() { correct(keep_share, 0); }

void Contact::limit_approach(double time) {
  const Shortfall before = correct(keep_share, 0);
  report_.limited += before.limited;
  if (before.through > 0) count_crossings(before.through, before.first, time);
}

/// Of all ranks together, but for the contact that is named.
Shortfall Contact::shortfall(const GapGoal& goal) {
  Shortfall found = gap_corrections(surface_, images_, lists_, now_, goal, settings_.range_um, own_);
  if (!peers_) return found;
  found.most = peers_->comm.max(found.most);
  found.limited = static_cast<int>(peers_->comm.sum(static_cast<long>(found.limited)));
  found.through = static_cast<int>(peers_->comm.sum(static_cast<long>(found.through)));
  return found;
}

/// Of all ranks together, but for the contact that is named.
CrossingCount Contact::crossings() {
  CrossingCount found = find_crossings(surface_, lists_, now_, side_, own_);
  if (!peers_) return found;
  found.vertices = static_cast<int>(peers_->comm.sum(static_cast<long>(found.vertices)));
  found.deepest = peers_->comm.max(found.deepest);
  return found;
}

/// Finds crossings and puts what has crossed back, as often as it takes.
/// @throws ComputationError  if some is not to be put back: what has gone in far has no way that is its own
void Contact::mend_crossings(double time, double dt) {
  for (int repair = 0; repair <= most_repairs; ++repair) {
    const CrossingCount found = crossings();
    if (found.vertices == 0) return;
    if (repair == most_repairs || found.deepest > deepest_share * settings_.range_um) {
      const double way = fastest_crossing(dt);
      const std::string cause =
          way > settings_.range_um
              ? fmt::format("They came from beyond contact.range_um = {:g}, by {:.2g} um in a step of {:.3g} us, so that contact had no "
                            "part in it. Likely cause: a membrane that blows up, or a step too long for the load: reduce time.step_us "
                            "or the load",
                            settings_.range_um, way, dt)
              : std::string("Likely cause: a step too long, or a load that contact cannot hold: reduce time.step_us, raise "
                            "contact.pressure_Pa or contact.range_um, or reduce the load");
      throw ComputationError(
          fmt::format("surfaces cross: {} at {:.6g} us, {} vertices by up to {:.2g} um, too many or too far to be put back. {}",
                      told_text(found.first), time, found.vertices, found.deepest, cause));
    }
    if (repair == 0) count_crossings(found.vertices, found.first, time);
    correct(0, healed_share * settings_.range_um);
    find(now_);
  }
}

void Contact::look(double time, double dt) {
  make_lists(refuse_runaways(time, dt), dt);
  find(now_);
  mend_crossings(time, dt);
  refuse_fast_passage(time, dt);
  note_gaps();
}

/// Of all ranks together.
void Contact::note_gaps() {
  const bool rigid = surface_.bodies > surface_.cells;
  double least[3] = {rigid ? least_gap_to(false, surface_, lists_, now_) : least_of(gap_), least_own_gap(surface_, lists_, now_),
                     rigid ? least_gap_to(true, surface_, lists_, now_) : far_away};
  if (peers_)
    for (double& gap : least) gap = peers_->comm.min(gap);
  report_.smallest_gap = std::min(report_.smallest_gap, least[0]);
  report_.smallest_own_gap = std::min(report_.smallest_own_gap, least[1]);
  report_.smallest_body_gap = std::min(report_.smallest_body_gap, least[2]);
}

void Contact::look_at_start(double dt) {
  make_lists(ways(dt).whole, dt);
  find(now_);
  const auto found = crossings();
  if (found.vertices > 0)
    throw InputError(
        fmt::format("surfaces cross: {}, by {} vertices, before the first step: move them apart (center_um, axis)",
                    told_text(found.first), found.vertices));
  note_gaps();
}

ContactLaw Contact::law(double dt) const {
  ContactLaw law;
  law.range = law.reach = settings_.range_um;
  law.pressure = settings_.pressure;
  // 0.15 gap stiffness(gap) dt / viscosity = followed, with q = range / gap: 2 p q (q - 1) = limit.
  const double limit = followed * viscosity_ / (opening * dt);
  law.knee = law.range / (0.5 * (1 + std::sqrt(1 + 2 * limit / law.pressure)));
  if (settings_.aggregation_energy > 0) {
    constexpr double ends = 4;  // e-folds to the end of the attraction
    law.depth = settings_.aggregation_energy;
    law.reach = settings_.aggregation_range_um;
    law.steepness = ends / (law.reach - law.range);
    law.knee = knee_of(law, limit);
  }
  return law;
}

double Contact::fastest_relaxation_per_us() const {
  const ContactLaw morse = law(1);
  return opening * morse.reach * 2 * morse.depth * morse.steepness * morse.steepness / viscosity_;
}

void Contact::add_forces(double dt, bool ahead, const Components<double>& force) {
  const bool made = ahead_.hit_start.data() && ahead_.item.extent(0) >= now_.item.extent(0);
  if (ahead && !made) ahead_ = make_contacts(&now_);
  const ContactViews& contacts = ahead ? ahead_ : now_;
  if (ahead) find(contacts);
  contact_forces(surface_, law(dt), rest_, lists_, contacts);
  push(contacts, force);
}

double Contact::energy(double dt) const {
  const double here = contact_energy(surface_, law(dt), rest_, lists_, now_, own_);
  return peers_ ? peers_->comm.sum(here) : here;
}

std::array<double, 4> Contact::load_on_rigid(double dt, int body) const {
  const Sums<4> here = contact_load_on_rigid(surface_, law(dt), rest_, lists_, now_, own_, body);
  std::array<double, 4> all{here[0], here[1], here[2], here[3]};
  if (peers_) peers_->comm.sum(all.data(), 4);
  return all;
}

}  // namespace corpuscle
