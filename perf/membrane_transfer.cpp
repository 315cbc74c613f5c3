// How membranes pass forces to the fluid, beside exact solutions; perf/membrane_transfer.py runs the tables.
//   membrane_transfer rest   KERNEL GRID A_OVER_H AX AY AZ        uniform normal load: currents and jump of pressure
//   membrane_transfer sphere KERNEL A_OVER_H RX RY RZ FX FY FZ    uniform force: radius that the fluid sees (Hasimoto)
//   membrane_transfer plates KERNEL RX RY M OFFSET                slip along two plates x + M y = const
// KERNEL is three or four; GRID is box or tube; R are relative spacings of the grid, h the largest of them.
#include <cmath>
#include <cstring>

#include "cells/rank_blocks.hpp"
#include "held_surface.hpp"
#include "program.hpp"
#include "transfer/delta.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

using Kernel = CouplingSettings::Kernel;
using Type = BoundarySettings::Type;
const double pi = std::acos(-1.0);

Kernel kernel_of(const char* name) { return std::strcmp(name, "four") == 0 ? Kernel::four_point : Kernel::three_point; }

FluidSettings stokes() {
  FluidSettings settings;
  settings.density_pg_per_um3 = 1;
  settings.kinematic_viscosity_um2_per_us = 1;
  settings.convection = FluidSettings::Convection::none;
  return settings;
}

std::vector<BoundarySettings> all_sides(Type type) {
  std::vector<BoundarySettings> all(6);
  for (int s = 0; s < 6; ++s) all[s].side = static_cast<BoundarySettings::Side>(s), all[s].type = type;
  return all;
}

NodeSource box(const std::array<int, 3>& cells, double length) {
  return {
      cells, [=](int i, int j, int k) {
        return Triple{length * (i / double(cells[0]) - 0.5), length * (j / double(cells[1]) - 0.5), length * (k / double(cells[2]) - 0.5)};
      }};
}

void rest(char** words) {
  const double a_over_h = std::atof(words[2]), h = 1 / a_over_h;
  const Triple axes{std::atof(words[3]), std::atof(words[4]), std::atof(words[5])};
  const int n = static_cast<int>(std::lround(4 * a_over_h));
  NodeSource nodes = box({n, n, n}, 4);
  if (std::strcmp(words[1], "tube") == 0) {
    GridSettings tube;
    tube.generator = GridSettings::Generator::straight_tube;
    tube.diameter_um = 4, tube.length_um = 4;
    tube.nodes = {n + 1, n + 1, n + 1};
    nodes = make_node_source(tube);
  }
  HeldSurface held(nodes, all_sides(Type::wall), stokes(), ellipsoid_mesh(axes, {0.03, -0.02, 0.01}, 0.4 * h), kernel_of(words[0]));
  held.set_force([](const Vec3&, const Vec3& area) { return area; });
  held.settle(6, 40 * h * h);
  double most = 0, inside = 0, outside = 0;
  int within = 0, without = 0;
  held.visit_cells([&](const Vec3& x, double p, const Vec3& u) {
    most = std::max(most, norm(u));
    const double r = std::sqrt(std::pow(x.x / axes[0], 2) + std::pow(x.y / axes[1], 2) + std::pow(x.z / axes[2], 2));
    const double distance = (r - 1) * std::min({axes[0], axes[1], axes[2]});
    if (distance < -2 * h) inside += p, ++within;
    if (distance > 2 * h) outside += p, ++without;
  });
  std::printf("{\"vertices\": %d, \"speed_at_vertices\": %.3e, \"speed_in_cells\": %.3e, \"jump\": %.5f}\n", held.surface.vertices,
              held.largest_vertex_speed(), most, outside / without - inside / within);
}

/// The radius that makes Hasimoto's speed of a uniform force over a sphere the one found.
void sphere(char** words) {
  const double a_over_h = std::atof(words[1]);
  const Triple ratio{std::atof(words[2]), std::atof(words[3]), std::atof(words[4])};
  Vec3 direction{std::atof(words[5]), std::atof(words[6]), std::atof(words[7])};
  direction *= 1 / norm(direction);
  const double widest = std::max({ratio[0], ratio[1], ratio[2]}), narrowest = std::min({ratio[0], ratio[1], ratio[2]});
  const double length = a_over_h < 4 ? 6 : 4, total = 6 * pi;
  std::array<int, 3> cells;
  for (int d = 0; d < 3; ++d) cells[d] = static_cast<int>(std::lround(length * a_over_h * widest / ratio[d]));
  const double h = 1 / a_over_h;
  auto settings = stokes();
  const Vec3 gradient = (1e3 * total / std::pow(length, 3)) * direction;
  settings.pressure_gradient_Pa_per_um = {gradient.x, gradient.y, gradient.z};
  double speed[2] = {0, 0}, least[2] = {1e9, 1e9}, most[2] = {-1e9, -1e9};
  const int places = 3;
  for (int place = 0; place < places; ++place) {
    const Triple center{0.21 * place * h, (0.37 * place + 0.1) * h, (0.13 * place - 0.2) * h};
    HeldSurface held(box(cells, length), all_sides(Type::periodic), settings,
                     ellipsoid_mesh({1, 1, 1}, center, 0.7 * h * narrowest / widest), kernel_of(words[0]));
    const auto area = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), held.surface.area);
    double whole = 0;
    for (int i = 0; i < held.surface.vertices; ++i) whole += area(i);
    const auto f = Kokkos::create_mirror_view(held.force);
    for (int i = 0; i < held.surface.vertices; ++i) store(f, i, (total * area(i) / whole) * direction);
    Kokkos::deep_copy(held.force, f);
    held.settle(5, 2 * length * length, false);
    for (int slip = 0; slip < 2; ++slip) {
      if (slip) held.take_velocity(true);
      const double found = dot(held.mean_velocity(), direction);
      const double radius = 1 / (6 * pi * found / total + 2.837297 / length - 4 * pi / 3 / std::pow(length, 3)), error = (radius - 1) / h;
      speed[slip] += error / places;
      least[slip] = std::min(least[slip], error), most[slip] = std::max(most[slip], error);
    }
  }
  std::printf(
      "{\"cells\": [%d, %d, %d], \"error_h\": %.4f, \"from\": %.4f, \"to\": %.4f, \"with_slip_h\": %.4f, \"slip_from\": %.4f, "
      "\"slip_to\": %.4f}\n",
      cells[0], cells[1], cells[2], speed[0], least[0], most[0], speed[1], least[1], most[1]);
}

/// Two plates half a period apart with opposite forces along them: the velocity between them is linear.
void plates(char** words) {
  const Triple ratio{std::atof(words[1]), std::atof(words[2]), 1};
  const int m = std::atoi(words[3]);
  const double offset = std::atof(words[4]), length = 1;
  const double widest = std::max(ratio[0], ratio[1]);
  std::array<int, 3> cells{0, 0, 8};
  for (int d = 0; d < 2; ++d) cells[d] = static_cast<int>(std::lround(16 * widest / ratio[d]));
  const double hx = length / cells[0], hy = length / cells[1];
  const Vec3 normal = (1 / std::sqrt(1.0 + m * m)) * Vec3{1, double(m), 0}, along{-normal.y, normal.x, 0};
  // Points on x + m y = c: one period of y, and m of x.
  const int per_line = 4 * static_cast<int>(std::lround(length * std::sqrt(1.0 + m * m) / std::min(hx, hy))), lines = 32;
  const int count = 2 * per_line * lines;
  Grid grid(Comm(), box(cells, length), {true, true, true});
  const auto shifts = period_shifts(grid);
  const int copies = static_cast<int>(shifts.size());  // of every point, what it is itself first
  Components<double> x("corpuscle::plates::x", copies * count, 3), force("corpuscle::plates::force", copies * count, 3),
      v("corpuscle::plates::v", copies * count, 3);
  const auto xh = Kokkos::create_mirror_view(x), fh = Kokkos::create_mirror_view(force);
  const double plate_area = length * length * std::sqrt(1.0 + m * m);
  for (int plate = 0, i = 0; plate < 2; ++plate)
    for (int s = 0; s < per_line; ++s)
      for (int l = 0; l < lines; ++l, ++i) {
        const double y = length * (s + 0.3) / per_line, c = offset * hx + 0.5 * plate * length;
        double at = c - m * y;
        at -= std::floor(at / length + 0.5) * length;
        for (int copy = 0; copy < copies; ++copy) {
          store(xh, copy * count + i, Vec3{at, y - 0.5 * length, length * ((l + 0.4) / lines - 0.5)} + shifts[copy]);
          store(fh, copy * count + i, ((plate == 0 ? 1 : -1) * plate_area / (per_line * lines)) * along);
        }
      }
  Kokkos::deep_copy(x, xh);
  Kokkos::deep_copy(force, fh);
  const auto boundaries = all_sides(Type::periodic);
  FluidSolver fluid(grid, stokes(), boundaries);
  fluid.raise_reference_speed(1e-2);
  Transfer transfer(grid, boundaries, kernel_of(words[0]), copies * count);
  fluid.set_face_force(transfer.faces());
  transfer.place(x);
  transfer.spread(force);
  for (int s = 0; s < 5; ++s) {
    fluid.begin_step(2);
    fluid.solve(2 * (s + 1), nullptr);
  }
  transfer.interpolate(fluid.flux(), fluid.velocity(), nullptr, v);
  const auto vh = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), v);
  double difference = 0;
  for (int i = 0; i < copies * count; ++i) difference += (i % count < count / 2 ? 2.0 : -2.0) / count * dot(load(vh, i), along);
  // Half of the force goes to either side; each plate lags behind by c h f / mu.
  const double distance = 0.5 * length / std::sqrt(1.0 + m * m), deficit = 0.5 * (0.5 * distance - difference);
  const double h = std::sqrt(std::pow(hx * normal.x, 2) + std::pow(hy * normal.y, 2));
  const SlipLaw law = kernel_of(words[0]) == Kernel::four_point ? slip_law<FourPointDelta>() : slip_law<ThreePointDelta>();
  const double corrected = dot(slip_motion(law, {{hx, 0, 0}, {0, hy, 0}, {0, 0, length / cells[2]}}, normal, along), along);
  std::printf("{\"slip_over_spacing\": %.4f, \"law\": %.4f}\n", deficit / h, corrected / h);
}

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, 6, "rest|sphere|plates KERNEL ...", [](int, char** words) {
    const std::string what = words[1];
    if (what == "rest") rest(words + 2);
    if (what == "sphere") sphere(words + 2);
    if (what == "plates") plates(words + 2);
  });
}
