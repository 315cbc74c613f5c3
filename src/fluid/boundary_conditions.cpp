#include "fluid/boundary_conditions.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

using Type = BoundarySettings::Type;

int fill_order(Type type) {
  switch (type) {
    case Type::outflow:
      return 0;
    case Type::symmetry:
      return 1;
    case Type::velocity_inlet:
      return 2;
    default:
      return 3;
  }
}

double interpolate(const std::vector<std::array<double, 2>>& table, double at) {
  if (at <= table.front()[0]) return table.front()[1];
  for (std::size_t i = 1; i < table.size(); ++i)
    if (at <= table[i][0]) {
      const double s = (at - table[i - 1][0]) / (table[i][0] - table[i - 1][0]);
      return table[i - 1][1] + s * (table[i][1] - table[i - 1][1]);
    }
  return table.back()[1];
}

bool is_wall_type(Type type) { return type == Type::wall || type == Type::moving_wall; }

bool is_box(const GridSettings* grid) { return grid && grid->generator == GridSettings::Generator::box; }

/// Parabola between two opposite sides: zero at walls, flat where a side is symmetric or periodic.
/// @param from_middle  place, -1 at the lower side, 1 at the upper one
double parabola(double from_middle, bool wall_below, bool wall_above) {
  if (!wall_below && !wall_above) return 1;
  double s = from_middle;
  if (!wall_below) s = 0.5 * (1 + from_middle);
  if (!wall_above) s = 0.5 * (1 - from_middle);
  return 1 - s * s;
}

/// Velocity profile over a side, before it is scaled to the wanted mean: 1 on average is not needed here.
/// @param types  of the six sides
double shape_factor(const BoundarySettings& s, const GridSettings* grid, const Type (&types)[6], const Triple& x, const Triple& centre,
                    double radius, int d) {
  if (s.profile == BoundarySettings::Profile::uniform) return 1;
  if (s.profile == BoundarySettings::Profile::parabolic && is_box(grid)) {
    double factor = 1;
    for (int e = 0; e < 3; ++e) {
      if (e == d) continue;
      const double half = 0.5 * (grid->upper_um[e] - grid->lower_um[e]);
      const double from_middle = (x[e] - grid->lower_um[e]) / half - 1;
      factor *= parabola(from_middle, is_wall_type(types[2 * e]), is_wall_type(types[2 * e + 1]));
    }
    return factor;
  }
  double square = 0;
  for (int e = 0; e < 3; ++e) square += (x[e] - centre[e]) * (x[e] - centre[e]);
  const double r = std::sqrt(square) / radius;
  if (s.profile == BoundarySettings::Profile::table) return interpolate(s.radial_table, r);
  return std::max(0.0, 1 - r * r);
}

}  // namespace

BoundaryConditions::BoundaryConditions(Grid& grid, const std::vector<BoundarySettings>& settings, const GridSettings* shape)
    : grid_(&grid), outflow_("corpuscle::fluid::outflow_mask", grid.index().size()) {
  const IndexSpace& index = grid.index();
  for (std::size_t b = 0; b < settings.size(); ++b) {
    const auto& s = settings[b];
    types_[static_cast<int>(s.side)] = s.type;
    if (s.type == Type::periodic) continue;
    Side side;
    side.settings = s;
    side.number = static_cast<int>(b);
    side.d = static_cast<int>(s.side) / 2;
    side.end = static_cast<int>(s.side) % 2;
    side.here = grid.halo().neighbour(side.d, side.end) < 0;
    for (int e = 0; e < 3; ++e) {
      side.box.lower[e] = grid.halo().neighbour(e, 0) < 0 ? -1 : -IndexSpace::halo;
      side.box.upper[e] = index.n[e] + (grid.halo().neighbour(e, 1) < 0 ? 1 : IndexSpace::halo);
    }
    side.box.lower[side.d] = side.end == 0 ? -1 : index.n[side.d];
    side.box.upper[side.d] = side.box.lower[side.d] + 1;
    side.inner = side.box;
    for (int e = 0; e < 3; ++e) {
      if (e == side.d) continue;
      if (grid.halo().neighbour(e, 0) < 0) side.inner.lower[e] = 0;
      if (grid.halo().neighbour(e, 1) < 0) side.inner.upper[e] = index.n[e];
    }
    side.inward = side.end == 0 ? index.stride(side.d) : -index.stride(side.d);
    side.to_face = side.end == 0 ? index.stride(side.d) : 0;
    side.faces = {{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}};
    side.faces.lower[side.d] = side.end == 0 ? 0 : index.n[side.d];
    side.faces.upper[side.d] = side.faces.lower[side.d] + 1;
    sides_.push_back(side);
    prescribed_ = prescribed_ || s.type == Type::velocity_inlet || s.type == Type::moving_wall;
    has_outflow_ = has_outflow_ || s.type == Type::outflow;
    has_inlet_ = has_inlet_ || s.type == Type::velocity_inlet;
    natural_[side.d][side.end] = s.type == Type::outflow || s.type == Type::symmetry;
  }
  std::stable_sort(sides_.begin(), sides_.end(),
                   [](const Side& a, const Side& b) { return fill_order(a.settings.type) < fill_order(b.settings.type); });
  set_prescribed();
  if (prescribed_) {
    profile_ = Components<double>("corpuscle::fluid::boundary_profile", index.size(), 3);
    given_ = Components<double>("corpuscle::fluid::boundary_velocity", index.size(), 3);
  }
  for (const auto& side : sides_) {
    if (side.settings.type == Type::velocity_inlet || side.settings.type == Type::moving_wall) set_profile(side, shape);
    if (side.settings.type == Type::outflow && side.here) {
      // Edges belong to the neighbouring sides: only faces of the outflow itself carry a pressure.
      mark_box(index, side.inner, outflow_);
    }
  }
  set_time(0);
}

/// Boxes of the sides whose velocity is given. A node that two of them share is left to the one that is filled last.
void BoundaryConditions::set_prescribed() {
  const auto is_given = [](const Side& side) { return side.here && fill_order(side.settings.type) >= fill_order(Type::velocity_inlet); };
  for (std::size_t n = 0; n < sides_.size(); ++n) {
    if (!is_given(sides_[n])) continue;
    CellBox box = sides_[n].box;
    for (std::size_t later = n + 1; later < sides_.size(); ++later) {
      const Side& other = sides_[later];
      if (!is_given(other) || other.d == sides_[n].d) continue;
      if (other.end == 0)
        box.lower[other.d] = 0;
      else
        box.upper[other.d] = grid_->index().n[other.d];
    }
    given_boxes_.zero[given_boxes_.boxes.count] = sides_[n].settings.type == Type::wall;
    given_boxes_.boxes.add(box);
  }
}

/// A parabola is known for boxes between walls, symmetric and periodic sides, and for round inlets within walls.
/// @param centre, radius  of the inlet, um: no point of it is farther from the centre
void BoundaryConditions::check_parabolic(const Side& side, bool box, const Triple& centre, double radius) const {
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("boundary.{}.profile = \"parabolic\": {}; use \"uniform\"{}", side.number, why,
                                 box ? "" : ", or \"table\" with a radial_table"));
  };
  bool walls = true;
  for (int other = 0; other < 6; ++other) {
    if (other / 2 == side.d) continue;
    walls = walls && is_wall_type(types_[other]);
    if (box && (types_[other] == Type::velocity_inlet || types_[other] == Type::outflow))
      refuse("a side beside it lets fluid in or out, and what the flow looks like there is not known");
  }
  if (box) return;
  constexpr double round = 0.95;  // the rim is a polygon: 0.966 with twelve corners
  const IndexSpace& index = grid_->index();
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_->views().x);
  double least = radius;
  for (int e = 0; e < 3 && side.here; ++e)
    for (int end = 0; e != side.d && end < 2; ++end) {
      if (grid_->halo().neighbour(e, end) >= 0) continue;
      CellBox rim = side.box;
      for (int f = 0; f < 3; ++f)
        if (f != side.d) rim.lower[f] = 0, rim.upper[f] = index.n[f];
      rim.lower[e] = end == 0 ? -1 : index.n[e];
      rim.upper[e] = rim.lower[e] + 1;
      for (int k = rim.lower[2]; k < rim.upper[2]; ++k)
        for (int j = rim.lower[1]; j < rim.upper[1]; ++j)
          for (int i = rim.lower[0]; i < rim.upper[0]; ++i) {
            const int c = index.cell(i, j, k);
            least = std::min(least, std::hypot(x(c, 0) - centre[0], x(c, 1) - centre[1], x(c, 2) - centre[2]));
          }
    }
  if (!walls || grid_->comm().min(least) < round * radius)
    refuse("this inlet is not a disc within walls, and another shape's profile is not known on such a grid");
}

void BoundaryConditions::set_profile(const Side& side, const GridSettings* shape) {
  const IndexSpace& index = grid_->index();
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_->views().x);
  const auto area = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_->views().face_area[side.d]);
  const auto visit = [&](bool with_edges, const auto& body) {
    if (!side.here) return;
    CellBox box = side.box;
    if (!with_edges)
      for (int e = 0; e < 3; ++e)
        if (e != side.d) box.lower[e] = 0, box.upper[e] = index.n[e];
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
      for (int j = box.lower[1]; j < box.upper[1]; ++j)
        for (int i = box.lower[0]; i < box.upper[0]; ++i) body(index.cell(i, j, k));
  };
  const auto point = [&](int c) { return Triple{x(c, 0), x(c, 1), x(c, 2)}; };
  const double inward = side.end == 0 ? 1.0 : -1.0;

  double sums[7] = {0, 0, 0, 0, 0, 0, 0};  // area vector, area, area times centre
  visit(false, [&](int c) {
    double s[3], square = 0;
    for (int m = 0; m < 3; ++m) s[m] = inward * area(c + side.to_face, m), square += s[m] * s[m];
    for (int m = 0; m < 3; ++m) sums[m] += s[m], sums[4 + m] += std::sqrt(square) * x(c, m);
    sums[3] += std::sqrt(square);
  });
  grid_->comm().sum(sums, 7);
  const Triple centre{sums[4] / sums[3], sums[5] / sums[3], sums[6] / sums[3]};
  const double flat = std::sqrt(sums[0] * sums[0] + sums[1] * sums[1] + sums[2] * sums[2]);
  double radius = 0;
  visit(true, [&](int c) {
    double square = 0;
    for (int m = 0; m < 3; ++m) square += (x(c, m) - centre[m]) * (x(c, m) - centre[m]);
    radius = std::max(radius, std::sqrt(square));
  });
  radius = grid_->comm().max(radius);

  if (side.settings.profile == BoundarySettings::Profile::parabolic) check_parabolic(side, is_box(shape), centre, radius);
  Triple direction{sums[0] / flat, sums[1] / flat, sums[2] / flat};
  double scale = side.settings.speed;
  const bool fixed = side.settings.velocity.has_value();
  if (fixed) {
    direction = *side.settings.velocity;
    scale = 1;
  } else {
    double flux = 0;  // of the profile with unit speed
    visit(false, [&](int c) {
      for (int m = 0; m < 3; ++m)
        flux += shape_factor(side.settings, shape, types_, point(c), centre, radius, side.d) * direction[m] * inward *
                area(c + side.to_face, m);
    });
    flux = grid_->comm().sum(flux);
    if (!(flux > 0))
      throw InputError(
          fmt::format("boundary.{}.radial_table: this inlet profile carries no flow: its speeds must be positive on "
                      "average over the side",
                      side.number));
    scale *= flat / flux;
  }
  auto profile = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), profile_);
  double largest = 0;
  visit(true, [&](int c) {
    const double factor = scale * (fixed ? 1 : shape_factor(side.settings, shape, types_, point(c), centre, radius, side.d));
    for (int m = 0; m < 3; ++m) profile(c, m) = factor * direction[m];
    largest = std::max(largest, std::hypot(profile(c, 0), profile(c, 1), profile(c, 2)));
  });
  Kokkos::deep_copy(profile_, profile);
  double strongest = 1;
  for (const auto& row : side.settings.time_table) strongest = std::max(strongest, std::abs(row[1]));
  largest_speed_ = std::max(largest_speed_, strongest * grid_->comm().max(largest));
}

WallSides walls_of(const std::vector<BoundarySettings>& boundaries) {
  using Type = BoundarySettings::Type;
  WallSides walls;
  for (const auto& boundary : boundaries) {
    const int side = static_cast<int>(boundary.side);
    walls.wall[side / 2][side % 2] = boundary.type == Type::wall || boundary.type == Type::moving_wall;
  }
  return walls;
}

double time_factor(const BoundarySettings& s, double t) {
  const double ramp = s.ramp_us > 0 ? std::clamp(t / s.ramp_us, 0.0, 1.0) : 1.0;
  return ramp * (s.time_table.empty() ? 1.0 : interpolate(s.time_table, t));
}

void BoundaryConditions::set_time(double t) {
  for (const auto& side : sides_) {
    const Type type = side.settings.type;
    if (side.here && (type == Type::velocity_inlet || type == Type::moving_wall))
      scale_profile(grid_->index(), side.box, profile_, time_factor(side.settings, t), given_);
  }
}

template <class Velocity>
void BoundaryConditions::fill_sides(const Velocity& u, bool homogeneous) const {
  const IndexSpace& index = grid_->index();
  for (const auto& side : sides_) {
    if (!side.here) continue;
    if (side.settings.type == Type::outflow) fill_outflow(index, side.box, side.inward, u);
    if (side.settings.type == Type::symmetry)
      fill_symmetry(index, side.box, side.inner, side.inward, side.to_face, grid_->views().face_area[side.d], u);
  }
  fill_given(index, given_boxes_, homogeneous, given_, u);
}

template void BoundaryConditions::fill_sides(const Components<double>&, bool) const;
template void BoundaryConditions::fill_sides(const Components<float>&, bool) const;

void BoundaryConditions::clear_natural(const Components<float>& u) const {
  for (const auto& side : sides_)
    if (side.here && natural_[side.d][side.end]) fill_zero(grid_->index(), side.box, u);
}

void BoundaryConditions::close_moving_walls(const Array<double> (&flux)[3]) const {
  for (const auto& side : sides_)
    if (side.here && side.settings.type == Type::moving_wall) clear_flux(grid_->index(), side.faces, flux[side.d]);
}

double BoundaryConditions::balance(const Array<double> (&flux)[3], double growth) const {
  double sums[2] = {0, 0};
  const auto visit = [&](const auto& body) {
    for (const auto& side : sides_)
      if (side.here && side.settings.type == Type::velocity_inlet)
        body(side, side.end == 0 ? -1.0 : 1.0, grid_->views().face_area[side.d], flux[side.d]);
  };
  visit([&](const Side& side, double outward, const Components<double>& area, const Array<double>& f) {
    const auto part = side_flux(grid_->index(), side.faces, outward, area, f);
    sums[0] += part.flux, sums[1] += part.area;
  });
  grid_->comm().sum(sums, 2);
  const double per_area = (growth - sums[0]) / sums[1];
  visit([&](const Side& side, double outward, const Components<double>& area, const Array<double>& f) {
    spread_flux(grid_->index(), side.faces, outward * per_area, area, f);
  });
  return std::abs(per_area);
}

std::string BoundaryConditions::bounded_by(int side) const {
  switch (types_[side]) {
    case Type::velocity_inlet:
      return "an inlet";
    case Type::symmetry:
      return "a symmetry side";
    default:
      return is_wall_type(types_[side]) ? "a wall" : "";
  }
}

}  // namespace corpuscle
