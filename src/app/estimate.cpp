#include "app/estimate.hpp"

#include "app/any_cell.hpp"
#include "blood/guided_flow.hpp"
#include "core/error.hpp"
#include "grid/grid.hpp"
#include "grid/node_file.hpp"
#include "membrane/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace corpuscle {

namespace {

constexpr double bytes_per_mb = 1024 * 1024;
constexpr int halo = IndexSpace::halo;

/// What bends or is skewed is so on a finer grid too: larger grids are looked at with about this many cells, in milliseconds.
constexpr double sample_cells = 5e4;

/// Mean distance between neighbouring nodes along d, over some of them.
double mean_spacing(const NodeSource& source, int d) {
  double sum = 0;
  int count = 0;
  std::array<int, 3> at{}, step{};
  for (int m = 0; m < 3; ++m) step[m] = std::max(1, source.cells[m] / 8);
  for (at[2] = 0; at[2] < source.cells[2]; at[2] += step[2])
    for (at[1] = 0; at[1] < source.cells[1]; at[1] += step[1])
      for (at[0] = 0; at[0] < source.cells[0]; at[0] += step[0], ++count) {
        auto next = at;
        ++next[d];
        const Triple a = source.node(at[0], at[1], at[2]), b = source.node(next[0], next[1], next[2]);
        sum += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
      }
  return sum / count;
}

/// Skewness and mean spacings of the case's grid, from one of fewer cells.
void sample_grid(const GridSettings& settings, SceneSize& size) {
  GridSettings few = settings;
  const double ratio = std::cbrt(sample_cells / (size.cells[0] * size.cells[1] * size.cells[2]));
  for (int d = 0; d < 3 && ratio < 1; ++d) few.nodes[d] = std::max(std::min(4, few.nodes[d]), 1 + static_cast<int>(ratio * size.cells[d]));
  const NodeSource source = make_node_source(few);
  for (int d = 0; d < 3; ++d) size.spacing[d] = mean_spacing(source, d) * source.cells[d] / size.cells[d];
  try {
#ifdef CORPUSCLE_MPI
    const Comm alone(MPI_COMM_SELF);
#else
    const Comm alone;
#endif
    const Grid coarse(alone, source, size.periodic);
    size.skewed = !coarse.orthogonal();
    size.volume = coarse.total_volume();
  } catch (const InputError&) {
    // Folded, perhaps since it is coarse; if not, the grid itself says so when it is built.
  }
}

void measure_grid(const Case& scene, int ranks, SceneSize& size) {
  const GridSettings& grid = *scene.grid;
  std::array<int, 3> cells{};
  if (grid.generator == GridSettings::Generator::file) {
    cells = cells_of_node_file(grid.file);
    size.sampled = false;
    size.skewed = true;  // it may be
    size.spacing = {1, 1, 1};
  } else {
    for (int d = 0; d < 3; ++d) cells[d] = grid.nodes[d] - 1;
  }
  const auto blocks = ranks_per_direction(ranks, cells);
  for (int d = 0; d < 3; ++d) {
    size.cells[d] = cells[d];
    size.block[d] = std::ceil(size.cells[d] / blocks[d]);
    size.cut[d] = blocks[d] > 1;
  }
  for (const auto& boundary : scene.boundaries)
    if (boundary.type == BoundarySettings::Type::periodic) size.periodic[static_cast<int>(boundary.side) / 2] = true;
  for (bool periodic : size.periodic)
    if (periodic) size.images *= 3;
  if (size.sampled) sample_grid(grid, size);
}

/// Vertices of a surface in a file, from its length: OFF takes some 70 bytes for a vertex and its two triangles, binary STL 100.
double vertices_in_file(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return error ? 0 : static_cast<double>(bytes) / 70;
}

double vertices_of(const BodySettings& body, const SceneSize& size) {
  if (body.shape == BodySettings::Shape::file) return vertices_in_file(body.file);
  if (body.vertices > 0) return body.vertices;
  const Triple axes =
      body.shape == BodySettings::Shape::sphere ? Triple{body.radius_um, body.radius_um, body.radius_um} : body.semi_axes_um;
  const double largest = std::max({axes[0], axes[1], axes[2]});
  const double h2 = std::pow(size.spacing[0] * size.spacing[1] * size.spacing[2], 2.0 / 3);
  return std::clamp(4 * std::acos(-1.0) * largest * largest / (0.87 * h2), 162.0, 100000.0);
}

/// About, um3.
double volume_of(const CellSettings& cell) {
  const double ball = 4.0 / 3 * std::acos(-1.0);
  if (cell.mesh.empty() && cell.shape == CellSettings::Shape::sphere) return ball * std::pow(cell.radius_um, 3);
  if (cell.mesh.empty() && cell.shape == CellSettings::Shape::ellipsoid)
    return ball * cell.semi_axes_um[0] * cell.semi_axes_um[1] * cell.semi_axes_um[2];
  return 94 * std::pow(cell.diameter_um / 7.82, 3);
}

/// From a cell's middle to its end, um; zero for one from a file.
double reach_of(const CellSettings& cell) {
  if (!cell.mesh.empty()) return 0;
  switch (cell.shape) {
    case CellSettings::Shape::sphere:
      return cell.radius_um;
    case CellSettings::Shape::ellipsoid:
      return *std::max_element(cell.semi_axes_um.begin(), cell.semi_axes_um.end());
    default:
      return 0.5 * cell.diameter_um;
  }
}

double vertices_of(const CellSettings& cell) { return cell.mesh.empty() ? cell.vertices : vertices_in_file(cell.mesh); }

double cells_of(const PopulationSettings& population, const Case& scene, const SceneSize& size) {
  const CellSettings& cell = scene.cell_types[population.type].cell;
  return population.count > 0 ? population.count : population.hematocrit * size.volume / volume_of(cell);
}

/// A type counts once, and up to twice more for those of its cells that start drawn out.
double pairs_of_types(const Case& scene) {
  constexpr int most_drawn_out = 2;
  std::vector<const CellSettings*> types;
  const auto add = [&](const CellSettings& cell) {
    int same = 0;
    const bool rest = cell.start_stretch == Triple{1, 1, 1};
    for (const CellSettings* known : types) {
      if (!same_type(cell, *known)) continue;
      if (known->start_stretch == cell.start_stretch) return;
      same += known->start_stretch != Triple{1, 1, 1};
    }
    if (rest || same < most_drawn_out) types.push_back(&cell);
  };
  for (const auto& cell : scene.cells) add(cell);
  for (const auto& population : scene.populations) add(scene.cell_types[population.type].cell);
  double pairs = 0;
  for (const CellSettings* cell : types) pairs += vertices_of(*cell) * vertices_of(*cell);
  return pairs;
}

/// A rank's share of cells that are spread evenly, whole ones; and the copies of those that reach into its block and what it
/// must know of around it, where others lie or the domain goes on.
void share_cells(const Case& scene, int ranks, SceneSize& size) {
  if (!scene.has_cells()) return;
  auto count = static_cast<double>(scene.cells.size());
  double all = 0, reach = 0;
  for (const auto& cell : scene.cells) {
    all += vertices_of(cell);
    reach = std::max(reach, reach_of(cell));
  }
  for (const auto& population : scene.populations) {
    const CellSettings& cell = scene.cell_types[population.type].cell;
    const double cells = cells_of(population, scene, size);
    count += cells;
    all += cells * vertices_of(cell);
    reach = std::max(reach, reach_of(cell));
  }
  if (!(count > 0)) return;
  const double share = std::ceil(count / ranks);
  double around = 1;  // the volume in which cells are copied or own over the block's
  for (int d = 0; d < 3; ++d)
    if (size.cut[d] || size.periodic[d]) around *= 1 + 2 * ((halo + 1) * size.spacing[d] + reach) / (size.block[d] * size.spacing[d]);
  size.own = all * share / count;
  size.copies = all / count * std::min(share * (around - 1), count * size.images - share);
}

/// Cells of all multigrid levels over those of the finest, halos included; `coarsest`: of the last one.
/// The same choices as MultigridHierarchy's, on mean spacings.
double levels_over_finest(const SceneSize& size) {
  auto global = size.cells, block = size.block, h = size.spacing;
  double sum = 1;
  bool gathered = false;
  while (global[0] * global[1] * global[2] > 300) {
    const double least = std::min({h[0], h[1], h[2]});
    bool coarser = false, stuck = false;
    for (int d = 0; d < 3; ++d) {
      if (least * least < 0.4 * h[d] * h[d]) continue;
      stuck = stuck || block[d] < ((size.cut[d] && !gathered) || size.periodic[d] ? 2 * halo : 2);
      coarser = true;
      global[d] = std::ceil(global[d] / 2), block[d] = std::ceil(block[d] / 2), h[d] *= 2;
    }
    if (stuck || !coarser) break;
    gathered = global[0] * global[1] * global[2] <= 4096;
    if (gathered) block = global;
    sum += (block[0] + 2 * halo) * (block[1] + 2 * halo) * (block[2] + 2 * halo) / size.padded();
  }
  return sum;
}

/// @throws InputError  if `count` reaches two to the power of 31
void require_below(double count, const char* what, const char* remedy, const char* key = "grid.nodes") {
  constexpr double limit = 2147483647.0;
  if (count <= limit) return;
  throw InputError(
      fmt::format("{}: {} would be {:.3g}, and the program counts them up to {:.3g} on a rank: {}", key, what, count, limit, remedy));
}

/// Bytes of a vertex' lists of the triangles within `range`, um, and the skin: four tenths of what membranes have everywhere alike,
/// since a cell does not touch what is next to a vertex in its own membrane.
double of_lists(const SceneSize& size, double range) {
  constexpr double skin = 0.5, apart = 0.4, triangle = 2, body = 72, triangles_of_body = 20;
  const double r = (1 + skin) * range, dense = size.volume > 0 ? 2 * (size.vertices - size.rigid) / size.volume : 0;
  return std::min(2 * (size.vertices - size.rigid), apart * dense * 4 / 3 * std::acos(-1.0) * r * r * r) *
         (triangle + body / triangles_of_body);
}

/// Bytes of a vertex, for [contact] and for the look at packed cells' gaps before the first step, of which there is one at a time.
double of_contact(const Case& scene, const SceneSize& size) {
  constexpr double contact = 52, look = 32, blended = 1.5, seen_beyond = 0.3;
  double most = 0;
  if (scene.contact) {
    const double h = std::max({size.spacing[0], size.spacing[1], size.spacing[2]});
    const double attracted = scene.contact->aggregation_energy > 0 ? scene.contact->aggregation_range_um : 0;
    most = contact + of_lists(size, std::max({scene.contact->range_um, attracted, scene.coupling->slip ? blended * h : 0}));
  }
  double gap = 1e30;
  for (const auto& population : scene.populations) gap = std::min(gap, population.gap_um);
  if (!scene.populations.empty()) most = std::max(most, (scene.contact ? contact : 0) + look + of_lists(size, gap + seen_beyond));
  return most;
}

/// Bytes of what the parts of a step have one after the other: the triangles' geometry and the forces of their corners, an eighth of the
/// cells at a time; and markers' weights, of a quarter of the planes and three more.
double of_workspace(const SceneSize& size) {
  constexpr double geometry = 64, corners = 144, weights = 204, smallest_part = 16 * 500, fewest_planes = 6, beside = 3;
  const double parts = std::clamp(std::floor(size.own / smallest_part), 1.0, 8.0), planes = size.block[2] + 1;
  const double share = std::min(1.0, (std::max(fewest_planes, planes / 4) + beside) / planes);
  return std::max((geometry + corners / parts) * size.own, weights * share * (size.own + size.copies));
}

/// Bytes on a rank.
double of_shared_cells(const Case& scene, const SceneSize& size) {
  // Of a vertex and its two triangles: surface, places and markers; of an own one, motion.
  double vertex = 125, own = 70;
  const auto viscous = [](const CellSettings& c) { return c.membrane_viscosity_N_s_per_m > 0; };
  if (any_cell(scene, viscous)) own += 3 * (8 + 4);  // MembraneViscosity
  if (scene.coupling->pressure == CouplingSettings::Pressure::sharp) vertex += 40;
  vertex += of_contact(scene, size);
  return vertex * (size.own + size.copies) + own * size.own + of_workspace(size) + size.cells_listed * 2 * sizeof(CellSettings);
}

}  // namespace

double SceneSize::padded() const { return (block[0] + 2 * halo) * (block[1] + 2 * halo) * (block[2] + 2 * halo); }

SceneSize measure_scene(const Case& scene, int ranks) {
  SceneSize size;
  if (scene.grid) measure_grid(scene, ranks, size);
  for (const auto& cell : scene.cells) size.vertices += vertices_of(cell);
  for (const auto& population : scene.populations)
    size.vertices += cells_of(population, scene, size) * vertices_of(scene.cell_types[population.type].cell);
  for (const auto& body : scene.bodies) size.rigid += vertices_of(body, size);
  size.vertices += size.rigid;
  size.cells_listed = static_cast<double>(scene.cells.size());
  size.shared = scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force;
  size.writes_cells = scene.output.cells;
  size.own = size.vertices;
  if (size.shared) {
    share_cells(scene, ranks, size);
    size.pairs = pairs_of_types(scene);
  }
  return size;
}

/// With its halo, of the piece of a grid in which plasma alone is solved for: one rank has it.
double plasma_cells(const Case& scene, const SceneSize& size) {
  if (!scene.blood || !scene.grid || !scene.fluid || scene.fluid->pressure_gradient_Pa_per_um == Triple{} || scene.boundaries.size() != 6)
    return 0;
  std::array<bool, 3> unchanged{};
  for (const BoundarySettings& side : scene.boundaries)
    unchanged[static_cast<int>(side.side) / 2] = side.type == BoundarySettings::Type::periodic;
  const bool tube = scene.grid->generator == GridSettings::Generator::straight_tube && unchanged[2];
  const bool walls = scene.grid->generator == GridSettings::Generator::box && unchanged != std::array<bool, 3>{true, true, true};
  if (!tube && !walls) return 0;
  std::array<int, 3> cells{};
  for (int d = 0; d < 3; ++d) cells[d] = static_cast<int>(size.cells[d]);
  double padded = 1;
  for (const int n : plasma_piece(cells, unchanged)) padded *= n + 2 * halo;
  return padded;
}

MemoryEstimate estimate_memory(const Case& scene, const SceneSize& size, int ranks) {
  const bool surfaces = scene.has_cells() || !scene.bodies.empty();
  const bool convective = scene.fluid && scene.fluid->convection != FluidSettings::Convection::none;
  const double nodes = size.padded(), owned = size.owned();
  // Bytes of each array of a node, of the classes named; doubles are 8, vectors of the cycles 12.
  const double grid = 24 + 72 + 8 + 1;  // Grid: centres, faces, volumes, kinds
  const double solver = 6 * 24 + 4 * 8 + 2 * 3 * 8 + 2 + (convective ? 6 * 8 : 0) + (size.skewed ? 6 * 8 : 0);
  const double krylov = 5 * 12;  // FluidSolver::Momentum
  // Transfer: of a kernel that is sharpened twice the faces once more, and other areas on grids that are not uniform.
  const bool sharp = size.shared && scene.coupling->kernel == CouplingSettings::Kernel::three_point;
  const double sharpening = sharp ? 48 + (scene.grid->generator == GridSettings::Generator::box ? 0 : 72) : 0;
  const bool jumps = size.shared && scene.coupling->pressure == CouplingSettings::Pressure::sharp;
  const double transfer = size.shared ? 29 + sharpening + (jumps ? 8 : 0) : 0;            // Transfer
  const double search = transfer + ((size.shared ? size.rigid > 0 : surfaces) ? 51 : 0);  // ImmersedBoundary
  const bool ratios = any_cell(scene, [](const CellSettings& c) { return c.viscosity_ratio != 1; });
  const double cytosol = ratios ? 3 * 8 + 3 * 4 + 8 + 4 * 24 + 1 + 12 : 0;  // Cytosol; FluidSolver: smooth, excess, a hierarchy
  const double cycles = 12 + (3 * 4 + 3 * 12) + (3 * 4 + 3 * 4);            // hierarchy, velocity's and pressure's cycle
  const double conjugate_gradients = size.skewed ? 0 : 9 * 8;               // PressureMultigrid
  const double rows = 19;
  // PressureSolver: values, slots, packed, columns, numbers; hypre's matrix, once more while it takes the values; the
  // vectors of flexible GMRES, two for each of up to 60 iterations.
  const double matrix = rows * (8 + 4 + 8 + 4 + 4) + rows * 2 * (8 + 4) + 2 * 60 * 8;
  MemoryEstimate mb;
  mb.program = ranks > 1 ? 36 : 32;
  if (scene.grid) {
    mb.fields = (nodes * (grid + solver + krylov + search + cytosol + conjugate_gradients) + owned * (8 + 36)) / bytes_per_mb;
    mb.multigrid = nodes * cycles * levels_over_finest(size) / bytes_per_mb;
    if (size.skewed) mb.pressure_matrix = owned * matrix / bytes_per_mb;
    mb.output += plasma_cells(scene, size) / ranks *
                 (grid + solver + krylov + conjugate_gradients + 2 * cycles + (size.skewed ? matrix : 0)) / bytes_per_mb;
    // A vector of every node in the order of the file, on the device and on the host.
    mb.output += owned * 2 * 24 / bytes_per_mb;
    // A grid from a file: all its nodes, on every rank, while the geometry is made.
    if (!size.sampled) mb.output += size.cells[0] * size.cells[1] * size.cells[2] * 24 / bytes_per_mb;
    double faces = 0;
    for (int d = 0; d < 3; ++d)
      if (size.cut[d]) faces = std::max(faces, nodes / (size.block[d] + 2 * halo) * halo);
    mb.output += faces * 3 * 8 * 4 / bytes_per_mb;
  }
  // Geometry, motion, tractions and search of a vertex and its two triangles; its places under each image; the rows of the
  // two immersed nodes beside it, with 16 entries for the velocity and for the pressure.
  const double cutting = 1500 + 60 * size.images + 2 * 2 * 16 * 12;
  if (size.shared) {  // and with contact each image of a rigid body is a surface
    mb.surfaces = (of_shared_cells(scene, size) + size.rigid * (cutting + (size.images + 1) * 700)) / bytes_per_mb;
  } else {
    mb.surfaces = size.vertices * cutting / bytes_per_mb;
  }
  return mb;
}

void require_countable(const SceneSize& size, int ranks) {
  const char* more = ranks > 1 ? "use more ranks or fewer nodes (grid.nodes)" : "use ranks (mpirun -n) or fewer nodes (grid.nodes)";
  require_below((size.block[0] + 7) * (size.block[1] + 7) * (size.block[2] + 7), "the nodes of a rank with its halo", more);
  for (int d = 0; d < 3; ++d) {
    const double side = size.padded() / (size.block[d] + 2 * halo) * halo;
    if (size.cut[d]) require_below(side * 3 * 8, "the bytes of a message between two ranks", more);
  }
  if (ranks > 1) require_below(size.owned() * 3 * 8, "the bytes of a field that a rank writes at once", more);
  if (size.skewed) {
    require_below(size.owned() * 19, "the matrix entries of a rank on a skewed grid", more);
    require_below(size.cells[0] * size.cells[1] * size.cells[2], "the rows of the pressure matrix on a skewed grid",
                  "use fewer nodes (grid.nodes), or a grid without skewness");
  }
  if (size.shared) {
    require_below(3 * 2 * (size.own + size.copies), "the corners of triangles", "use more ranks or fewer cells", "cells");
    if (size.writes_cells && size.vertices > 2147483647.0)
      throw InputError(
          fmt::format("output.cells: {:.3g} vertices, and cells.h5 numbers them up to 2.15e+09: set output.cells = false, or "
                      "use fewer cells or vertices",
                      size.vertices));
    return;
  }
  // Triangles are twice the vertices; the search numbers them together with the images under which they are seen.
  if (2 * size.vertices * size.images > 2147483647.0 || 3 * size.vertices > 2147483647.0)
    throw InputError(
        fmt::format("cells, bodies: {:.3g} triangles under {:.0f} periodic images are more than the program "
                    "counts (2.1e9): use fewer vertices",
                    2 * size.vertices, size.images));
}

MemoryEstimate require_memory(const Comm& comm, const Case& scene) {
  const SceneSize size = measure_scene(scene, comm.size());
  const MemoryEstimate estimate = estimate_memory(scene, size, comm.size());
  int neighbours = 1;
#ifdef CORPUSCLE_MPI
  if (comm.size() > 1) {
    MPI_Comm node;
    MPI_Comm_split_type(comm.handle(), MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
    MPI_Comm_size(node, &neighbours);
    MPI_Comm_free(&node);
  }
#endif
  const double at_hand = memory_at_hand_mb(), needed = estimate.rank() * neighbours;
  if (comm.max(needed - at_hand) > 0) {
    const double most = comm.max(needed), least = comm.min(at_hand);
    const std::string shared = comm.size() == 1 ? "" : fmt::format(" for {} ranks on one machine", comm.max(neighbours));
    const bool of_cells = estimate.surfaces > 0.5 * estimate.rank();
    throw InputError(
        fmt::format("{} need about {:.3g} GB of memory{}, and {:.3g} GB are at hand: use fewer {}, or {}",
                    of_cells ? fmt::format("cells, bodies: {:.0f} vertices", size.vertices)
                             : fmt::format("grid.nodes: {:.0f} x {:.0f} x {:.0f} grid cells", size.cells[0], size.cells[1], size.cells[2]),
                    most / 1024, shared, least / 1024, of_cells ? "vertices" : "nodes",
                    comm.size() == 1 ? "ranks on more machines (mpirun)" : "more machines"));
  }
  require_countable(size, comm.size());
  return estimate;
}

double estimate_set_up_s(const SceneSize& size, int threads) {
  constexpr double of_vertex = 1.3e-4, of_pair = 2.6e-7;  // on one core; each pair in 30 iterations
  return of_vertex * size.own + of_pair * size.pairs / threads;
}

double estimate_steps_s(const RunSize& size) {
  // Seconds on one core, measured with the tube of 10 um and cells of 500 to 8000 vertices: of a grid cell, ten times that where the
  // pressure needs a matrix; of a vertex, for search and tractions; of a membrane's vertex in each sub-step.
  const double of_cell = size.skewed ? 1e-5 : 1.1e-6;
  constexpr double of_vertex = 4e-6, of_substep = 2.2e-7;
  return size.steps / size.cores * (of_cell * size.cells + of_vertex * size.vertices + of_substep * size.substeps * size.membrane_vertices);
}

std::string memory_text(const MemoryEstimate& mb, int ranks) {
  std::string parts;
  for (const auto& [name, value] : {std::pair{"fields", mb.fields},
                                    {"multigrid", mb.multigrid},
                                    {"pressure matrix", mb.pressure_matrix},
                                    {"surfaces", mb.surfaces},
                                    {"output", mb.output},
                                    {"program", mb.program}})
    if (value >= 0.5) parts += fmt::format("{}{} {:.0f}", parts.empty() ? "" : ", ", name, value);
  return fmt::format("about {:.0f} MB{} ({})", mb.rank() * ranks, ranks > 1 ? fmt::format(" on {} ranks", ranks) : "", parts);
}

}  // namespace corpuscle
