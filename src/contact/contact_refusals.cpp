// What of contact stops a run, and how it is told. Copies to the host: for messages.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "contact/contact.hpp"
#include "contact/step_ways.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "immersed/surface.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {

namespace {

constexpr long told = 5;            // crossings that are told one by one
constexpr int most_recurring = 10;  // steps with crossings, less those without: what is put back goes through again

template <class View>
auto host_of(const View& view) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
}

}  // namespace

int countable_items(std::int64_t items) {
  constexpr std::int64_t most = 2147483647;
  if (items > most)
    throw ComputationError(
        fmt::format("contact: {:.3g} pairs of a vertex and a triangle on a rank, and {:.3g} are the most: use more "
                    "ranks, fewer cells, or a smaller contact.range_um",
                    static_cast<double>(items), static_cast<double>(most)));
  return static_cast<int>(items);
}

/// Lists are of places in single precision: where those are no finer than the range, all is near to all.
/// @throws InputError        before the first step
/// @throws ComputationError  later
void Contact::refuse_far_away(const TriangleBounds& bounds, bool at_start) const {
  constexpr double share = 0.1;  // of the range
  double furthest = 0;
  for (int d = 0; d < 3; ++d) furthest = std::max({furthest, -bounds.lower[d], bounds.upper[d]});
  const double apart = std::numeric_limits<float>::epsilon() * furthest;
  if (apart <= share * settings_.range_um) return;
  const std::string found = fmt::format(
      "contact: a surface is {:.3g} um from the origin, where places are kept to {:.2g} um, too coarse for contact.range_um = {:g}",
      furthest, apart, settings_.range_um);
  if (at_start) throw InputError(found + ": move the grid and all in it towards the origin (grid.lower_um, grid.upper_um, center_um)");
  throw ComputationError(found + ". Likely cause: a step too long for the flow, or a load without bound: reduce time.step_us or the load");
}

/// Before lists are made: they reach as far as anything may come from, and would take in all of a scene that flies apart.
/// @returns from the present lists to the end of the next step
/// @throws ComputationError
StepWays Contact::refuse_runaways(double time, double dt) {
  const StepWays all = ways(dt);
  const LongestWay& found = all.step;
  refuse(found, longest_way_, [&] {
    const auto body = host_of(surface_.vertex_body);
    const auto first = host_of(surface_.first_vertex);
    const int cell = body(found.vertex);
    return fmt::format(
        "contact: {}, vertex {} at {} and {:.6g} us, goes {:.3g} um in a step of {:.3g} us, beyond the mean of all: more "
        "than a third of a cell's radius, {:.3g} um, so that there is no telling what it meets. Likely cause: a membrane "
        "that blows up, or a step too long for the load: reduce time.step_us or the load",
        body_name(surface_, cell), found.vertex - first(cell), place_text(found.vertex), time, found.way, dt, longest_way_);
  });
  return all;
}

/// What goes through a triangle in one step, and further than the range, does so where contact has no part in it, and may end beyond
/// what signed gaps can see.
/// @throws ComputationError
void Contact::refuse_fast_passage(double time, double dt) {
  const double most = settings_.range_um;
  const LongestWay found = longest_passage(surface_, images_, lists_, own_, dt, most);
  refuse(found, most, [&] {
    return fmt::format(
        "contact: {} and {:.6g} us, go through each other, by {:.3g} um in a step of {:.3g} us, more than contact.range_um = {:g}: "
        "contact has no part in it. Likely cause: a step too long for the flow or the load, or a membrane that blows up: "
        "reduce time.step_us or the load",
        pair_text(found.vertex, found.item), time, found.way, dt, most);
  });
}

/// Ways that are longer than `most` on any rank stop all, with the text of the lowest.
void Contact::refuse(const LongestWay& found, double most, const std::function<std::string()>& text) const {
  const double all = peers_ ? peers_->comm.max(found.way) : found.way;
  if (all <= most) return;
  const std::string mine = found.way <= most ? "" : text();
  throw ComputationError(peers_ ? agree(peers_->comm, mine) : mine);
}

/// The longest way, um, that a vertex on the wrong side has made towards what it went through in a step of that length.
double Contact::fastest_crossing(double dt) const {
  const auto first = host_of(lists_.first_group), item = host_of(now_.item);
  const auto gap = host_of(now_.gap);
  const auto weight = host_of(now_.weight), normal = host_of(now_.normal);
  const auto triangle = triangles_on_host(surface_);
  const auto v = host_of(surface_.v);
  double most = 0;
  const auto body = host_of(surface_.vertex_body);
  for (int i = 0; i < surface_.vertices; ++i)
    for (int g = first(i); g < first(i + 1); ++g) {
      if (item(g) < 0 || gap(g) >= 0) continue;
      const bool counting = i < own_ || (body(i) >= surface_.cells && triangle(item_triangle(surface_, item(g)), 0) < own_);
      if (!counting) continue;
      Vec3 velocity = load(v, i);
      for (int d = 0; d < 3; ++d) velocity -= weight(g, d) * load(v, triangle(item_triangle(surface_, item(g)), d));
      most = std::max(most, -dt * dot(velocity, load(normal, g)));
    }
  return peers_ ? peers_->comm.max(most) : most;
}

/// @throws ComputationError  for crossings that go on from step to step
void Contact::count_crossings(int vertices, int first, double time) {
  if (!crossed_) ++recurring_;
  crossed_ = true;
  if (recurring_ >= most_recurring)
    throw ComputationError(
        fmt::format("surfaces cross: {} at {:.6g} us, {} vertices, and some have done so in {} steps: they are put back, and go through "
                    "again. Likely cause: a flow or a load that presses them together harder than contact can hold, or a step too long: "
                    "reduce the flow (the boundaries' velocities, fluid.pressure_gradient_Pa_per_um), the load (push_nN) or time.step_us, "
                    "raise contact.pressure_Pa, refine grid.nodes, or use more vertices (cells.vertices)",
                    told_text(first), time, vertices, recurring_));
  if (report_.crossings < told) warn("surfaces crossed: {}, at {:.6g} us; {} of their vertices put back", told_text(first), time, vertices);
  report_.crossings += vertices;
}

std::string Contact::crossing_text(int contact) const {
  const auto first = host_of(lists_.first_group);
  int v = 0;
  while (first(v + 1) <= contact) ++v;
  return pair_text(v, host_of(now_.item)(contact));
}

std::string Contact::place_text(int vertex) const {
  const auto x = host_of(surface_.x);
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) um", x(vertex, 0), x(vertex, 1), x(vertex, 2));
}

/// Of a vertex and an item.
std::string Contact::pair_text(int v, int item) const {
  const auto body = host_of(surface_.vertex_body);
  const auto triangle_body = host_of(surface_.triangle_body);
  const int other = triangle_body(item_triangle(surface_, item));
  const std::string where = place_text(v);
  if (item_image(surface_, item) == 0 && body(v) == other) return fmt::format("{} with itself at {}", body_name(surface_, other), where);
  const bool image = body_name(surface_, body(v)) == body_name(surface_, other);
  return fmt::format("{} and {}{} at {}", body_name(surface_, body(v)), body_name(surface_, other), image ? " beyond a periodic side" : "",
                     where);
}

/// On all ranks, of the lowest rank that has one.
std::string Contact::told_text(int first) const {
  const std::string mine = first < lists_.groups ? crossing_text(first) : "";
  return peers_ ? agree(peers_->comm, mine) : mine;
}

}  // namespace corpuscle
