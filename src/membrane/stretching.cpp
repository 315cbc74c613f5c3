#include "membrane/stretching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "core/units.hpp"
#include "membrane/inertia.hpp"
#include "membrane/rest_search.hpp"

namespace corpuscle {

namespace {

/// Vertices of the two ends: first the `count` with the largest x, then the `count` with the smallest.
std::vector<int> end_vertices(const SurfaceSet& surfaces, int vertices, int count) {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.x);
  std::vector<int> order(vertices);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return x(a, 0) > x(b, 0); });
  std::vector<int> ends(order.begin(), order.begin() + count);
  ends.insert(ends.end(), order.end() - count, order.end());
  return ends;
}

/// Brings one cell to rest, force by force.
class Stretcher {
 public:
  Stretcher(Membranes& membranes, const StretchingSettings& settings)
      : membranes_(membranes),
        settings_(settings),
        patch_(std::max(1, int(std::lround(settings.patch_fraction * membranes.vertices())))),
        ends_(end_vertices(membranes.surfaces(), membranes.vertices(), patch_)),
        search_(membranes.views(), membranes.elasticity(), typical_edge(membranes.diagnostics()[0].area_um2, membranes.views().triangles),
                [&] { return membranes_.largest_stiffness_nN_per_um(); }) {}

  int patch() const { return patch_; }

  StretchingStep hold(double force_pN) {
    apply(force_pN * units::pN / patch_);
    const double first_force_pN = settings_.force_pN / settings_.steps;
    const double scale = (force_pN > 0 ? force_pN : first_force_pN) * units::pN / patch_;
    StretchingStep step;
    step.force_pN = force_pN;
    const auto outcome = search_.run(settings_.tolerance * scale, settings_.max_iterations);
    step.iterations = outcome.iterations;
    step.residual = outcome.force / scale;
    if (!outcome.at_rest) fail(step);
    step.cell = membranes_.diagnostics()[0];
    if (!(step.cell.stretch < strain_limit(membranes_.law(0)))) overstretched(step);
    const Triple extent = step.cell.extent_um();
    step.axial_um = extent[0];
    step.transverse_um = extent[1];
    return step;
  }

 private:
  void apply(double vertex_force) {
    auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), search_.applied());
    for (int k = 0; k < 2 * patch_; ++k) host(ends_[k], 0) = k < patch_ ? vertex_force : -vertex_force;
    Kokkos::deep_copy(search_.applied(), host);
  }

  [[noreturn]] void overstretched(const StretchingStep& step) {
    throw ComputationError(fmt::format(
        "stretching: at {:.4g} pN the force is beyond what the model holds: {}, which none can pass; lower stretching.force_pN, raise "
        "cells.0.shear_modulus_uN_per_m, or spread the force (stretching.patch_fraction)",
        step.force_pN, stretch_text(membranes_.law(0), step.cell.stretch)));
  }

  [[noreturn]] void fail(const StretchingStep& step) {
    throw ComputationError(fmt::format(
        "stretching: at {:.4g} pN the cell is not at rest after {} iterations: residual {:.3g}, wanted {:.3g}; {}. Pull in more "
        "steps (stretching.steps), raise stretching.max_iterations or stretching.tolerance, or lower stretching.force_pN",
        step.force_pN, step.iterations, step.residual, settings_.tolerance,
        stretch_text(membranes_.law(0), membranes_.diagnostics()[0].stretch)));
  }

  Membranes& membranes_;
  const StretchingSettings& settings_;
  int patch_;
  std::vector<int> ends_;
  RestSearch search_;
};

void check_settings(const Membranes& membranes, const StretchingSettings& s) {
  const auto refuse = [](const std::string& what) { throw InputError("stretching: " + what); };
  if (membranes.cells() != 1) refuse(fmt::format("{} cells; give exactly one [[cells]] entry", membranes.cells()));
  if (!(s.force_pN > 0)) refuse(fmt::format("force_pN = {}: must be positive", s.force_pN));
  if (s.steps < 1) refuse(fmt::format("steps = {}: must be at least 1", s.steps));
  if (!(s.patch_fraction > 0 && s.patch_fraction <= 0.25)) {
    refuse(fmt::format("patch_fraction = {}: must be above 0 and at most 0.25; the experiment's beads touch 0.02", s.patch_fraction));
  }
  if (!(s.tolerance > 0 && s.tolerance < 1)) {
    refuse(fmt::format("tolerance = {}: must be between 0 and 1", s.tolerance));
  }
}

}  // namespace

StretchingResult stretch_cell(Membranes& membranes, const StretchingSettings& settings,
                              const std::function<void(const StretchingStep&)>& progress) {
  check_settings(membranes, settings);
  Stretcher stretcher(membranes, settings);
  StretchingResult result;
  result.patch_vertices = stretcher.patch();
  for (int i = 0; i <= settings.steps; ++i) {
    result.steps.push_back(stretcher.hold(settings.force_pN * i / settings.steps));
    if (i == 0) result.rest = disc_shape(body_mesh(membranes.surfaces(), 0));
    if (progress) progress(result.steps.back());
  }
  return result;
}

DiscShape disc_shape(const TriangleMesh& placed) {
  DiscShape shape;
  const PrincipalAxes axes = principal_axes(placed);
  const TriangleMesh mesh = turn_to_z(placed, disc_axis(axes).value_or(Triple{0, 0, 1}), axes.centroid);
  const Triple extent = extents(mesh);
  shape.diameter_um = 0.5 * (extent[0] + extent[1]);
  // Length of the line x, y = const inside the surface: heights where it goes up through the surface, less those where
  // it goes down.
  const auto chord = [&](double x, double y) {
    double length = 0;
    for (const auto& t : mesh.triangles) {
      const Triple &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const auto area2 = [](double ax, double ay, double bx, double by) { return ax * by - ay * bx; };
      const double whole = area2(b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
      if (whole == 0) continue;
      const double wa = area2(b[0] - x, b[1] - y, c[0] - x, c[1] - y) / whole;
      const double wb = area2(c[0] - x, c[1] - y, a[0] - x, a[1] - y) / whole;
      const double wc = 1 - wa - wb;
      if (wa < 0 || wb < 0 || wc < 0) continue;
      length += (whole > 0 ? 1 : -1) * (wa * a[2] + wb * b[2] + wc * c[2]);
    }
    return length;
  };
  // A little beside the axis, which in a symmetric mesh meets vertices and edges.
  const double aside = 1e-7 * shape.diameter_um;
  shape.thickness_center_um = chord(aside, 0.7 * aside);
  for (const auto& t : mesh.triangles) {
    // Through the middle of each triangle, so that no line meets an edge or a vertex of its own.
    double x = 0, y = 0;
    for (int i : t) x += mesh.vertices[i][0] / 3, y += mesh.vertices[i][1] / 3;
    shape.thickness_max_um = std::max(shape.thickness_max_um, chord(x, y));
  }
  return shape;
}

}  // namespace corpuscle
