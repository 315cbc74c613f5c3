#include "membrane/spheroid_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "immersed/surface.hpp"
#include "membrane/inertia.hpp"
#include "membrane/membrane_setup.hpp"
#include "membrane/rest_search.hpp"
#include "membrane/self_crossing.hpp"
#include "membrane/shape_measures.hpp"
#include "membrane/stretching.hpp"
#include "membrane/surface_shape.hpp"

namespace corpuscle {

namespace {

constexpr double pi = 3.14159265358979323846;

double distance(const Triple& a, const Triple& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

/// What would help, for messages.
std::string remedy(const CellSettings& cell) {
  return fmt::format("bring {} = {:g} nearer to that of the biconcave shape (0.64), or its moduli nearer to a red cell's",
                     constant_key(cell, "reference_reduced_volume"), cell.reference_reduced_volume);
}

[[noreturn]] void refuse(const CellSettings& cell, const std::string& what) {
  throw InputError(fmt::format("{} = \"spheroid\": {}: {}", constant_key(cell, "reference"), what, remedy(cell)));
}

/// One biconcave cell on the device, moved until it rests with its volume exactly that of the mesh.
class Relaxation {
 public:
  Relaxation(const CellReference& reference, const CellSettings& cell)
      : cell_(cell), law_(reference.law), volume_(reference.law.rest_volume), modulus_(cell.shear_modulus_uN_per_m * units::uN_per_m) {
    CellReference held = reference;
    held.law.volume = law_.volume = std::max(law_.volume, least_volume_modulus);
    views_ = make_membrane_views(make_surface_set({held.mesh}), {held}, {0});
    elasticity_ = make_elasticity({held}, {0});
    edge_ = typical_edge(law_.rest_area, views_.triangles);
  }

  /// @return iterations
  int run() {
    RestSearch search(views_, *elasticity_, edge_, [&] { return stiffness(); });
    const double force = residual * modulus_ * edge_;
    int iterations = 0;
    for (int round = 0; round < most_rounds; ++round) {
      const auto outcome = search.run(force, most_iterations);
      iterations += outcome.iterations;
      if (!outcome.at_rest) fail(outcome.force / (modulus_ * edge_), iterations);
      const double lacking = volume_ - volume(mesh());
      if (std::abs(lacking) < volume_tolerance * volume_) return iterations;
      // The modulus alone would leave the volume where it balances the sheet: aim so far beyond that it ends at V0.
      aim(law_.rest_volume + lacking);
    }
    fail(0, iterations);
  }

  /// Bend the cell a little towards a cup and a saddle, so that it leaves a balance that is not stable.
  void push() const {
    TriangleMesh pushed = mesh();
    double radius2 = 0;
    for (const Triple& p : pushed.vertices) radius2 = std::max(radius2, p[0] * p[0] + p[1] * p[1]);
    const double size = push_size * std::sqrt(radius2);
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.surface.x);
    for (std::size_t i = 0; i < pushed.vertices.size(); ++i) {
      const Triple& p = pushed.vertices[i];
      host(i, 2) += size * (2 * p[0] * p[0] + p[0] * p[1]) / radius2;
    }
    Kokkos::deep_copy(views_.surface.x, host);
  }

  TriangleMesh mesh() const { return body_mesh(views_.surface, 0); }

 private:
  static constexpr double least_volume_modulus = 0.248;  // kPa
  static constexpr double residual = 1e-5;               // of a vertex's force over modulus and edge; a link 10 % too long has 0.2
  static constexpr double volume_tolerance = 1e-7;
  static constexpr double push_size = 0.02;  // of the radius
  static constexpr int most_rounds = 20, most_iterations = 30000;

  void aim(double rest_volume) {
    law_.rest_volume = rest_volume;
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.law);
    host(0) = law_;
    Kokkos::deep_copy(views_.law, host);
  }

  double stiffness() const {
    const Array<double> eigenvalue(uninitialised("corpuscle::membrane::eigenvalue_cell"), 1);
    largest_stiffness(views_, *elasticity_, make_stiffness_views(views_), 30, eigenvalue);
    return HostCopy(eigenvalue).read()(0);
  }

  [[noreturn]] void fail(double left, int iterations) const {
    refuse(cell_, fmt::format("the cell does not come to rest ({} iterations; {:.2g} of shear modulus x edge left on a vertex, {:.2g} "
                              "wanted)",
                              iterations, left, residual));
  }

  const CellSettings& cell_;
  CellLaw law_;
  double volume_, modulus_, edge_ = 0;
  MembraneViews views_;
  std::unique_ptr<Elasticity> elasticity_;
};

RelaxedShape measure_relaxed(const TriangleMesh& mesh, int iterations) {
  const DiscShape disc = disc_shape(mesh);
  const PrincipalAxes axes = principal_axes(mesh);
  const auto along = parachute_measures(mesh, axes.centroid, {0, 0, 1});
  return {iterations, disc.diameter_um, disc.thickness_center_um, disc.thickness_max_um, {along.rear_hollow_um, along.front_dimple_um}};
}

void report(const CellSettings& cell, const RelaxedShape& s) {
  const std::string what = fmt::format(
      "{} on a spheroid of reduced volume {:g}: at rest after {} iterations as a disc of {:.2f} um, {:.2f} um thick at its "
      "centre "
      "and {:.2f} at most, dimples of {:.2f} and {:.2f} um",
      constant_key(cell, "reference"), cell.reference_reduced_volume, s.iterations, s.diameter, s.thickness_center, s.thickness_max,
      s.dimple[0], s.dimple[1]);
  if (s.biconcave())
    info("{}", what);
  else
    warn("{}: this is not biconcave; {}", what, remedy(cell));
}

}  // namespace

Triple oblate_semi_axes(double area, double reduced_volume) {
  // Of b = ratio a: A = 2 pi a^2 (1 + (1 - e^2) / e atanh e), e^2 = 1 - ratio^2. The reduced volume rises with the ratio.
  const auto area_factor = [](double ratio) {
    const double e = std::sqrt(1 - ratio * ratio);
    return 2 * pi * (e < 1e-6 ? 2 : 1 + ratio * ratio / e * std::atanh(e));
  };
  double low = 1e-3, high = 1;
  for (int i = 0; i < 200; ++i) {
    const double ratio = 0.5 * (low + high);
    const double reduced = 6 * std::sqrt(pi) * 4 * pi / 3 * ratio / std::pow(area_factor(ratio), 1.5);
    (reduced < reduced_volume ? low : high) = ratio;
  }
  const double ratio = 0.5 * (low + high), a = std::sqrt(area / area_factor(ratio));
  return {a, a, ratio * a};
}

TriangleMesh on_spheroid(const TriangleMesh& biconcave, double diameter_um, double reduced_volume) {
  const BiconcaveShape from;
  const double size = diameter_um / BiconcaveShape::D0;
  const EllipsoidShape to(oblate_semi_axes(size * size * from.area(), reduced_volume));
  TriangleMesh mesh = biconcave;
  for (Triple& p : mesh.vertices) {
    const Vec3 x = to.from_sphere(from.to_sphere({p[0] / size, p[1] / size, p[2] / size}));
    p = {x.x, x.y, x.z};
  }
  const double scale = std::sqrt(area(biconcave) / area(mesh));
  for (Triple& p : mesh.vertices)
    for (double& c : p) c *= scale;
  return mesh;
}

void rest_on_spheroid(CellReference& r, const CellSettings& cell) {
  const TriangleMesh spheroid = on_spheroid(r.mesh, cell.diameter_um, cell.reference_reduced_volume);
  for (std::size_t t = 0; t < spheroid.triangles.size(); ++t) {
    Triple corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = spheroid.vertices[spheroid.triangles[t][k]];
    for (int k = 0; k < 3; ++k) r.rest_length[t][k] = distance(corner[(k + 1) % 3], corner[(k + 2) % 3]);
    r.rest_area[t] = area({{corner[0], corner[1], corner[2]}, {{0, 1, 2}}});
  }
  Relaxation relaxation(r, cell);
  int iterations = relaxation.run();
  relaxation.push();
  iterations += relaxation.run();
  r.mesh = relaxation.mesh();
  if (find_self_crossing(r.mesh)) refuse(cell, fmt::format("the cell comes to rest passing through itself ({} iterations)", iterations));
  r.relaxed = measure_relaxed(r.mesh, iterations);
  report(cell, *r.relaxed);
}

}  // namespace corpuscle
