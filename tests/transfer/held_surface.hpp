// A closed surface held in place in a fluid at rest at infinity, and given forces on its vertices: what the flow does with
// them. Every rank has all of the surface, and its part of the grid.
#pragma once

#include <algorithm>
#include <cmath>

#include "coupling/rigid_bodies.hpp"
#include "fluid/fluid_solver.hpp"
#include "immersed/surface.hpp"
#include "immersed/surface_geometry.hpp"
#include "transfer/transfer.hpp"

namespace corpuscle::testing {

/// A sphere or ellipsoid of about `edge` um an edge.
inline TriangleMesh ellipsoid_mesh(const Triple& semi_axes, const Triple& center, double edge) {
  BodySettings body;
  body.shape = BodySettings::Shape::ellipsoid;
  body.semi_axes_um = semi_axes;
  body.center_um = center;
  return make_body_mesh(body, edge);
}

class HeldSurface {
 public:
  HeldSurface(const NodeSource& nodes, const std::vector<BoundarySettings>& boundaries, const FluidSettings& settings,
              const TriangleMesh& mesh, CouplingSettings::Kernel kernel, bool sharp_pressure = false)
      : grid(Comm(), nodes, periodic(boundaries)),
        fluid(grid, settings, boundaries),
        surface(make_surface_set({mesh})),
        transfer(grid, boundaries, kernel, surface.vertices),
        force("corpuscle::test::force", surface.vertices, 3),
        velocity("corpuscle::test::velocity", surface.vertices, 3),
        sharp(sharp_pressure) {
    if (sharp) transfer.sharpen_pressure();
    fluid.set_face_force(transfer.faces());
    fluid.raise_reference_speed(1);
  }

  /// Force on every vertex as load(position, area vector), nN.
  void set_force(const std::function<Vec3(const Vec3&, const Vec3&)>& load_of) {
    const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surface.x);
    const auto f = Kokkos::create_mirror_view(force);
    const TriangleMesh mesh = body_mesh(surface, 0);
    std::vector<Vec3> area(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
      const Vec3 a = area_vector(load(x, t[0]), load(x, t[1]), load(x, t[2]));
      for (int corner : t) area[corner] += (1.0 / 3) * a;
    }
    for (int i = 0; i < surface.vertices; ++i) store(f, i, load_of(load(x, i), area[i]));
    Kokkos::deep_copy(force, f);
  }

  /// Steps of the fluid with the surface where it is.
  void settle(int steps, double dt_us, bool slip = false) {
    transfer.place(surface.x);
    spread();
    for (int s = 0; s < steps; ++s) {
      fluid.begin_step(dt_us);
      fluid.solve((s + 1) * dt_us, nullptr);
    }
    take_velocity(slip);
  }
  void spread() {
    if (sharp)
      transfer.spread(force, surface);
    else
      transfer.spread(force);
  }
  void take_velocity(bool slip) {
    const SlipViews correction = transfer.slip(surface, force, fluid.viscosity());
    transfer.interpolate(fluid.flux(), fluid.velocity(), slip ? &correction : nullptr, velocity);
    const auto sum = Kokkos::create_mirror(velocity);  // of the ranks' parts
    Kokkos::deep_copy(sum, velocity);
    grid.comm().sum(sum.data(), static_cast<int>(sum.size()));
    Kokkos::deep_copy(velocity, sum);
  }

  double largest_vertex_speed() const {
    const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), velocity);
    double most = 0;
    for (int i = 0; i < surface.vertices; ++i) most = std::max(most, norm(load(v, i)));
    return most;
  }
  /// Mean over the surface.
  Vec3 mean_velocity() const {
    const auto v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), velocity);
    const auto a = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surface.area);
    Vec3 sum;
    double area = 0;
    for (int i = 0; i < surface.vertices; ++i) sum += a(i) * load(v, i), area += a(i);
    return (1 / area) * sum;
  }
  /// Calls body(centre, pressure, velocity) for every cell of this rank.
  template <class Body>
  void visit_cells(const Body& body) {
    const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid.views().x);
    const auto p = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), fluid.pressure());
    const auto u = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), fluid.velocity());
    const IndexSpace& index = grid.index();
    for (int k = 0; k < index.n[2]; ++k)
      for (int j = 0; j < index.n[1]; ++j)
        for (int i = 0; i < index.n[0]; ++i) {
          const int c = index.cell(i, j, k);
          body(load(x, c), p(c), load(u, c));
        }
  }

  Grid grid;
  FluidSolver fluid;
  SurfaceSet surface;
  Transfer transfer;
  Components<double> force, velocity;
  bool sharp;

 private:
  static std::array<bool, 3> periodic(const std::vector<BoundarySettings>& boundaries) {
    std::array<bool, 3> along{};
    for (const auto& b : boundaries)
      if (b.type == BoundarySettings::Type::periodic) along[static_cast<int>(b.side) / 2] = true;
    return along;
  }
};

}  // namespace corpuscle::testing
