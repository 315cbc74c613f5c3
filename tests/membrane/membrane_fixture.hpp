// Shared by the membrane tests: positions in and out of the device, fixed random numbers.
#pragma once

#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "membrane/membranes.hpp"

namespace corpuscle::testing {

/// Print a measured figure if CORPUSCLE_SHOW is set in the environment.
template <class... Values>
void report(fmt::format_string<Values...> text, Values&&... values) {
  if (std::getenv("CORPUSCLE_SHOW")) WARN(fmt::format(text, std::forward<Values>(values)...));
}

inline CellSettings cell_settings(int vertices, double mass_pg = 100) {
  CellSettings cell;
  cell.vertices = vertices;
  cell.mass_pg = mass_pg;
  return cell;
}

/// The first `rows` rows of a [row, 3] view on the host.
inline std::vector<Vec3> to_host(const Components<double>& view, int rows) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  std::vector<Vec3> values;
  for (int i = 0; i < rows; ++i) values.push_back(load(host, i));
  return values;
}

inline void to_device(const std::vector<Vec3>& values, const Components<double>& view) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  for (std::size_t i = 0; i < values.size(); ++i) store(host, int(i), values[i]);
  Kokkos::deep_copy(view, host);
}

inline Components<double> make_field(const std::vector<Vec3>& values) {
  Components<double> view("corpuscle::test::field", values.size(), 3);
  to_device(values, view);
  return view;
}

/// Stress of a fluid with the given pressures and viscous tractions at the vertices, kPa.
inline SurfaceStress make_stress(const std::vector<double>& pressure, const std::vector<Vec3>& viscous) {
  const SurfaceStress stress = make_surface_stress("corpuscle::test::stress", int(pressure.size()));
  const auto host = Kokkos::create_mirror_view(stress.values);
  for (std::size_t i = 0; i < pressure.size(); ++i) {
    host(i, 0) = pressure[i];
    for (int d = 0; d < 3; ++d) host(i, 1 + d) = viscous[i][d];
  }
  Kokkos::deep_copy(stress.values, host);
  return stress;
}

/// Viscous tractions alone.
inline SurfaceStress make_stress(const std::vector<Vec3>& viscous) {
  return make_stress(std::vector<double>(viscous.size(), 0.0), viscous);
}

/// Uniform in [-1, 1] and the same on every platform.
class Noise {
 public:
  double operator()() { return 2 * (double(engine_()) / 4294967295.0) - 1; }
  Vec3 vec() {
    const double a = (*this)(), b = (*this)(), c = (*this)();
    return {a, b, c};
  }

 private:
  std::mt19937 engine_{20210406};
};

/// A triangle without symmetry, at rest and stretched along x and y.
struct StretchedTriangle {
  double a = 1.3, b = 0.8;  // along x and y
  double area = 0;          // at rest
  TriangleRest rest{};
  std::array<Vec3, 3> moved;
  TriangleShape shape;

  StretchedTriangle() {
    const Vec3 corner[3] = {{0.1, 0.2, 0}, {0.9, -0.1, 0}, {0.3, 0.8, 0}};
    area = rest.area = 0.5 * cross(corner[1] - corner[0], corner[2] - corner[0]).z;
    const TriangleShape at_rest = triangle_shape(corner, {0, 0, 1}, area);
    Vec3 at[3];
    for (int k = 0; k < 3; ++k) {
      rest.length[k] = at_rest.length[k];
      at[k] = moved[k] = {a * corner[k].x, b * corner[k].y, 0};
    }
    shape = triangle_shape(at, {0, 0, 1}, a * b * area);
  }
};

/// A cell stretched, sheared and shaken: no symmetry left, every term at work, no link near its limit.
inline std::vector<Vec3> deformed(const std::vector<Vec3>& rest, double noise_um) {
  Noise noise;
  std::vector<Vec3> x = rest;
  for (Vec3& p : x) {
    p = Vec3{1.08 * p.x + 0.1 * p.y, 0.97 * p.y + 0.05 * p.z, 1.05 * p.z + 0.02 * p.x * p.y} + noise_um * noise.vec();
  }
  return x;
}

}  // namespace corpuscle::testing
