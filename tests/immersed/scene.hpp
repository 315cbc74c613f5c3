// Grids, surfaces and exact flows that the tests of the immersed boundary share.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "immersed/immersed_boundary.hpp"
#include "immersed/surface.hpp"
#include "immersed/surface_geometry.hpp"

namespace scene {

using corpuscle::Array;
using corpuscle::Components;
using corpuscle::GridViews;
using corpuscle::IndexSpace;
using corpuscle::NodeKind;
using corpuscle::SurfaceSet;
using corpuscle::TriangleMesh;
using corpuscle::Vec3;

/// Position of index-space point (a, b, c), where cell i spans i to i + 1.
using Mapping = std::function<Vec3(double, double, double)>;

inline Mapping uniform(const Vec3& origin, const Vec3& h) {
  return [=](double a, double b, double c) { return Vec3{origin.x + a * h.x, origin.y + b * h.y, origin.z + c * h.z}; };
}

/// An affine map with cells sheared by up to 30 %.
inline Mapping skewed(const Vec3& origin, const Vec3& h) {
  return [=](double a, double b, double c) {
    const Vec3 s{a * h.x, b * h.y, c * h.z};
    return origin + Vec3{s.x + 0.3 * s.y, s.y - 0.2 * s.z + 0.1 * s.x, s.z + 0.25 * s.x};
  };
}

/// A smooth curvilinear map: a uniform grid with waves, five cells long and up to a fifth of a cell high.
inline Mapping wavy(const Vec3& origin, const Vec3& h) {
  return [=](double a, double b, double c) {
    const double k = 2 * M_PI / 12;
    const Vec3 s{a + 0.4 * std::sin(k * b) + 0.3 * std::sin(k * c), b + 0.4 * std::sin(k * c) + 0.3 * std::sin(k * a),
                 c + 0.4 * std::sin(k * a) + 0.3 * std::sin(k * b)};
    return origin + Vec3{s.x * h.x, s.y * h.y, s.z * h.z};
  };
}

struct Block {
  std::array<int, 3> global;
  std::array<int, 3> first{0, 0, 0};
  std::array<int, 3> n{0, 0, 0};  // zero: the whole grid
  std::array<bool, 3> periodic{false, false, false};
};

/// Nodes and base kinds only; the immersed boundary needs no metric.
inline GridViews make_grid(const Block& block, const Mapping& at) {
  GridViews grid;
  IndexSpace& index = grid.index;
  for (int d = 0; d < 3; ++d) {
    index.global[d] = block.global[d];
    index.first[d] = block.first[d];
    index.n[d] = block.n[d] > 0 ? block.n[d] : block.global[d];
    index.periodic[d] = block.periodic[d];
  }
  grid.x = Components<double>("corpuscle::test::x", index.size(), 3);
  grid.base_kind = Array<NodeKind>("corpuscle::test::base_kind", index.size());
  const auto x = Kokkos::create_mirror_view(grid.x);
  const auto kind = Kokkos::create_mirror_view(grid.base_kind);
  for (int c = 0; c < index.size(); ++c) {
    int i[3];
    index.unpack(c, i[0], i[1], i[2]);
    double s[3];
    kind(c) = NodeKind::fluid;
    for (int d = 0; d < 3; ++d) {
      const int g = index.first[d] + i[d];
      s[d] = g + 0.5;
      if (index.periodic[d]) continue;
      if (g == -1) s[d] = 0;
      if (g == index.global[d]) s[d] = index.global[d];
      if (g < -1 || g > index.global[d]) {
        kind(c) = NodeKind::none;
      } else if ((g == -1 || g == index.global[d]) && kind(c) == NodeKind::fluid) {
        kind(c) = NodeKind::boundary;
      }
    }
    const Vec3 p = at(s[0], s[1], s[2]);
    for (int d = 0; d < 3; ++d) x(c, d) = kind(c) == NodeKind::none ? std::nan("") : p[d];
  }
  Kokkos::deep_copy(grid.x, x);
  Kokkos::deep_copy(grid.base_kind, kind);
  return grid;
}

/// Icosahedron with every triangle split in four `level` times, on the unit sphere: 10 * 4^level + 2 vertices.
inline TriangleMesh unit_sphere(int level) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2}, {3, 2, 6}, {3, 6, 8},  {3, 8, 9},   {4, 9, 5}, {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<int, int>, int> middle;
    std::vector<std::array<int, 3>> finer;
    const auto split = [&](int a, int b) {
      const auto [entry, isnew] = middle.try_emplace({std::min(a, b), std::max(a, b)}, int(mesh.vertices.size()));
      if (isnew) {
        corpuscle::Triple m;
        for (int d = 0; d < 3; ++d) m[d] = 0.5 * (mesh.vertices[a][d] + mesh.vertices[b][d]);
        mesh.vertices.push_back(m);
      }
      return entry->second;
    };
    for (const auto& t : mesh.triangles) {
      const int a = split(t[0], t[1]), b = split(t[1], t[2]), c = split(t[2], t[0]);
      finer.push_back({t[0], a, c});
      finer.push_back({t[1], b, a});
      finer.push_back({t[2], c, b});
      finer.push_back({a, b, c});
    }
    mesh.triangles = finer;
    for (auto& v : mesh.vertices) {
      const double r = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
      for (double& x : v) x /= r;
    }
  }
  for (auto& v : mesh.vertices) {
    const double r = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (double& x : v) x /= r;
  }
  return mesh;
}

inline TriangleMesh sphere(int level, double radius, const Vec3& centre) {
  TriangleMesh mesh = unit_sphere(level);
  for (auto& v : mesh.vertices) {
    for (int d = 0; d < 3; ++d) v[d] = centre[d] + radius * v[d];
  }
  return mesh;
}

/// The resting red cell (physics of the README, Equation 1), its axis turned by `tilt` from z towards x.
inline TriangleMesh biconcave(int level, const Vec3& centre, double tilt = 0) {
  TriangleMesh mesh = unit_sphere(level);
  const double d0 = 7.82, a0 = 0.0518, a1 = 2.0026, a2 = -4.491;
  for (auto& v : mesh.vertices) {
    const double x = 0.5 * d0 * v[0], y = 0.5 * d0 * v[1], q = (x * x + y * y) / (d0 * d0);
    const double z = d0 * v[2] * (a0 + a1 * q + a2 * q * q);
    v = {centre.x + std::cos(tilt) * x + std::sin(tilt) * z, centre.y + y, centre.z - std::sin(tilt) * x + std::cos(tilt) * z};
  }
  return mesh;
}

inline void move(const SurfaceSet& s, const Vec3& by) {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), s.x);
  for (int v = 0; v < s.vertices; ++v) {
    for (int d = 0; d < 3; ++d) x(v, d) += by[d];
  }
  Kokkos::deep_copy(s.x, x);
  corpuscle::update_surface_geometry(s);
}

template <class View>
auto on_host(const View& view) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
}

using VectorField = std::function<Vec3(const Vec3&)>;
using ScalarField = std::function<double(const Vec3&)>;

/// Field values at the points of x; NaN where `wanted(entry)` is false, so that any use of them shows.
template <class Wanted>
Components<double> sample(const Components<double>& x, const VectorField& field, const Wanted& wanted) {
  Components<double> u("corpuscle::test::u", x.extent(0), 3);
  const auto host_x = on_host(x);
  const auto host = Kokkos::create_mirror_view(u);
  for (int c = 0; c < int(x.extent(0)); ++c) {
    const Vec3 value = wanted(c) ? field(corpuscle::load(host_x, c)) : Vec3{NAN, NAN, NAN};
    for (int d = 0; d < 3; ++d) host(c, d) = value[d];
  }
  Kokkos::deep_copy(u, host);
  return u;
}

template <class Wanted>
Array<double> sample(const Components<double>& x, const ScalarField& field, const Wanted& wanted) {
  Array<double> p("corpuscle::test::p", x.extent(0));
  const auto host_x = on_host(x);
  const auto host = Kokkos::create_mirror_view(p);
  for (int c = 0; c < int(x.extent(0)); ++c) host(c) = wanted(c) ? field(corpuscle::load(host_x, c)) : NAN;
  Kokkos::deep_copy(p, host);
  return p;
}

inline void set_velocity(const SurfaceSet& s, const VectorField& field) {
  const auto x = on_host(s.x);
  const auto v = Kokkos::create_mirror_view(s.v);
  for (int e = 0; e < s.vertices; ++e) {
    const Vec3 value = field(corpuscle::load(x, e));
    for (int d = 0; d < 3; ++d) v(e, d) = value[d];
  }
  Kokkos::deep_copy(s.v, v);
}

/// Stokes flow around a sphere of radius a at `centre` that moves at U in fluid at rest (Batchelor, section 4.9).
struct StokesSphere {
  double a, viscosity;
  Vec3 velocity, centre;

  Vec3 u(const Vec3& x) const {
    const Vec3 r = x - centre;
    const double d = norm(r), along = dot(r, velocity) / (d * d);
    return (0.75 * a / d) * (velocity + along * r) + (0.25 * a * a * a / (d * d * d)) * (velocity - 3 * along * r);
  }
  double p(const Vec3& x) const {
    const Vec3 r = x - centre;
    const double d = norm(r);
    return 1.5 * viscosity * a * dot(r, velocity) / (d * d * d);
  }
};

}  // namespace scene
