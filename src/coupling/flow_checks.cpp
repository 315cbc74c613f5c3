#include "coupling/flow_checks.hpp"

#include "common/vec3.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "fluid/boundary_conditions.hpp"
#include "input/case_checks.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

using Type = BoundarySettings::Type;

/// What one side lets through while its factor of time is 1.
struct SideFlux {
  Triple outward{};    // sum of the faces' area vectors, um2
  double area = 0;     // um2
  double through = 0;  // um3/us, sum of |v . n| over the faces, for a velocity that is a vector
  double flux = 0;     // um3/us, out of the block
};

Vec3 node(const Grid& grid, const int (&at)[3]) {
  const auto& n = grid.index().n;
  const std::size_t entry = at[0] + (n[0] + 1) * (at[1] + std::size_t(n[1] + 1) * at[2]);
  const double* x = grid.owned_nodes().data() + 3 * entry;
  return {x[0], x[1], x[2]};
}

/// @param visit  called with the area vector, pointing out of the block, of each of this rank's faces on the side
template <class Visit>
void visit_faces(const Grid& grid, BoundarySettings::Side side, const Visit& visit) {
  const IndexSpace& index = grid.index();
  const int d = static_cast<int>(side) / 2, e = (d + 1) % 3, f = (d + 2) % 3;
  const bool high = static_cast<int>(side) % 2 == 1;
  if (high ? index.first[d] + index.n[d] != index.global[d] : index.first[d] != 0) return;
  int at[3];
  at[d] = high ? index.n[d] : 0;
  const auto corner = [&](int a, int b) {
    int moved[3] = {at[0], at[1], at[2]};
    moved[e] += a, moved[f] += b;
    return node(grid, moved);
  };
  for (at[f] = 0; at[f] < index.n[f]; ++at[f])
    for (at[e] = 0; at[e] < index.n[e]; ++at[e]) {
      const Vec3 upward = 0.5 * cross(corner(1, 1) - corner(0, 0), corner(0, 1) - corner(1, 0));
      visit(high ? upward : -upward);
    }
}

std::vector<SideFlux> measure_sides(const Grid& grid, const std::vector<BoundarySettings>& boundaries) {
  std::vector<double> sums(5 * boundaries.size(), 0);
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    const Triple v = boundaries[b].velocity.value_or(Triple{});
    double* own = sums.data() + 5 * b;
    visit_faces(grid, boundaries[b].side, [&](const Vec3& area) {
      for (int m = 0; m < 3; ++m) own[m] += area[m];
      own[3] += norm(area);
      own[4] += std::abs(dot(area, Vec3{v[0], v[1], v[2]}));
    });
  }
  grid.comm().sum(sums.data(), static_cast<int>(sums.size()));
  std::vector<SideFlux> sides(boundaries.size());
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    const double* own = sums.data() + 5 * b;
    SideFlux& side = sides[b];
    side.outward = {own[0], own[1], own[2]};
    side.area = own[3];
    side.through = own[4];
    const auto& s = boundaries[b];
    if (s.velocity)
      for (int m = 0; m < 3; ++m) side.flux += (*s.velocity)[m] * side.outward[m];
    else if (s.type == Type::velocity_inlet)
      side.flux = -s.speed * std::hypot(own[0], own[1], own[2]);
  }
  return sides;
}

void check_moving_walls(const std::vector<BoundarySettings>& boundaries, const std::vector<SideFlux>& sides) {
  constexpr double rounding = 1e-5;  // of the speed: node coordinates may come from a file in single precision
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    if (boundaries[b].type != Type::moving_wall) continue;
    const Triple& v = *boundaries[b].velocity;
    const double across = sides[b].through / sides[b].area;
    if (across <= rounding * std::hypot(v[0], v[1], v[2])) continue;
    throw InputError(fmt::format(
        "boundary.{}.velocity_mm_per_s = [{:.4g}, {:.4g}, {:.4g}]: a moving wall must not move through itself, and {} would "
        "with {:.3g} mm/s on average; give a velocity along the wall, or make the side a \"velocity_inlet\"",
        b, v[0] / units::mm_per_s, v[1] / units::mm_per_s, v[2] / units::mm_per_s, name_of(boundaries[b].side), across / units::mm_per_s));
  }
}

/// Times between which every factor is linear in time.
std::vector<double> corners_in_time(const std::vector<BoundarySettings>& boundaries) {
  std::vector<double> times{0};
  for (const auto& s : boundaries) {
    if (s.ramp_us > 0) times.push_back(s.ramp_us);
    for (const auto& row : s.time_table) times.push_back(row[0]);
  }
  return times;
}

[[noreturn]] void refuse_net_flux(const std::vector<BoundarySettings>& boundaries, const std::vector<SideFlux>& sides, double time,
                                  double net) {
  std::vector<std::string> parts;
  double steady = 0;
  int last = -1;
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    if (boundaries[b].type != Type::velocity_inlet) continue;
    const double flux = time_factor(boundaries[b], time) * sides[b].flux;
    parts.push_back(fmt::format("{:.4g} um3/us {} through {} (boundary.{}.velocity_mm_per_s)", std::abs(flux), flux > 0 ? "out" : "in",
                                name_of(boundaries[b].side), b));
    steady += sides[b].flux;
    if (!boundaries[b].velocity) last = static_cast<int>(b);
  }
  std::string remedy = "make one of these sides \"outflow\"";
  if (std::abs(steady) < 1e-3 * std::abs(net))
    remedy += ", or give them ramp_us and time_table that agree";
  else if (last >= 0)
    remedy +=
        fmt::format(", or let them cancel, for example with boundary.{}.velocity_mm_per_s = {:.6g}", last,
                    (boundaries[last].speed + steady / std::hypot(sides[last].outward[0], sides[last].outward[1], sides[last].outward[2])) /
                        units::mm_per_s);
  throw InputError(
      fmt::format("boundary: the prescribed velocities do not conserve volume: at {:.4g} us {}, a net flux of {:.4g} um3/us {} that has no "
                  "other way {}; {}",
                  time, fmt::join(parts, ", "), std::abs(net), net > 0 ? "out" : "in", net > 0 ? "in" : "out", remedy));
}

}  // namespace

void check_prescribed_flow(const Grid& grid, const std::vector<BoundarySettings>& boundaries) {
  const auto of_type = [&](Type type) {
    return std::any_of(boundaries.begin(), boundaries.end(), [&](const auto& s) { return s.type == type; });
  };
  const bool walls = of_type(Type::moving_wall), inlets = of_type(Type::velocity_inlet);
  if (!walls && !inlets) return;
  const auto sides = measure_sides(grid, boundaries);
  check_moving_walls(boundaries, sides);
  if (!inlets || of_type(Type::outflow)) return;
  // Speeds that a user worked out from areas with four digits; the solver spreads what is left over the inlets.
  constexpr double balanced = 1e-3;
  double most = 0, worst = 0, when = 0;
  for (double t : corners_in_time(boundaries)) {
    double net = 0, gross = 0;
    for (std::size_t b = 0; b < boundaries.size(); ++b) {
      if (boundaries[b].type != Type::velocity_inlet) continue;
      const double flux = time_factor(boundaries[b], t) * sides[b].flux;
      net += flux, gross += std::abs(flux);
    }
    most = std::max(most, gross);
    if (std::abs(net) > std::abs(worst)) worst = net, when = t;
  }
  if (std::abs(worst) > balanced * most) refuse_net_flux(boundaries, sides, when, worst);
}

namespace {

/// The fastest that two opposite walls move past each other, um/us; other sides hold no fluid back.
double passing_speed(const BoundarySettings& a, const BoundarySettings& opposite, const std::vector<double>& times) {
  const auto at = [](const BoundarySettings& s, double time) {
    if (s.type != Type::moving_wall) return Vec3{};
    const Triple& v = *s.velocity;
    return time_factor(s, time) * Vec3{v[0], v[1], v[2]};
  };
  if (opposite.type != Type::wall && opposite.type != Type::moving_wall) return 0;
  double fastest = 0;
  for (const double time : times) fastest = std::max(fastest, norm(at(a, time) - at(opposite, time)));
  return fastest;
}

}  // namespace

std::string check_wall_strain(const Grid& grid, const std::vector<BoundarySettings>& boundaries, double step_us, bool viscous) {
  constexpr double most = 2;
  const double much = viscous ? 0.1 : 0.5;
  const auto moves = [](const BoundarySettings& s) { return s.type == Type::moving_wall; };
  if (std::none_of(boundaries.begin(), boundaries.end(), moves)) return "";
  const auto sides = measure_sides(grid, boundaries);
  const auto times = corners_in_time(boundaries);
  double worst = 0, speed = 0, apart = 0;
  std::size_t wall = 0;
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    if (!moves(boundaries[b])) continue;
    const int beyond = static_cast<int>(boundaries[b].side) ^ 1;
    const auto faces = [&](const BoundarySettings& s) { return static_cast<int>(s.side) == beyond; };
    const auto opposite = std::find_if(boundaries.begin(), boundaries.end(), faces);
    if (opposite == boundaries.end()) continue;
    const double distance = 2 * grid.total_volume() / (sides[b].area + sides[opposite - boundaries.begin()].area);
    const double past = passing_speed(boundaries[b], *opposite, times);
    if (past * step_us / distance > worst) worst = past * step_us / distance, speed = past, apart = distance, wall = b;
  }
  if (!(worst > much)) return "";
  const Triple& v = *boundaries[wall].velocity;
  const std::string text = fmt::format(
      "boundary.{}.velocity_mm_per_s = [{:.4g}, {:.4g}, {:.4g}]: {} moves past the opposite side, {:.3g} um away, with {:.4g} mm/s, which "
      "strains the fluid and the cells in it by {:.3g} in a step of {:g} us; {:g} is the most that a cell{} follows well, more than {:g} "
      "is refused: lower boundary.{}.velocity_mm_per_s (is it in mm/s?), or reduce time.step_us to {:.2g} us or less",
      wall, v[0] / units::mm_per_s, v[1] / units::mm_per_s, v[2] / units::mm_per_s, name_of(boundaries[wall].side), apart,
      speed / units::mm_per_s, worst, step_us, much, viscous ? " whose membrane is viscous" : "", most, wall,
      0.98 * step_us * much / worst);
  if (worst > most) throw InputError(text);
  return text;
}

void check_pressure_gradient(const Grid& grid, const Triple& gradient) {
  constexpr double rounding = 1e-3;  // of the gradient: coordinates and gradients are given with a few digits
  const Vec3 g{gradient[0], gradient[1], gradient[2]};
  // What is left of it without its parts along the periods, made orthogonal one after the other.
  Vec3 rest = g;
  std::vector<Vec3> basis;
  for (int d = 0; d < 3; ++d) {
    if (!grid.index().periodic[d]) continue;
    Vec3 p{grid.period(d)[0], grid.period(d)[1], grid.period(d)[2]};
    for (const Vec3& b : basis) p -= dot(p, b) * b;
    basis.push_back((1 / norm(p)) * p);
    rest -= dot(rest, basis.back()) * basis.back();
  }
  if (norm(rest) <= rounding * norm(g)) return;
  const Vec3 kept = g - rest;
  throw InputError(fmt::format(
      "fluid.pressure_gradient_Pa_per_um = [{:.4g}, {:.4g}, {:.4g}]: its part [{:.4g}, {:.4g}, {:.4g}] lies across the shifts between "
      "the periodic sides, where it drives nothing: {}",
      g.x, g.y, g.z, rest.x, rest.y, rest.z,
      norm(kept) > rounding * norm(g) ? fmt::format("the same flow comes from [{:.6g}, {:.6g}, {:.6g}]", kept.x, kept.y, kept.z)
                                      : std::string("give it along them, or make the sides that it points to periodic")));
}

namespace {

/// @returns the first row of the table between two steps that see nothing of it, or -1
int unseen_row(const BoundarySettings& s, const StepSchedule& schedule) {
  constexpr double share = 0.1;  // of the largest factor
  double largest = 0;
  for (const auto& row : s.time_table) largest = std::max(largest, std::abs(row[1]));
  std::size_t r = 0;
  for (long tick = 0; tick < schedule.end() && r < s.time_table.size();) {
    const long next = tick + schedule.ticks(tick);
    const double from = time_factor(s, schedule.time_us(tick)), to = time_factor(s, schedule.time_us(next));
    for (; r < s.time_table.size() && s.time_table[r][0] <= schedule.time_us(next); ++r) {
      const double value = s.time_table[r][1], beyond = std::max(value - std::max(from, to), std::min(from, to) - value);
      if (s.time_table[r][0] >= schedule.time_us(tick) && beyond > share * largest) return static_cast<int>(r);
    }
    tick = next;
  }
  return -1;
}

}  // namespace

void check_courses(const std::vector<BoundarySettings>& boundaries, const StepSchedule& schedule) {
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    const auto& s = boundaries[b];
    const double first = schedule.step_us(0);
    if (s.ramp_us > 0 && s.ramp_us < first * (1 - 1e-9))
      warn(
          "boundary.{}.ramp_us = {:g}: the first step, of {:g} us, is longer: the same as no ramp; reduce time.first_step_us or "
          "time.step_us to see it",
          b, s.ramp_us, first);
    if (s.time_table.empty()) continue;
    if (s.time_table.back()[0] < first * (1 - 1e-9))
      throw InputError(
          fmt::format("boundary.{}.time_table: all of its rows lie within the first step, of {:g} us: times are in us; "
                      "multiply those in seconds by 1e6, or reduce time.step_us",
                      b, first));
    const int row = unseen_row(s, schedule);
    if (row < 0) continue;
    const double at = s.time_table[row][0];
    double apart = 1e300;
    for (int other : {row - 1, row + 1})
      if (other >= 0 && other < static_cast<int>(s.time_table.size())) apart = std::min(apart, std::abs(s.time_table[other][0] - at));
    throw InputError(fmt::format(
        "boundary.{}.time_table: row {} ({:g} us, factor {:g}) lies between two steps that see nothing of it, so what it prescribes is "
        "lost: reduce time.step_us or time.first_step_us to {:.3g} us or less, or give a table that changes over several steps",
        b, row, at, s.time_table[row][1], 0.5 * apart));
  }
}

}  // namespace corpuscle
