#include "coupling/surface_checks.hpp"

#include "common/vec3.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "immersed/surface.hpp"
#include "membrane/reference.hpp"
#include "membrane/surface_file.hpp"
#include "parallel/agree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace corpuscle {

namespace {

/// All surfaces on the host.
struct HostSurfaces {
  explicit HostSurfaces(const SurfaceSet& s)
      : set(s),
        x(copy(s.x)),
        normal(copy(s.normal)),
        area(copy(s.area)),
        triangle(triangles_on_host(s)),
        first_vertex(copy(s.first_vertex)),
        first_triangle(copy(s.first_triangle)) {
    for (int b = 0; b < s.bodies; ++b) {
      Triple low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
      for (int i = first_vertex(b); i < first_vertex(b + 1); ++i)
        for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], x(i, d)), high[d] = std::max(high[d], x(i, d));
      lower.push_back(low), upper.push_back(high);
    }
  }
  template <class View>
  static HostMirror<View> copy(const View& view) {
    const auto host = Kokkos::create_mirror_view(view);
    Kokkos::deep_copy(host, view);
    return host;
  }
  Vec3 at(int vertex) const { return load(x, vertex); }

  const SurfaceSet& set;
  HostMirror<Components<double>> x, normal;
  HostMirror<Array<double>> area;
  HostMirror<Table<int>> triangle;
  HostMirror<Array<int>> first_vertex, first_triangle;
  std::vector<Triple> lower, upper;  // [body]
};

/// Every how many vertices of a body one is looked at.
int stride_of(const HostSurfaces& s, int body, int looked_at) {
  return std::max(1, (s.first_vertex(body + 1) - s.first_vertex(body)) / looked_at);
}

/// How far from a vertex the ray into the body leaves it; infinite if it meets only edges.
double thickness_at(const HostSurfaces& s, int body, int vertex) {
  const Vec3 from = s.at(vertex), along = -load(s.normal, vertex);
  double least = std::numeric_limits<double>::infinity();
  for (int t = s.first_triangle(body); t < s.first_triangle(body + 1); ++t) {
    const int c[3] = {s.triangle(t, 0), s.triangle(t, 1), s.triangle(t, 2)};
    if (c[0] == vertex || c[1] == vertex || c[2] == vertex) continue;
    const Vec3 a = s.at(c[0]), u = s.at(c[1]) - a, v = s.at(c[2]) - a;
    const Vec3 p = cross(along, v);
    const double determinant = dot(u, p);
    if (determinant == 0) continue;
    const Vec3 r = from - a, q = cross(r, u);
    const double wu = dot(r, p) / determinant, wv = dot(along, q) / determinant, distance = dot(v, q) / determinant;
    if (wu >= 0 && wv >= 0 && wu + wv <= 1 && distance > 0) least = std::min(least, distance);
  }
  return least;
}

struct Sample {
  double thickness, spacing, area;
  std::array<double, 3> share;  // of the grid's directions in spacing^2
  double ratio() const { return spacing / thickness; }
};

Resolution resolution_of(std::vector<Sample> samples) {
  Resolution result;
  if (samples.empty()) return result;
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.ratio() > b.ratio(); });
  result.largest = samples.front().ratio();
  result.thickness_um = samples.front().thickness;
  result.spacing_um = samples.front().spacing;
  double half = 0, weight = 0;
  for (const Sample& sample : samples) {
    half += 0.5 * sample.area;
    weight += sample.area * sample.ratio();
    for (int d = 0; d < 3; ++d) result.share[d] += sample.area * sample.ratio() * sample.share[d];
  }
  for (double& share : result.share) share /= weight;
  for (const Sample& sample : samples) {
    result.typical = sample.ratio();
    half -= sample.area;
    if (half <= 0) break;
  }
  return result;
}

/// Grids with `factor` times as many cells along the directions that count.
std::string finer_nodes(const GridSettings& grid, const Resolution& r, double factor) {
  constexpr double counts = 0.2;
  if (grid.generator == GridSettings::Generator::file) return "a finer grid.file";
  std::array<int, 3> nodes = grid.nodes;
  for (int d = 0; d < 3; ++d)
    if (r.share[d] > counts) nodes[d] = static_cast<int>(std::ceil((nodes[d] - 1) * factor)) + 1;
  return fmt::format("grid.nodes = [{}, {}, {}]", nodes[0], nodes[1], nodes[2]);
}

/// Typical spacing over thickness of which to warn, and which to refuse. Of cells: in the tube of 10 um, from two places
/// between the nodes, the rear hollow after 400 us comes to 1.17 and 1.20 um with nodes 1.9 um apart along the axis, to 1.13
/// and 1.23 um with 2.8 um, to 1.03 and 1.26 um with 3.75 um, where the speed swings by 10 %; 1.19 um is right. Ratios
/// of 0.7, 1.0 and 1.4. A sphere has four nodes across, or less than one and a half.
struct Limits {
  double coarse, hopeless;
};
constexpr Limits cell_limits{0.8, 1.2}, body_limits{0.25, 0.7};
/// Of cells whose membranes are forces: two red cells that are pressed together from 0.6 um come 10, 27 and 39 % less far in 1 ms with
/// nodes 1, 1.5 and 2 um apart than with 0.5 um. Ratios of 0.4, 0.6 and 0.8.
constexpr Limits force_limits{0.5, 1.0};

/// @returns the warning, or ""
std::string check_resolution(const std::string& name, const GridSettings& grid, const Resolution& r, const Limits& limits) {
  if (!(r.typical > limits.coarse)) return "";
  int digits = 2;  // that tell the figure from the limit
  while (digits < 6 && fmt::format("{:.{}g}", r.typical, digits) == fmt::format("{:.{}g}", limits.coarse, digits)) ++digits;
  const std::string text = fmt::format(
      "{}: the grid is too coarse for it: nodes are {:.3g} um apart across it where it is {:.3g} um thick; spacing over thickness is "
      "{:.{}g} there, and {:.{}g} or more over half of its surface, where no more than {:g} will do for a first look and half of that "
      "for figures: use {} or finer",
      name, r.spacing_um, r.thickness_um, r.largest, digits, r.typical, digits, limits.coarse,
      finer_nodes(grid, r, r.typical / limits.coarse));
  if (r.typical > limits.hopeless) throw InputError(text);
  return text;
}

/// Vertices are where a membrane that is a force holds the fluid: between those that are too far apart for the kernel it leaks. A
/// sphere that is pushed, with edges of 3.2 spacings, is 3.4 % too fast.
CoarseSurface check_mesh(const std::string& name, const SpacingMap& map, const HostSurfaces& s, int body) {
  constexpr double limit = 1.7;
  constexpr int looked_at = 250;
  const int first = s.first_triangle(body), last = s.first_triangle(body + 1), stride = std::max(1, (last - first) / looked_at);
  const NodeSteps steps = map.near(s.lower[body], s.upper[body]);
  double sum = 0, length = 0;
  int edges = 0;
  for (int t = first; t < last; t += stride)
    for (int k = 0; k < 3; ++k, ++edges) {
      const Vec3 edge = s.at(s.triangle(t, (k + 1) % 3)) - s.at(s.triangle(t, k));
      const double l = norm(edge);
      sum += l / steps.spacing({edge.x / l, edge.y / l, edge.z / l}), length += l;
    }
  CoarseSurface found;
  found.mesh = true;
  found.degree = edges > 0 ? sum / edges : 0;
  if (!(found.degree > limit)) return found;
  const int vertices = s.first_vertex(body + 1) - s.first_vertex(body);
  found.text = fmt::format(
      "{}: its mesh is too coarse for the grid: edges are {:.3g} um long, {:.3g} spacings of the nodes there, in the mean; above about "
      "{:g} the fluid leaks between vertices (a sphere that is pushed is 3.4 % too fast with edges of 3.2): use vertices = {} or more, or "
      "a coarser grid (grid.nodes)",
      name, length / edges, found.degree, limit, static_cast<int>(std::ceil(vertices * std::pow(found.degree / limit, 2))));
  return found;
}

/// " or bodies.0.scale = 0.001 (a file in nm)" for a body from a file whose size fits with another unit.
std::string other_scale(const Case& scene, const SurfaceSet& surfaces, int body, double largest, double least_spacing, double least_grid) {
  if (body < surfaces.cells) return "";
  const BodySettings& settings = scene.bodies[body - surfaces.cells];
  if (settings.shape != BodySettings::Shape::file) return "";
  const double factor = nearest_scale(largest, std::sqrt(least_spacing * least_grid)), scale = factor * settings.scale;
  return fmt::format("; is its file in another unit? {}.scale = {:g}{} would make it {:.3g} um", body_name(surfaces, body), scale,
                     unit_of_scale(scale), factor * largest);
}

void check_size(const SpacingMap& map, const Case& scene, const HostSurfaces& s, int body) {
  Triple extent, room;
  for (int d = 0; d < 3; ++d) extent[d] = s.upper[body][d] - s.lower[body][d], room[d] = map.upper()[d] - map.lower()[d];
  const double largest = *std::max_element(extent.begin(), extent.end());
  double least_room = 1e300, spacing = 0;
  const NodeSteps steps = map.near(s.lower[body], s.upper[body]);
  for (int d = 0; d < 3; ++d) {
    least_room = std::min(least_room, room[d]);
    Triple unit{};
    unit[d] = 1;
    spacing = std::max(spacing, steps.spacing(unit));
  }
  const std::string name = body_name(s.set, body);
  const auto remedy = [&] { return other_scale(scene, s.set, body, largest, spacing, least_room); };
  for (int d = 0; d < 3; ++d)
    if (!(extent[d] <= room[d]))
      throw InputError(fmt::format("{}: {:.3g} x {:.3g} x {:.3g} um, larger than the grid, which is {:.3g} x {:.3g} x {:.3g} um{}", name,
                                   extent[0], extent[1], extent[2], room[0], room[1], room[2], remedy()));
  if (!(largest >= spacing))
    throw InputError(
        fmt::format("{}: {:.3g} x {:.3g} x {:.3g} um, smaller than the spacing of the grid's nodes there, {:.3g} um: refine "
                    "the grid (grid.nodes){}",
                    name, extent[0], extent[1], extent[2], spacing, remedy()));
}

/// Winding number of the body's surface about a point: 1 inside, 0 outside.
double winding_number(const HostSurfaces& s, int body, const Vec3& point) {
  double angle = 0;
  for (int t = s.first_triangle(body); t < s.first_triangle(body + 1); ++t) {
    const Vec3 a = s.at(s.triangle(t, 0)) - point, b = s.at(s.triangle(t, 1)) - point, c = s.at(s.triangle(t, 2)) - point;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    angle += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return angle / (4 * std::acos(-1.0));
}

/// Throws if vertices of `inner`, moved by `shift`, lie inside `outer`.
void check_outside(const HostSurfaces& s, int inner, int outer, const Triple& shift) {
  for (int d = 0; d < 3; ++d)
    if (s.lower[inner][d] + shift[d] > s.upper[outer][d] || s.upper[inner][d] + shift[d] < s.lower[outer][d]) return;
  // All vertices within both boxes, if they are not too many: surfaces may overlap by little.
  constexpr int looked_at = 200;
  std::vector<Vec3> within;
  for (int i = s.first_vertex(inner); i < s.first_vertex(inner + 1); ++i) {
    const Vec3 x = s.at(i) + Vec3{shift[0], shift[1], shift[2]};
    bool in_box = true;
    for (int d = 0; d < 3; ++d) in_box = in_box && x[d] >= s.lower[outer][d] && x[d] <= s.upper[outer][d];
    if (in_box) within.push_back(x);
  }
  const std::size_t stride = 1 + within.size() / looked_at;
  int inside = 0, looked = 0;
  std::optional<Vec3> where;
  for (std::size_t n = 0; n < within.size(); n += stride) {
    ++looked;
    if (winding_number(s, outer, within[n]) < 0.5) continue;
    ++inside;
    if (!where) where = within[n];
  }
  if (inside == 0) return;
  const int first = std::min(inner, outer), second = std::max(inner, outer);
  const std::string there = fmt::format("({:.4g}, {:.4g}, {:.4g}) um", where->x, where->y, where->z);
  if (body_name(s.set, inner) == body_name(s.set, outer))
    throw InputError(
        fmt::format("surfaces cross: {} and its image beyond a periodic side overlap near {}; use a longer period or "
                    "a smaller body",
                    body_name(s.set, inner), there));
  if (inside == looked && static_cast<int>(within.size()) == s.first_vertex(inner + 1) - s.first_vertex(inner))
    throw InputError(fmt::format("{} lies inside {}, near {}; nothing else can be where one is: move them apart (center_um)",
                                 body_name(s.set, inner), body_name(s.set, outer), there));
  throw InputError(fmt::format("surfaces cross: {} and {} overlap near {}: move them apart (center_um, axis)", body_name(s.set, first),
                               body_name(s.set, second), there));
}

/// Shifts by whole periods after which two bodies may be near each other.
std::vector<Triple> near_images(const Grid& grid, const HostSurfaces& s, int a, int b) {
  std::vector<Triple> shifts{Triple{}};
  for (int d = 0; d < 3; ++d) {
    if (!grid.index().periodic[d]) continue;
    const Triple& period = grid.period(d);
    double along = 0, square = 0;
    for (int m = 0; m < 3; ++m) {
      along += 0.5 * (s.lower[b][m] + s.upper[b][m] - s.lower[a][m] - s.upper[a][m]) * period[m];
      square += period[m] * period[m];
    }
    const double nearest = std::round(along / square);
    std::vector<Triple> all;
    for (const Triple& shift : shifts)
      for (double turn : {nearest - 1, nearest, nearest + 1})
        all.push_back({shift[0] + turn * period[0], shift[1] + turn * period[1], shift[2] + turn * period[2]});
    shifts = std::move(all);
  }
  return shifts;
}

/// @param shared  beyond periodic sides there are copies
void check_apart(const Grid& grid, const HostSurfaces& s, bool shared) {
  for (int a = 0; a < s.set.bodies; ++a)
    for (int b = 0; b < s.set.bodies; ++b)
      for (const Triple& shift : shared ? std::vector<Triple>{Triple{}} : near_images(grid, s, a, b)) {
        if (a == b && shift == Triple{}) continue;
        check_outside(s, a, b, shift);
      }
}

}  // namespace

std::vector<Resolution> measure_resolution(const SpacingMap& map, const Case& scene, const SurfaceSet& surfaces,
                                           const std::vector<int>& types) {
  const auto same = [&](int a, int b) { return types.empty() ? same_type(scene.cells[a], scene.cells[b]) : types[a] == types[b]; };
  const auto is_copy = [&](int body) { return body >= surfaces.own_cells && body < surfaces.cells; };
  constexpr int looked_at = 250;
  const HostSurfaces s(surfaces);
  std::vector<Resolution> results;
  std::vector<std::vector<double>> thickness(surfaces.bodies);
  for (int body = 0; body < surfaces.bodies; ++body) {
    if (is_copy(body)) {
      results.emplace_back();
      continue;
    }
    // Cells of one type are as thick as each other.
    int alike = 0;
    while (alike < body && !(body < surfaces.cells && same(alike, body))) ++alike;
    const NodeSteps steps = map.near(s.lower[body], s.upper[body]);
    std::vector<Sample> samples;
    int number = 0;
    for (int i = s.first_vertex(body); i < s.first_vertex(body + 1); i += stride_of(s, body, looked_at), ++number) {
      const double thick = alike < body ? thickness[alike][number] : thickness_at(s, body, i);
      thickness[body].push_back(thick);
      if (!std::isfinite(thick)) continue;
      const Triple across{s.normal(i, 0), s.normal(i, 1), s.normal(i, 2)};
      const double spacing = steps.spacing(across);
      Sample sample{thick, spacing, s.area(i), {}};
      for (int d = 0; d < 3; ++d) sample.share[d] = steps.along(d, across) / (spacing * spacing);
      samples.push_back(sample);
    }
    results.push_back(resolution_of(std::move(samples)));
  }
  return results;
}

std::vector<CoarseSurface> check_surfaces(const Grid& grid, const Case& scene, const SurfaceSet& surfaces, const std::vector<int>& types) {
  const SpacingMap map(grid);
  const HostSurfaces s(surfaces);
  for (int body = 0; body < surfaces.bodies; ++body) check_size(map, scene, s, body);
  check_apart(grid, s, surfaces.own_cells < surfaces.cells || !types.empty());
  const bool forces = scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force;
  std::vector<CoarseSurface> coarse;
  const auto resolutions = measure_resolution(map, scene, surfaces, types);
  for (int body = 0; body < surfaces.bodies; ++body) {
    const Limits& limits = body >= surfaces.cells ? body_limits : forces ? force_limits : cell_limits;
    const int type = body < static_cast<int>(types.size()) ? types[body] : -1;
    const auto text = check_resolution(body_name(surfaces, body), *scene.grid, resolutions[body], limits);
    if (!text.empty()) coarse.push_back({type, false, resolutions[body].typical, text});
    if (!forces || type < 0) continue;
    coarse.push_back(check_mesh(body_name(surfaces, body), map, s, body));
    coarse.back().type = type;
    if (coarse.back().text.empty()) coarse.pop_back();
  }
  return coarse;
}

void check_clear_of_bodies(const SurfaceSet& surfaces) {
  const HostSurfaces s(surfaces);
  for (int cell = 0; cell < surfaces.cells; ++cell)
    for (int body = surfaces.cells; body < surfaces.bodies; ++body) {
      check_outside(s, cell, body, Triple{});
      check_outside(s, body, cell, Triple{});
    }
}

std::vector<CoarseSurface> worst_of_types(const Comm& comm, int types, const std::vector<CoarseSurface>& here) {
  std::vector<CoarseSurface> result;
  for (int type = 0; type < types; ++type)
    for (const bool mesh : {false, true}) {
      CoarseSurface worst{type, mesh, 0, ""};
      for (const CoarseSurface& one : here)
        if (one.type == type && one.mesh == mesh && one.degree > worst.degree) worst = one;
      const double degree = comm.max(worst.degree);
      worst.text = agree(comm, worst.degree == degree ? worst.text : "");
      worst.degree = degree;
      if (!worst.text.empty()) result.push_back(worst);
    }
  return result;
}

std::string warn_of_coarse(const std::vector<CoarseSurface>& surfaces) {
  std::string warnings;
  for (const CoarseSurface& one : surfaces) {
    warn("{}", one.text);
    warnings += (warnings.empty() ? "" : "; ") + one.text;
  }
  return warnings;
}

}  // namespace corpuscle
