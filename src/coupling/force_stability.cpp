// The steps that membranes that are forces can take.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/error.hpp"
#include "coupling/force_coupling.hpp"
#include "fluid/boundary_conditions.hpp"
#include "immersed/surface_geometry.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

/// Along index direction d: the grid's volume over the area that it is swept with.
double mean_spacing(const Grid& grid, int d) {
  const IndexSpace index = grid.index();
  const Components<double> area = grid.views().face_area[d];
  const double swept = sum_owned(
      "corpuscle::coupling::swept_area", index, KOKKOS_LAMBDA(int i, int j, int k) { return norm(load(area, index.cell(i, j, k))); });
  return grid.total_volume() / grid.comm().sum(swept);
}

}  // namespace

/// With three digits, none of them rounded up.
std::string ForceCoupling::rounded_down(double value) {
  if (!(value > 0) || !std::isfinite(value)) return fmt::format("{:.3g}", value);
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2);
  return fmt::format("{:.3g}", std::floor(value / unit * (1 + 1e-12)) * unit);
}

/// @throws InputError
void ForceCoupling::refuse_long_steps() {
  const double longest = *std::max_element(lengths_us_.begin(), lengths_us_.end());
  if (longest <= stable_us_) return;
  // What the fluid resists depends on the step: viscous membranes stand somewhat less in steps as long as this one allows.
  constexpr int rounds = 6;
  double allowed = stable_us_;
  for (int n = 0; n < rounds && membranes_->viscosity() && !packed_; ++n) {
    measure_stability(allowed);
    if (stable_us_ >= allowed) break;
    allowed = stable_us_;
  }
  throw InputError(
      fmt::format("time.step_us: steps of {:.5g} us are too long for these membranes, which move with the fluid: above about "
                  "{} us{} {} would swing and grow. Reduce time.step_us{}",
                  longest, rounded_down(allowed), scene_.coupling->slip ? " with the slip correction" : "",
                  least_stable_.empty() ? "they" : least_stable_,
                  scene_.coupling->slip ? "; without it they may be longer (coupling.slip = false)" : ""));
}

/// Of the largest stable step: up to there steps are of second order, which swing from two thirds of it on. With slip spheres and red cells
/// of 0.4 to 1.2 spacings an edge are sound up to 0.64 and grow from 0.73; without it, where the estimate of short waves has less to spare,
/// they are sound up to 0.50 and grow from 0.54 to 0.59.
double ForceCoupling::second_order_share() const { return scene_.coupling->slip ? 0.6 : 0.45; }

/// Forces and velocities are those at the step's end, where the last velocities bring the membranes, which then move by the
/// mean of the velocities at both ends: second order. Longer steps, beyond second_order_share() of the largest stable
/// one, would swing then: those are Euler's.
bool ForceCoupling::second_order(double dt) const { return dt <= second_order_share() * stable_us_; }

/// The viscosity that resists a membrane, over that outside: the mean of both sides' for waves along it, and never more than the
/// outer one, which is all that resists the slip. Without slip, whose dipoles stand for it, the harmonic one: of a thinner fluid inside a
/// wave about as short as cells of the grid has both fluids in each of them, where one bears after the other what shears across
/// (a tenth as viscous: steps of 0.24 of what the mean would stand are stable, 0.46 are not).
double ForceCoupling::resisting_share() const {
  double share = 1;
  for (const CellReference& type : membranes_->types()) {
    const double ratio = type.viscosity_ratio, mean = 0.5 * (1 + ratio);
    share = std::min(share, scene_.coupling->slip || ratio > 1 ? mean : ratio / mean);
  }
  return share;
}

/// Where beta alone stands for the fluid's answer, short waves wait for it, 1 / (beta m) steps where a wave's mobility is m.
void ForceCoupling::anticipate_short_waves(const MobilityModel& model, const std::vector<int>& numbers, Membranes& standing) {
  constexpr double share = 0.5;  // unstable above 4/3
  const double resistance = fluid_.grid().comm().max(standing.largest_resistance(model, numbers));
  short_waves_ = resistance > 0 ? share / resistance : 0;
  for (Membranes* each : {membranes_, &standing}) each->take_share_of_resistance(short_waves_);
}

/// Of a type's cells that start drawn out, no more than these stand for all: that drawn out most, and that pressed together most.
std::map<int, ForceCoupling::Kind> ForceCoupling::farthest(const std::map<int, Kind>& drawn_out) {
  std::map<int, Kind> longest, flattest, result;  // by type
  const auto share = [](const Triple& a, double of) { return of / std::cbrt(a[0] * a[1] * a[2]); };
  const auto most = [&](const Kind& kind) { return share(kind.second, std::max({kind.second[0], kind.second[1], kind.second[2]})); };
  const auto least = [&](const Kind& kind) { return share(kind.second, std::min({kind.second[0], kind.second[1], kind.second[2]})); };
  for (const auto& [number, kind] : drawn_out) {
    const auto longer = longest.try_emplace(kind.first, kind).first, flatter = flattest.try_emplace(kind.first, kind).first;
    if (most(kind) > most(longer->second)) longer->second = kind;
    if (least(kind) < least(flatter->second)) flatter->second = kind;
  }
  for (const auto& [number, kind] : drawn_out)
    if (kind == longest.at(kind.first) || kind == flattest.at(kind.first)) result.emplace(number, kind);
  return result;
}

/// Cells that start drawn out may be stiffer than others of their type.
ForceCoupling::Kind ForceCoupling::kind_of(const CellRecord& cell) const {
  const auto found = drawn_out_.find(cell.number);
  return found == drawn_out_.end() ? Kind{cell.type, {1, 1, 1}} : found->second;
}

/// Of each of this rank's cells the least and the largest of what the grid's spacings along a direction, um, are over its vertices in the
/// mean: the narrowest that a cell of a tube reaches have too little say to be waited for, but where all of them are narrow, as inside a
/// bend, that cell is.
std::vector<std::pair<double, double>> ForceCoupling::mean_spacings() {
  const Components<double> spacings("corpuscle::coupling::spacings", surfaces().vertices, 3);
  spacings_at(transfer_->block(), transfer_->views(), spacings);
  cells_->add_copies(spacings);
  const auto at = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), spacings);
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces().first_vertex);
  const auto& own = cells_->own();
  std::vector<std::pair<double, double>> of_cell(own.size(), {1e30, 0});  // the least and the largest mean
  for (std::size_t c = 0; c < own.size(); ++c)
    for (int d = 0; d < 3; ++d) {
      double sum = 0;
      for (int v = first(c); v < first(c + 1); ++v) sum += at(v, d);
      const double mean = sum / (first(c + 1) - first(c));
      of_cell[c] = {std::min(of_cell[c].first, mean), std::max(of_cell[c].second, mean)};
    }
  return of_cell;
}

/// Slip grows with the spacing: of each kind the first cell, that in the narrowest and that in the widest spacings stand for all, the same
/// ones on any number of ranks.
ForceCoupling::Spacings ForceCoupling::spacings_of_cells() {
  constexpr double rounding = 1e-9, none = std::numeric_limits<int>::max();
  const auto& own = cells_->own();
  const auto of_cell = mean_spacings();
  const Comm& comm = fluid_.grid().comm();
  std::set<Kind> kinds;
  for (std::size_t t = 0; t < membranes_->types().size(); ++t) kinds.insert({static_cast<int>(t), {1, 1, 1}});
  for (const auto& [number, kind] : drawn_out_) kinds.insert(kind);
  Spacings result;
  for (const Kind& kind : kinds) {
    double narrowest = 1e30, widest = 0;
    for (std::size_t c = 0; c < own.size(); ++c)
      if (kind_of(own[c]) == kind) narrowest = std::min(narrowest, of_cell[c].first), widest = std::max(widest, of_cell[c].second);
    narrowest = comm.min(narrowest), widest = comm.max(widest);
    if (widest == 0) continue;  // no cell is of it
    result.narrowest = std::min(result.narrowest, narrowest), result.widest = std::max(result.widest, widest);
    double number[3] = {none, none, none};
    for (std::size_t c = 0; c < own.size(); ++c) {
      if (kind_of(own[c]) != kind) continue;
      const bool stands[3] = {true, of_cell[c].first <= narrowest * (1 + rounding), of_cell[c].second >= widest * (1 - rounding)};
      for (int n = 0; n < 3; ++n)
        if (stands[n]) number[n] = std::min(number[n], static_cast<double>(own[c].number));
    }
    std::set<int> standing;
    for (const double n : number) standing.insert(static_cast<int>(comm.min(n)));
    result.numbers.emplace_back(standing.begin(), standing.end());
  }
  return result;
}

/// Forward Euler in a fluid whose viscosity alone resists: stable while dt times the fastest rate of relaxation is below two.
/// The rate is that of mobility times stiffness: the vertices' hydrodynamic interaction in an unbounded fluid, smeared over the
/// kernel, and the slip, which has no interaction and is largest for the finest modes. A quarter less, since a load stiffens the
/// membrane: two cells pressed together broke within 24 steps as long as the estimate, and within 68 of 0.9 times that. Dipoles of
/// one plane wave give half a spacing; capsules of a tenth to a fifth of the viscosity outside swing as if they gave two. Membrane
/// viscosity lets steps be up to 1500 times as long, as far as plane waves go; of spheres of 5 to 1000 uN/m, 1e-18 to 2e-16 J and 1e-8 to
/// 1e-6 N s/m, in which bending, that it does not resist, and stretching act together, with slip all were sound at 0.02 of that and one
/// grew slowly at 0.03: a fiftieth of it counts, where that is more than what they stand without. Each kind of cell by itself: some may
/// have no viscosity.
/// @param longest_us  of the steps, which the fluid's resistance depends on
void ForceCoupling::measure_stability(double longest_us) {
  constexpr double limit = 1.5, of_dipoles = 2, of_viscous = 50;
  update_surface_geometry(surfaces());
  transfer_->place(surfaces().x);
  const Comm& comm = fluid_.grid().comm();
  const auto [narrowest, widest, numbers] = spacings_of_cells();
  std::vector<int> all;
  for (const auto& of_kind : numbers) all.insert(all.end(), of_kind.begin(), of_kind.end());
  const auto standing = membranes_->only(all);
  update_surface_geometry(standing->surfaces());
  MobilityModel model;
  model.viscosity = fluid_.viscosity() * resisting_share();
  model.radius = transfer_->marker_radius() * narrowest;
  if (scene_.coupling->slip) {
    for (auto& column : model.slip) column = Components<double>("corpuscle::coupling::slip", surfaces().vertices, 3);
    slip_columns(transfer_->block(), slip_of_membranes(), transfer_->views(), model.slip);
    for (auto& column : model.slip) {
      cells_->add_copies(column);
      column = membranes_->rows_of(all, column);
    }
    model.dipole = of_dipoles * transfer_->largest_dipole() * resisting_share() * widest;
    model.width = 0.8 * narrowest;
  }
  // Of the longest step: shorter ones meet more inertia, by less than they are shorter.
  const double beta = anticipated_reaction(longest_us);
  anticipate_short_waves(model, all, *standing);
  held_rate_ = comm.max(standing->fastest_held_relaxation_per_us(all, beta));
  double fastest = 0;
  for (const auto& of_kind : numbers) {
    double rate = comm.max(standing->fastest_relaxation_per_us(model, of_kind));
    if (membranes_->viscosity()) rate = std::min(rate, of_viscous * comm.max(standing->fastest_relaxation_per_us(model, of_kind, beta)));
    if (rate > fastest) {
      fastest = rate;
      least_stable_ = membranes_->name_of(of_kind.front());
      if (drawn_out_.count(of_kind.front()) > 0) least_stable_ += ", drawn out by its start_stretch,";
    }
  }
  if (numbers.size() < 2) least_stable_.clear();
  const double of_loads = loads_ ? comm.max(loads_->fastest_relaxation_per_us()) : 0;
  if (of_loads > fastest) fastest = of_loads, least_stable_.clear();
  stable_us_ = limit / fastest;
}

std::string ForceCoupling::stability_text(double dt) const {
  const double longest = *std::max_element(lengths_us_.begin(), lengths_us_.end());
  const auto order = [this](double step) { return second_order(step) ? "second" : "first"; };
  const std::string steps = longest > dt ? fmt::format("steps of {:.3g} us, of {} order, and up to {:.3g} us, of {} order", dt, order(dt),
                                                       longest, order(longest))
                                         : fmt::format("steps of {:.3g} us, of {} order", dt, order(dt));
  return fmt::format("coupling: {}; membranes that move with the fluid are stable up to about {} us{}", steps, rounded_down(stable_us_),
                     scene_.coupling->slip ? " with the slip correction (coupling.slip)" : "");
}

std::map<std::string, double> ForceCoupling::report(double dt) const {
  std::map<std::string, double> figures{{"largest_stable_step_us", stable_us_}, {"margin", stable_us_ / dt}};
  if (contact_report()) figures["contact_linear_below_um"] = loads_->knee_um(dt);
  return figures;
}

/// How the fluid's force on membranes changes with their velocity, per area, where it does so least: the largest deformation of
/// one cell alone (a quadrupole of its size), or of all cells together, as the longest shear wave that the grid has room for.
double ForceCoupling::anticipated_reaction(double dt) const {
  const Softest& s = softest_;
  if (s.area == 0) return 0;
  const double mu = resisting_share() * fluid_.viscosity(), rho = fluid_.settings().density_pg_per_um3;
  const double depth = fluid_.grid().total_volume() / s.area;
  return std::min(3 * mu / s.radius, depth * (mu * s.wave_number_square + rho / dt));
}

/// Of what changed in the last step, for the next. With all of it nothing would be late, but what is wrong at first, late by n steps
/// without it, would swing for as long; with `most` it dies away in ten steps, and what grows is late by n / 10. In steps shorter than
/// the fluid inside and around a cell takes to follow its membrane, the fluid's velocity is that of several steps together, and what
/// they changed comes on top of itself: with more than is carried on here it grows, by up to a tenth a step (found of plane waves along
/// a viscous membrane in a grid, for radii, viscosities and spacings of cells and steps 500 times apart). And in steps that are long
/// beside the time in which the membrane relaxes against its own viscosity, what it springs back by comes on top: of a mode with
/// f' = a (f + c (f - f'')) - s x, x' = x + dt m f' (Membranes::fastest_relaxation() has a and s; c is carried on) the largest stable
/// dt times that rate is 0.15, 0.30, 0.52, 0.78, 1.2 for c = 0.9, 0.8, 0.7, 0.6, 0.45, whatever its mobility, where its own viscosity is
/// nearly all that resists, and more as its share falls.
double ForceCoupling::carried_on(double dt) const {
  constexpr double least = 0.45, most = 0.9;
  const double mu = resisting_share() * fluid_.viscosity(), rho = fluid_.settings().density_pg_per_um3;
  const double to_follow = 0.14 * rho * softest_.radius * softest_.radius / mu;
  return std::max(0.0, std::min(std::clamp(1 - to_follow / dt, least, most), 1 - held_rate_ * dt));
}

void ForceCoupling::find_softest() {
  if (!membranes_->viscosity()) return;
  softest_ = {};
  const double pi = std::acos(-1.0);
  const Grid& grid = fluid_.grid();
  double largest = 0;
  for (const auto& cell : membranes_->diagnostics()) {
    softest_.area += cell.area_um2;
    largest = std::max(largest, cell.area_um2);
  }
  softest_.area = grid.comm().sum(softest_.area);
  softest_.radius = std::sqrt(grid.comm().max(largest) / (4 * pi));
  const WallSides walls = walls_of(scene_.boundaries);
  double longest = 0, square = 0;
  for (int d = 0; d < 3; ++d) {
    const double length = grid.index().global[d] * mean_spacing(grid, d);
    longest = std::max(longest, length);
    if (walls.wall[d][0] && walls.wall[d][1]) square += std::pow(pi / length, 2);
  }
  softest_.wave_number_square = square > 0 ? square : std::pow(2 * pi / longest, 2);
}

/// Slip is stiff: all that grows with the stiffness is left to the grid's velocity once a step could no longer follow.
void ForceCoupling::limit_slip(double dt) {
  const double most = (second_order(dt) ? second_order_share() : 1.0) * stable_us_ / dt;
  const Array<double> share(followed_.data(), followed_.extent(0));
  membranes_->measure_stiffening(share);
  corpuscle::limit_slip(membranes_->vertices(), most, share);
  cells_->to_copies(followed_);
}

}  // namespace corpuscle
