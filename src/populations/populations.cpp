#include "populations/populations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cells/rank_blocks.hpp"
#include "core/error.hpp"
#include "coupling/periodic_frame.hpp"
#include "populations/first_places.hpp"

namespace corpuscle {

namespace {

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

std::string section(std::size_t population) { return fmt::format("populations.{}", population); }

std::string amount(const PopulationSettings& p, std::size_t number) {
  return p.count > 0 ? fmt::format("{}.count = {}", section(number), p.count)
                     : fmt::format("{}.hematocrit = {:g}", section(number), p.hematocrit);
}

/// Makes the bodies of a scene and packs them.
class Packer {
 public:
  Packer(const Case& scene, const Grid& grid, const CellPlaces& places, const std::vector<int>& types)
      : scene_(scene), places_(places), types_(types), volume_(grid.total_volume()), source_(make_node_source(*scene.grid)) {
    space_.frame = periodic_frame(grid);
    space_.shifts = period_shifts(grid);
    for (const auto& p : scene.populations) {
      PackingLimits limits;
      if (p.lower_um) limits.lower = vec(*p.lower_um);
      if (p.upper_um) limits.upper = vec(*p.upper_um);
      space_.limits.push_back(limits);
      reach_ = std::max(reach_, p.gap_um + PackingSpace::spare);
    }
    for (const CellReference& type : places.types) shapes_.emplace_back(type.mesh, reach_ + 0.05);
    walls_ = std::make_unique<PackingWalls>(*scene.grid, source_, space_.frame, std::max(1.0, 2 * reach_));
    space_.walls = walls_.get();
  }

  PackedCells pack() {
    count();
    RigidPacking packing(shapes_, start(), space_, scale_);
    if (!packing.grow() && !(may_deform() && packing.shrink(least_size()))) refuse(packing);
    PackedCells packed;
    packed.size = packing.scale();
    packed.count = wanted_;
    for (const PackedBody& body : packing.bodies()) {
      if (!body.movable) continue;
      CellPlace place;
      place.type = body.shape;
      place.center_um = {body.center.x, body.center.y, body.center.z};
      set_direction(body.rotation, place.axis, place.spin_deg);
      packed.cells.push_back(place);
    }
    return packed;
  }

 private:
  double cell_volume(std::size_t population) const { return places_.types[types_[population]].law.rest_volume; }

  /// Membranes grow on, and bend, where contact holds them apart; placed cells are not to change.
  bool may_deform() const { return scene_.contact && scene_.cells.empty(); }

  /// From which membranes grow; in a capillary narrower than the cell that is how far they fold.
  double least_size() const {
    const double wide = scene_.grid->diameter_um;
    return wide > 0 && 2 * largest_radius() > wide ? 0.55 : 0.75;
  }

  void count() {
    double share = 0, balls = 0;
    for (std::size_t p = 0; p < types_.size(); ++p) {
      wanted_.push_back(population_count(scene_.populations[p], static_cast<int>(p), volume_, cell_volume(p)));
      share += wanted_[p] * cell_volume(p) / volume_;
      balls += wanted_[p] * 4.0 / 3 * std::acos(-1.0) * std::pow(shapes_[types_[p]].radius(), 3) / volume_;
    }
    if (share > most_share)
      throw InputError(fmt::format("{}: {} alone would be {:.2f} of the fluid's volume, more than fit in any way: ask for less",
                                   amount(scene_.populations[0], 0), types_.size() > 1 ? "the cells of all populations" : "its cells",
                                   share));
    constexpr double loose = 0.15;  // of the volume, of balls around them: chance finds places for these at once
    // Rounded, since the volume's last bits depend on the ranks that sum it up.
    scale_ = std::min(1.0, 1e-3 * std::floor(1e3 * std::cbrt(loose / balls)));
  }

  std::vector<PackedBody> start() const {
    std::vector<PackedBody> bodies;
    for (const CellPlace& cell : places_.cells) {
      PackedBody body;
      body.shape = cell.type;
      body.movable = body.turns = false;
      body.center = vec(cell.center_um);
      body.rotation = rotation_of(cell.axis, cell.spin_deg);
      bodies.push_back(body);
    }
    const PointsOfGrid points(source_);
    Neighbourhood before(space_.shifts, 2 * largest_radius());
    for (const PackedBody& body : bodies) before.add(body.center, shapes_[body.shape].radius());
    for (std::size_t p = 0; p < types_.size(); ++p) {
      const PopulationSettings& population = scene_.populations[p];
      Chance chance(static_cast<std::uint64_t>(population.seed) * 1000003 + p);
      for (int n = 0; n < wanted_[p]; ++n) {
        bodies.push_back(first_place(points, chance, p, before));
        before.add(bodies.back().center, scale_ * shapes_[types_[p]].radius());
      }
    }
    return bodies;
  }

  PackedBody first_place(const PointsOfGrid& points, Chance& chance, std::size_t p, const Neighbourhood& before) const {
    constexpr int tries = 1000, tries_in_box = 20000;
    const PopulationSettings& population = scene_.populations[p];
    PackedBody body;
    body.shape = types_[p];
    body.group = static_cast<int>(p);
    body.gap = population.gap_um;
    body.turns = population.orientation == PopulationSettings::Orientation::random;
    body.rotation = body.turns ? chance.rotation() : rotation_of(population.axis, 360 * chance.share());
    const PackingLimits& limits = space_.limits[p];
    const auto within = [&](const Vec3& x) {
      for (int d = 0; d < 3; ++d)
        if (x[d] < limits.lower[d] || x[d] > limits.upper[d]) return false;
      return true;
    };
    int outside = 0;
    for (int n = 0; n < tries; ++n) {
      do {
        body.center = points.next(chance);
        if (++outside > tries_in_box + 100 * n)
          throw InputError(fmt::format("{}: next to none of the fluid lies between lower_um and upper_um: give a larger box", section(p)));
      } while (!within(body.center));
      if (is_free(body, before)) break;
    }
    return body;
  }

  /// Balls around it and around others do not meet: shapes that have gone through each other may stay so.
  bool is_free(const PackedBody& body, const Neighbourhood& before) const {
    const double radius = scale_ * shapes_[body.shape].radius();
    return !before.meets(body.center, radius) && !meets_wall(body, radius);
  }

  double largest_radius() const {
    double largest = 0;
    for (const PackingShape& shape : shapes_) largest = std::max(largest, shape.radius());
    return largest;
  }

  bool meets_wall(const PackedBody& body, double radius) const {
    if (!walls_->near(body.center, radius)) return false;
    Vec3 rows[3], along;
    body.rotation.matrix(rows);
    double distance;
    const PackingPoints& points = shapes_[body.shape].few_points();
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Vec3 p = points[n];
      const Vec3 at = body.center + scale_ * Vec3{dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)};
      if (walls_->distance(at, distance, along) && distance < 0) return true;
    }
    return walls_->distance(body.center, distance, along) && distance < 0.1 * radius;
  }

  [[noreturn]] void refuse(RigidPacking& packing) const {
    packing.thin_out();
    std::vector<int> placed(types_.size(), 0);
    for (const PackedBody& body : packing.bodies())
      if (body.movable) ++placed[body.group];
    if (std::all_of(placed.begin(), placed.end(), [](int n) { return n == 0; }) && scene_.cells.empty()) refuse_all();
    std::string text;
    double asked = 0, reached = 0;
    for (std::size_t p = 0; p < types_.size(); ++p) {
      asked += wanted_[p] * cell_volume(p) / volume_, reached += placed[p] * cell_volume(p) / volume_;
      if (placed[p] < wanted_[p])
        text += fmt::format("{}{}: {} cells do not fit, {} do (hematocrit {:.3f})", text.empty() ? "" : "; ",
                            amount(scene_.populations[p], p), wanted_[p], placed[p], placed[p] * cell_volume(p) / volume_);
    }
    if (text.empty()) text = amount(scene_.populations[0], 0) + ": its cells do not fit";
    if (types_.size() > 1) text += fmt::format("; all together hematocrit {:.3f} of {:.3f}", reached, asked);
    throw InputError(text + fmt::format("; {}. Ask for less, for a smaller gap_um, or for a "
                                        "wider {}; another seed may place a few more or less",
                                        may_deform()     ? "also as membranes they would have to be much smaller"
                                        : scene_.contact ? "beside [[cells]] they keep the shape that they have at rest"
                                                         : "they keep the shape that they have at rest: with [contact] they would bend",
                                        in_boxes() ? "box (lower_um, upper_um of the populations) or grid" : "grid"));
  }

  /// Where not one cell has room, fewer of them are no remedy.
  [[noreturn]] void refuse_all() const {
    const PopulationSettings& population = scene_.populations[0];
    const double wide = 2 * shapes_[types_[0]].radius();
    const double room = (may_deform() ? least_size() : 1.0) * wide + 2 * population.gap_um;
    throw InputError(
        fmt::format("{}: not even one of its cells fits: they are {:.3g} um wide at rest, and {} need about {:.2g} um across: use "
                    "a wider {}grid{}, a smaller gap_um, or smaller cells (cell_types.{}){}",
                    amount(population, 0), wide,
                    may_deform() ? fmt::format("as membranes, which grow from {:g} of their size,", least_size()) : "in that shape", room,
                    in_boxes() ? "box (lower_um, upper_um of the populations) or " : "",
                    scene_.grid->diameter_um > 0 ? fmt::format(" (grid.diameter_um, now {:g})", scene_.grid->diameter_um) : "",
                    population.type, may_deform() ? "" : ", or add [contact], with which they bend"));
  }

  bool in_boxes() const {
    return std::any_of(scene_.populations.begin(), scene_.populations.end(),
                       [](const PopulationSettings& p) { return p.lower_um || p.upper_um; });
  }

  static constexpr double most_share = 0.75;

  const Case& scene_;
  const CellPlaces& places_;
  const std::vector<int>& types_;
  double volume_, reach_ = 0, scale_ = 1;
  NodeSource source_;
  PackingSpace space_;
  std::vector<PackingShape> shapes_;  // [type]
  std::unique_ptr<PackingWalls> walls_;
  std::vector<int> wanted_;  // [population]
};

}  // namespace

int population_count(const PopulationSettings& population, int number, double fluid_volume, double cell_volume) {
  if (population.count > 0) return population.count;
  const double cells = population.hematocrit * fluid_volume / cell_volume;
  if (cells > 1e8) throw InputError(fmt::format("{}: {:.2g} cells: is the grid in um?", amount(population, number), cells));
  const int count = static_cast<int>(std::floor(cells + 0.5 + 1e-9));
  if (cell_volume > fluid_volume)
    throw InputError(fmt::format("{}: one cell has {:.3g} um3 and the whole grid {:.3g} um3: use a larger grid, or smaller cells",
                                 amount(population, number), cell_volume, fluid_volume));
  if (count < 1)
    throw InputError(fmt::format("{}: less than half a cell: one has {:.3g} um3, {:.3g} of the fluid's volume; ask for more, or set count",
                                 amount(population, number), cell_volume, cell_volume / fluid_volume));
  return count;
}

PackedCells pack_populations(const Case& scene, const Grid& grid, const CellPlaces& places, const std::vector<int>& types) {
  return Packer(scene, grid, places, types).pack();
}

PackedShare share_of(const CellPlaces& places, const Comm& comm) {
  PackedShare share;
  share.count = places.names.count;
  share.size = places.size;
  share.total = static_cast<std::int64_t>(places.cells.size()) - places.names.listed;
  share.first = share.total * comm.rank() / comm.size();
  const auto begin = places.cells.begin() + places.names.listed;
  share.cells.assign(begin + share.first, begin + share.total * (comm.rank() + 1) / comm.size());
  return share;
}

PackingReport report_of(const Case& scene, const CellPlaces& places, double fluid_volume) {
  PackingReport report;
  const auto share = [&](std::size_t cell) { return places.types[places.cells[cell].type].law.rest_volume / fluid_volume; };
  std::size_t cell = 0;
  for (; cell < scene.cells.size(); ++cell) report.tube_hematocrit += share(cell);
  for (std::size_t p = 0; p < scene.populations.size(); ++p) {
    const auto& settings = scene.populations[p];
    PackingReport::Population one{scene.cell_types[settings.type].name, places.names.count[p], 0, settings.hematocrit};
    one.hematocrit = one.cells * share(cell);
    cell += one.cells;
    report.populations.push_back(one);
    report.tube_hematocrit += one.hematocrit;
  }
  return report;
}

CellPlaces find_places(const Case& scene, const Grid& grid, const PackedCells* packed) {
  // Populations' types after those of the cells, as if each had one cell more.
  std::vector<CellSettings> kinds = scene.cells;
  for (const auto& population : scene.populations) kinds.push_back(scene.cell_types[population.type].cell);
  CellPlaces places = places_of(kinds);
  std::vector<int> types;
  for (std::size_t p = 0; p < scene.populations.size(); ++p) types.push_back(places.cells[scene.cells.size() + p].type);
  places.cells.resize(scene.cells.size());
  places.names.listed = static_cast<int>(scene.cells.size());
  if (scene.populations.empty()) return places;
  const PackedCells found = packed ? PackedCells{} : pack_populations(scene, grid, places, types);
  const PackedCells& all = packed ? *packed : found;
  places.names.count = all.count;
  places.size = all.size;
  places.cells.insert(places.cells.end(), all.cells.begin(), all.cells.end());
  std::size_t cell = scene.cells.size();
  for (std::size_t p = 0; p < types.size(); ++p)
    for (int n = 0; n < all.count[p]; ++n) places.cells[cell++].type = types[p];
  return places;
}

}  // namespace corpuscle
