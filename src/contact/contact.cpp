#include "contact/contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/contact_pushes.hpp"
#include "contact/find_contacts.hpp"
#include "contact/fit_motion.hpp"
#include "contact/keep_apart.hpp"
#include "contact/step_ways.hpp"
#include "core/error.hpp"
#include "membrane/interface.hpp"

namespace corpuscle {

namespace {

constexpr double far_away = 1e30;         // um
constexpr double keep_share = 0.5;        // of a gap, in one step
constexpr double enough_kept = 1e-3;      // of what is to be kept, that may be missing
constexpr double followed_way = 1.0 / 3;  // of a cell's radius, in one step: lists of what is near take in all within several such ways
constexpr double opening = 0.15;          // rate at which a film's gap follows its pressure, over gap and viscosity
constexpr double followed = 0.5;          // of a gap's excess, that one step may undo
constexpr double healed_share = 0.1;      // of the range, to which crossings are opened again
constexpr double deepest_share = 0.8;     // of the range, from which crossings are put back
constexpr int most_passes = 8, most_repairs = 20;

/// Room for so many rows, with some to spare; what was there is lost where there was not enough.
template <class View, class... Columns>
void grow(View& view, const char* name, std::size_t rows, Columns... columns) {
  if (view.data() && view.extent(0) >= rows) return;
  view = View();  // free before taking more
  view = View(uninitialised(std::string("corpuscle::contact::") + name), rows + rows / 64 + 1, columns...);
}
/// The same for what comes and goes with every list.
std::size_t with_spare(std::size_t rows) { return rows + rows / 32; }
template <class View, class... Columns>
void grow_list(View& view, const char* name, std::size_t rows, Columns... columns) {
  if (!view.data() || view.extent(0) < rows) grow(view, name, with_spare(rows), columns...);
}

/// Positions and areas of bodies as they are at rest, behind so many vertices.
void place_behind(const SurfaceSet& bodies, int before, const ContactRest& at_rest) {
  const SurfaceSet from = bodies;
  const ContactRest to = at_rest;
  Kokkos::parallel_for(
      "corpuscle::contact::place_behind", Policy(0, from.vertices), KOKKOS_LAMBDA(int i) {
        store(to.x, before + i, load(from.x, i));
        to.area(before + i) = from.area(i);
      });
}

/// Parts of a workspace, one after the other.
class Parts {
 public:
  explicit Parts(double* memory) : next_(memory) {}
  template <class Value>
  Value* take(std::size_t count) {
    auto* const part = reinterpret_cast<Value*>(next_);
    next_ += numbers<Value>(count);
    return part;
  }
  /// Of the workspace's numbers.
  template <class Value>
  static std::size_t numbers(std::size_t count) {
    return (count * sizeof(Value) + sizeof(double) - 1) / sizeof(double);
  }

 private:
  double* next_;
};

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

Contact::Contact(const ContactSettings& settings, const SurfaceSet& surfaces, const Images& images, double viscosity, double blend_um,
                 const ContactPeers* peers)
    : settings_(settings),
      surface_(surfaces),
      images_(images),
      viscosity_(viscosity),
      workspace_(peers ? peers->workspace : std::make_shared<Workspace>()) {
  if (peers) peers_ = *peers;
  constexpr double apart = 1.5;  // of the range: a sheet that is compressed by a third does not repel itself
  reach_.own = settings.range_um;
  reach_.other = std::max({settings.range_um, blend_um, settings.aggregation_energy > 0 ? settings.aggregation_range_um : 0.0});
  reach_.apart = apart * settings.range_um;
  make_arrays();
  if (peers) return;  // take_up() follows
  longest_way_ = followed_way * smallest_radius(surfaces, surfaces.cells);
  rest_.x = Components<double>(uninitialised("corpuscle::contact::rest_x"), surfaces.vertices, 3);
  rest_.area = Array<double>(uninitialised("corpuscle::contact::rest_area"), surfaces.vertices);
  copy_vertices(surfaces.vertices, surfaces.x, rest_.x);
  copy_values(surfaces.vertices, surfaces.area, rest_.area);
}

void Contact::take_up(const SurfaceSet& set, const SurfaceSet& types, const SurfaceSet* rigid) {
  surface_ = set;
  make_arrays();
  if (rigid) {
    grow(rest_.x, "rest_x", types.vertices + rigid->vertices, 3);
    grow(rest_.area, "rest_area", types.vertices + rigid->vertices);
    place_behind(types, 0, rest_);
    place_behind(*rigid, types.vertices, rest_);
  } else {
    rest_.x = types.x;
    rest_.area = types.area;
  }
  if (longest_way_ == 0) longest_way_ = followed_way * smallest_radius(types, types.bodies);
}

/// For the present surfaces, of whose contacts nothing is known.
void Contact::make_arrays() {
  const int vertices = surface_.vertices;
  movable_ = last_value(surface_.first_vertex, surface_.cells);
  own_ = peers_ ? surface_.own_vertices : movable_;
  grow(lists_.first_group, "first_contact", vertices + 1);
  grow(listed_, "listed_x", vertices, 3);
  grow(side_, "own_side", vertices);
  grow(gap_, "gap", vertices);
  Kokkos::deep_copy(side_, -1);
  lists_.items = lists_.groups = 0;
  skin_ = -1;
  together_ = {};
}

/// What is of no use beyond a call: spheres, pushes, and contacts at positions ahead.
void Contact::take_workspace(bool ahead) {
  const std::size_t groups = lists_.groups, triangles = surface_.triangles;
  const std::size_t pushes = Parts::numbers<double>(groups) + Parts::numbers<int>(groups) + Parts::numbers<int>(triangles + 1);
  const std::size_t contacts = ahead ? Parts::numbers<int>(groups) + 7 * groups : 0;
  Parts parts(workspace_->reserve(Parts::numbers<float>(4 * triangles) + pushes + contacts));
  spheres_.sphere = Table<float>(parts.take<float>(4 * triangles), triangles, 4);
  pushes_.push = Array<double>(parts.take<double>(groups), groups);
  pushes_.hit = Array<int>(parts.take<int>(groups), groups);
  pushes_.hit_start = Array<int>(parts.take<int>(triangles + 1), triangles + 1);
  if (!ahead) return;
  ahead_.gap = Array<double>(parts.take<double>(groups), groups);
  ahead_.weight = Table<double>(parts.take<double>(3 * groups), groups, 3);
  ahead_.normal = Table<double>(parts.take<double>(3 * groups), groups, 3);
  ahead_.item = Array<int>(parts.take<int>(groups), groups);
}

/// @param items  for so many there is room then
ContactItems Contact::make_bins(double width, const TriangleBounds& bounds, std::size_t items) {
  bins_.width = (width + bounds.radius) / bins_.around;
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
  const std::size_t starts = bins_.count() + 1, triangles = surface_.triangles, vertices = surface_.vertices + 1;
  Parts parts(workspace_->reserve(Parts::numbers<float>(4 * triangles) + Parts::numbers<int>(starts) + Parts::numbers<int>(triangles) +
                                  Parts::numbers<int>(vertices) + Parts::numbers<int>(items)));
  spheres_.sphere = Table<float>(parts.take<float>(4 * triangles), triangles, 4);
  bins_.start = Array<int>(parts.take<int>(starts), starts);
  bins_.order = Array<int>(parts.take<int>(triangles), triangles);
  sort_triangles(surface_, bins_);
  enclose_triangles(surface_, spheres_, bins_.order);
  return {Array<int>(parts.take<int>(vertices), vertices), Array<int>(parts.take<int>(items), items)};
}

/// Whether nothing that is not listed can come near in the next step: two vertices come nearer by what each does beyond the smooth
/// motion, and by what that does over the distance between them.
bool Contact::lists_hold(const StepWays& ways, double dt) const {
  constexpr double kept = 0.48;  // half, less what rounding positions to single precision may hide
  if (skin_ < 0) return false;
  const double sheared = 0.5 * steepest_ * (together_.time + dt) * span_;
  return ways.whole + sheared < kept * skin_ && ways.drift < wander_;
}

/// What all do together from now on, or nothing where that brings them less near to each other. @returns the ways of a step from here
StepWays Contact::choose_motion(const TriangleBounds& bounds, double dt) {
  constexpr double most_sheared = 0.05;  // in a step, of the skin as of all distances
  SpaceBounds space;
  for (int d = 0; d < 3; ++d) {
    space.lower[d] = bounds.lower[d] - bounds.radius;
    space.upper[d] = bounds.upper[d] + bounds.radius;
  }
  together_ = {};
  steepest_ = 0;
  const StepWays by_mean = step_ways(surface_, listed_, together_, 0, dt);
  if (images_.count > 1) return by_mean;  // what moves smoothly here moves otherwise a period further on
  const MotionSince fitted{fit_motion(surface_, space), 0};
  const double gradient = steepest_gradient(fitted.motion, space);
  const StepWays ways = step_ways(surface_, listed_, fitted, 0, dt);
  const double sheared = 0.5 * gradient * dt * (reach_.other + 2 * bounds.radius);
  if (!(gradient * dt < most_sheared && ways.whole + sheared < by_mean.whole)) return by_mean;
  together_ = fitted;
  steepest_ = gradient;
  return ways;
}

/// Anew where something may have come from beyond the skin. It is wide enough for several steps at the present speed.
/// @param ways  from the present lists to the end of the next step
void Contact::make_lists(const StepWays& ways, double dt, bool at_start) {
  constexpr double steps = 6, least = 0.5;  // of the range
  constexpr double skins = 4, drifts = 8;   // of which vertices may drift
  if (surface_.vertices == 0) return;       // on this rank, at present
  if (lists_hold(ways, dt)) return;
  const TriangleBounds bounds = bounds_of_triangles(surface_);
  refuse_far_away(bounds, at_start);
  copy_rounded(surface_.vertices, surface_.x, listed_);
  const StepWays ahead = choose_motion(bounds, dt);
  const double way = ahead.whole + 0.5 * steepest_ * dt * (reach_.other + 2 * bounds.radius);
  skin_ = std::max(least * settings_.range_um, std::min(steps * way, 2 * reach_.other) + 2 * way);
  const ContactReach with_skin{reach_.other + skin_, reach_.own + skin_, reach_.apart};
  const double width = std::max(with_skin.other, with_skin.own);
  span_ = width + 2 * bounds.radius;
  GapsWanted wanted = peers_ ? peers_->gaps : GapsWanted();
  wander_ = wanted.everywhere() || surface_.own_cells == surface_.cells ? far_away
                                                                        : std::max({skins * skin_, reach_.other, drifts * ahead.drift});
  for (int d = 0; d < 3; ++d) {
    wanted.lower[d] -= wander_;
    wanted.upper[d] += wander_;
  }
  ContactItems items = make_bins(width, bounds, items_room_);
  const auto search = [&]() -> ContactSearch { return {surface_, images_, bins_, spheres_, rest_, with_skin, wanted}; };
  const auto count = [&] { return static_cast<std::size_t>(countable_items(count_items(search(), items))); };
  if (std::size_t all = count(); all > items_room_) {  // seldom: what is in the workspace is lost where it grows
    items_room_ = with_spare(all);
    items = make_bins(width, bounds, items_room_);
    count();
  }
  fill_lists(search(), items);
  ++report_.lists;
}

void Contact::fill_lists(const ContactSearch& search, const ContactItems& items) {
  lists_.items = last_value(items.first, surface_.vertices);
  fill_items(search, items, lists_);
  lists_.groups = number_groups(lists_, surface_.vertices);
  grow_list(lists_.first, "first_item", lists_.groups + 1);
  grow_list(lists_.first_item, "lowest_item", lists_.groups);
  grow_list(lists_.beyond, "items", lists_.items);
  pack_items(surface_, items, lists_);
  grow_list(now_.item, "contact_item", lists_.groups);
  grow_list(now_.gap, "contact_gap", lists_.groups);
  grow_list(now_.weight, "contact_weight", lists_.groups, 3);
  grow_list(now_.normal, "contact_normal", lists_.groups, 3);
  Kokkos::deep_copy(Exec(), now_.item, -1);
}

StepWays Contact::ways(double dt) const {
  if (surface_.vertices == 0) return {};
  return skin_ < 0 ? step_ways(surface_, surface_.x, together_, 0, dt) : step_ways(surface_, listed_, together_, skin_, dt);
}

/// After take_workspace().
void Contact::find(const ContactViews& contacts) {
  enclose_triangles(surface_, spheres_);
  find_contacts(surface_, images_, reach_, spheres_, now_.item, lists_, contacts);
  gaps_to_others(surface_, lists_, contacts, far_away, gap_);
}

void Contact::find_now() {
  take_workspace(false);
  find(now_);
}

/// Moves surfaces until no gap is below its goal. @returns what was short before
Shortfall Contact::correct(double share, double least) {
  constexpr double relax = 0.6;
  const GapGoal goal{share, least, relax, movable_};
  Shortfall before;
  take_workspace(false);
  for (int pass = 0; pass < most_passes; ++pass) {
    const Shortfall now = shortfall(goal);
    if (pass == 0) before = now;
    if (now.most <= enough_kept) break;
    push(now_, surface_.x);
    if (peers_) peers_->update_copies();
  }
  return before;
}

/// Adds the contacts' pushes to `sum` [vertex, 3] of this rank's own.
void Contact::push(const ContactViews& contacts, const Components<double>& sum) {
  if (surface_.vertices == 0) return;
  sort_hits(surface_, lists_.groups, contacts, pushes_);
  add_pushes(surface_, lists_, contacts, pushes_, own_, sum);
}

void Contact::limit_ahead() { correct(keep_share, 0); }

bool Contact::limit_approach(double time) {
  if (!crossed_) recurring_ = std::max(0, recurring_ - 1);
  crossed_ = false;
  const Shortfall before = correct(keep_share, 0);
  report_.limited += before.limited;
  if (before.through > 0) count_crossings(before.through, before.first, time);
  return before.most > enough_kept;
}

/// Of all ranks together, but for the contact that is named.
Shortfall Contact::shortfall(const GapGoal& goal) {
  Shortfall found = gap_corrections(surface_, images_, lists_, now_, goal, settings_.range_um, own_, pushes_.push);
  if (!peers_) return found;
  double all[2] = {found.most, found.limited + found.through > 0 ? 1.0 : 0.0};
  peers_->comm.max(all, 2);
  found.most = all[0];
  if (all[1] > 0) {  // seldom
    double numbers[2] = {static_cast<double>(found.limited), static_cast<double>(found.through)};
    peers_->comm.sum(numbers, 2);
    found.limited = static_cast<int>(numbers[0]);
    found.through = static_cast<int>(numbers[1]);
  }
  return found;
}

/// Of all ranks together, but for the contact that is named.
CrossingCount Contact::crossings() {
  CrossingCount found = find_crossings(surface_, lists_, now_, side_, own_);
  if (!peers_) return found;
  double all[2] = {found.deepest, found.vertices > 0 ? 1.0 : 0.0};
  peers_->comm.max(all, 2);
  found.deepest = all[0];
  if (all[1] > 0) found.vertices = static_cast<int>(peers_->comm.sum(static_cast<long>(found.vertices)));
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
              ? fmt::format(
                    "They came from beyond contact.range_um = {:g}, by {:.2g} um in a step of {:.3g} us, so that contact had no "
                    "part in it. Likely cause: a membrane that blows up, or a step too long for the load: reduce time.step_us "
                    "or the load",
                    settings_.range_um, way, dt)
              : std::string(
                    "Likely cause: a step too long, or a load that contact cannot hold: reduce time.step_us, raise "
                    "contact.pressure_Pa or contact.range_um, or reduce the load");
      throw ComputationError(
          fmt::format("surfaces cross: {} at {:.6g} us, {} vertices by up to {:.2g} um, too many or too far to be put back. {}",
                      told_text(found.first), time, found.vertices, found.deepest, cause));
    }
    if (repair == 0) count_crossings(found.vertices, found.first, time);
    correct(0, healed_share * settings_.range_um);
    find_now();
  }
}

void Contact::look(double time, double dt) {
  together_.time += step_;
  step_ = dt;
  make_lists(refuse_runaways(time, dt), dt);
  find_now();
  mend_crossings(time, dt);
  refuse_fast_passage(time, dt);
  note_gaps();
}

/// Of all ranks together.
void Contact::note_gaps() {
  const bool rigid = surface_.bodies > surface_.cells;
  const auto within = [&](GapWithin what) { return least_gap(what, surface_, lists_, now_); };
  double least[3] = {rigid ? within(GapWithin::membranes) : least_of(surface_.vertices, gap_), within(GapWithin::body),
                     rigid ? within(GapWithin::bodies) : far_away};
  if (peers_) {
    for (double& gap : least) gap = -gap;
    peers_->comm.max(least, 3);
    for (double& gap : least) gap = -gap;
  }
  report_.smallest_gap = std::min(report_.smallest_gap, least[0]);
  report_.smallest_own_gap = std::min(report_.smallest_own_gap, least[1]);
  report_.smallest_body_gap = std::min(report_.smallest_body_gap, least[2]);
}

void Contact::look_at_start(double dt) {
  step_ = dt;
  make_lists(ways(dt), dt, true);
  find_now();
  const auto found = crossings();
  if (found.vertices > 0)
    throw InputError(fmt::format("surfaces cross: {}, by {} vertices, before the first step: move them apart (center_um, axis)",
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
  take_workspace(ahead);
  const ContactViews& contacts = ahead ? ahead_ : now_;
  if (ahead) find(contacts);
  contact_forces(surface_, law(dt), rest_, lists_, contacts, pushes_.push);
  push(contacts, force);
}

double Contact::energy(double dt) const { return contact_energy(surface_, law(dt), rest_, lists_, now_, own_); }

std::array<double, 4> Contact::load_on_rigid(double dt, int body) const {
  const Sums<4> here = contact_load_on_rigid(surface_, law(dt), rest_, lists_, now_, own_, body);
  std::array<double, 4> all{here[0], here[1], here[2], here[3]};
  if (peers_) peers_->comm.sum(all.data(), 4);
  return all;
}

}  // namespace corpuscle
