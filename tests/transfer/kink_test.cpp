// Where one fluid is outside a membrane and another inside: what is taken off the velocity's kink, and of forces.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "cells/rank_blocks.hpp"
#include "fields.hpp"
#include "transfer/kink.hpp"

using namespace corpuscle;
using namespace corpuscle::transfer_test;

namespace {

constexpr double ratio = 50;

/// Points with a normal, of one type.
struct Points {
  Points(const Components<double>& x, const Components<double>& force_of, const std::function<Triple(int)>& normal)
      : force(force_of), type("corpuscle::test::type", 1) {
    const auto count = static_cast<int>(x.extent(0));
    set.vertices = count, set.bodies = set.cells = 1;
    set.x = x;
    set.normal = points(count, [&](int i) {
      const Triple n = normal(i);
      const double size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      return Triple{n[0] / size, n[1] / size, n[2] / size};
    });
    set.area = Array<double>("corpuscle::test::area", count);
    set.vertex_body = Array<int>("corpuscle::test::body", count);
    Kokkos::deep_copy(set.area, 0.01);
  }
  SlipViews slip(const Transfer& transfer) const { return transfer.slip(set, force, viscosity, type, gap); }

  SurfaceSet set;
  Components<double> force;
  Array<int> type;
  Array<double> gap;  // um, if any
  double viscosity = 1;
};

/// In a fluid so viscous that none slips: what is left is the kink.
/// @param shifts  of the images of each
Points random_points(int count, double edge, bool warped, const std::vector<Vec3>& shifts = {Vec3{}}) {
  Noise noise;
  std::vector<Triple> force, normal;
  for (auto* of : {&force, &normal})
    for (int i = 0; i < count; ++i) of->push_back({noise(-1, 1), noise(-1, 1), noise(-1, 1)});
  const auto one = on_host(inside(count, edge, warped));
  const int all = count * static_cast<int>(shifts.size());
  const auto at = [&](int i) {
    const Vec3 x = load(one, i % count) + shifts[i / count];
    return Triple{x.x, x.y, x.z};
  };
  Points p(points(all, at), points(all, [&](int i) { return force[i % count]; }), [&](int i) { return normal[i % count]; });
  p.viscosity = 1e30;
  return p;
}

Components<double> velocity_of(Transfer& transfer, const Field& field, const Points& p, bool with) {
  Components<double> v("corpuscle::test::v", p.set.vertices, 3);
  const SlipViews slip = p.slip(transfer);
  transfer.interpolate(field.flux, field.u, with ? &slip : nullptr, v);
  return v;
}

}  // namespace

TEST_CASE("forces go the way back that velocities lose their kink", "[transfer][ranks]") {
  // On a grid without two parallel faces, up to sides of every kind, or closed upon itself: as without the kink, to round-off.
  struct Setting {
    std::array<Type, 6> types;
    bool periodic;
  };
  const auto s =
      GENERATE(Setting{walls, false},
               Setting{{Type::symmetry, Type::moving_wall, Type::velocity_inlet, Type::outflow, Type::symmetry, Type::symmetry}, false},
               Setting{{Type::periodic, Type::periodic, Type::moving_wall, Type::symmetry, Type::periodic, Type::periodic}, true});
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  Grid grid(comm, s.periodic ? sheared_box({12, 11, 13}) : warped_box({12, 11, 13}), {s.periodic, false, s.periodic});
  const Points p = random_points(300, 0.02, !s.periodic, s.periodic ? period_shifts(grid) : std::vector{Vec3{}});
  Transfer transfer(grid, sides(s.types), kernel, p.set.vertices);
  transfer.slip_between({ratio});
  REQUIRE(transfer.place(p.set.x) == -1);
  const SlipViews slip = p.slip(transfer);
  transfer.spread(p.force, &slip);
  const Field field = make_field(grid, rough);
  const auto f = on_host(p.force);
  double magnitudes = 0;
  const auto power = [&](bool with) {
    const auto u = sum_of_ranks(velocity_of(transfer, field, p, with));
    double sum = 0;
    magnitudes = 0;
    for (int i = 0; i < p.set.vertices; ++i)
      for (int m = 0; m < 3; ++m) sum += f(i, m) * u(i, m), magnitudes += std::abs(f(i, m) * u(i, m));
    return sum;
  };
  std::vector<decltype(on_host(field.flux[0]))> flux;
  for (int d = 0; d < 3; ++d) flux.push_back(on_host(field.flux[d]));
  const double at_faces = face_sum(transfer, [&](int d, int c) { return flux[d](c); });
  const double at_sides = comm.sum(transfer.power_on_sides(p.force, field.u, &slip));
  const double of_vertices = power(true);
  CHECK(std::abs(at_faces + at_sides - of_vertices) < 1e-13 * magnitudes);  // round-off of terms that cancel
  CHECK(std::abs(power(true) - power(false)) > 0.01 * std::abs(power(false)));
}

TEST_CASE("of a velocity only what shears along a membrane between two fluids is taken off", "[transfer][ranks]") {
  // Up to walls, that all move with it; and near other surfaces, where less of it is.
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  constexpr int cells = 12;
  const auto change = [&](bool curved, const std::function<Triple(const Triple&)>& velocity,
                          const std::function<Vec3(const Vec3&, const Vec3&, double)>& expected) {
    Grid grid(comm, curved ? warped_box({cells, cells, cells}) : sheared_box({cells, cells, cells}), {false, false, false});
    Points p = random_points(400, 0.01, curved);
    p.gap = Array<double>("corpuscle::test::gap", p.set.vertices);
    const auto gap = Kokkos::create_mirror_view(p.gap);
    for (int i = 0; i < p.set.vertices; ++i) gap(i) = 0.04 * (i % 13);  // up to 2.3 spacings
    Kokkos::deep_copy(p.gap, gap);
    Transfer transfer(grid, sides(walls), kernel, p.set.vertices);
    transfer.slip_between({ratio});
    REQUIRE(transfer.place(p.set.x) == -1);
    const Field field = make_field(grid, velocity);
    const auto with = sum_of_ranks(velocity_of(transfer, field, p, true)), without = sum_of_ranks(velocity_of(transfer, field, p, false));
    const auto normal = on_host(p.set.normal), x = on_host(p.set.x);
    double worst = 0;
    for (int i = 0; i < p.set.vertices; ++i)
      worst = std::max(worst, norm(load(with, i) - load(without, i) - expected(load(normal, i), load(x, i), gap(i))));
    return worst;
  };
  const auto nothing = [](const Vec3&, const Vec3&, double) { return Vec3{}; };
  const double round_off = comm.size() > 1 && kernel == Kernel::four_point ? 3e-5 : 1e-11;  // of areas beyond halos
  CHECK(change(
            true,
            [](const Triple&) {
              return Triple{0.3, -1, 0.7};
            },
            nothing) < round_off);
  CHECK(change(
            false,
            [](const Triple& p) {
              return Triple{p[1] - 2 * p[2], 3 * p[2] - p[0], 2 * p[0] - 3 * p[1]};
            },
            nothing) < round_off);
  // u = (y, 0, 0): grad u + grad u^T = e_x e_y + e_y e_x; spacings g of the sheared box, of 2 um.
  const double share = (kernel == Kernel::three_point ? 0.237 : 0.358) * 2 * (ratio - 1) / (ratio + 1);
  const auto shear = [&](const Vec3& n, const Vec3& x, double gap) {
    const double size = 2.0 / cells;
    const Vec3 g[3] = {size * Vec3{1, 0, 0.15}, size * Vec3{0.3, 1, 0}, size * Vec3{0, 0.2, 1}};
    const DualBasis dual(g[0], g[1], g[2]);
    double square = 0, left = 1;
    for (int d = 0; d < 3; ++d) {
      square += dot(g[d], n) * dot(g[d], n);
      left *= kink_share_beside(dot(dual.b[d], x)) * kink_share_beside(cells - dot(dual.b[d], x));
    }
    const double spacing = std::sqrt(square);
    const Vec3 twice = {n.y, n.x, 0};
    return (-share * left * slip_share(gap / spacing) * spacing) * (twice - dot(twice, n) * n);
  };
  CHECK(change(
            false,
            [](const Triple& p) {
              return Triple{p[1], 0, 0};
            },
            shear) < 1e-10);
}

TEST_CASE("what is taken off of forces leaves their sum as it is", "[transfer][ranks]") {
  // Beyond where walls take part, on a grid without two parallel faces.
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  Grid grid(comm, warped_box({12, 11, 13}), {false, false, false});
  const Points p = random_points(300, 0.25, true);
  Transfer transfer(grid, sides(walls), kernel, p.set.vertices);
  transfer.slip_between({ratio});
  REQUIRE(transfer.place(p.set.x) == -1);
  const SlipViews slip = p.slip(transfer);
  std::vector<decltype(on_host(grid.views().x))> area;
  for (int d = 0; d < 3; ++d) area.push_back(on_host(transfer.block().sharp_area[d]));
  for (int m = 0; m < 3; ++m) {
    transfer.spread(p.force, &slip);
    const double with = face_sum(transfer, [&](int d, int c) { return area[d](c, m); });
    transfer.spread(p.force);
    CHECK(with ==
          Approx(face_sum(transfer, [&](int d, int c) { return area[d](c, m); })).margin(kernel == Kernel::three_point ? 0.05 : 0.02));
  }
}

TEST_CASE("how the grid is cut over ranks does not change what kinks are", "[transfer][ranks]") {
  const Comm comm;
  if (comm.size() == 1) return;
  const NodeSource nodes = warped_box({9, 8, 10});
  Grid cut(comm, nodes, {false, false, false}), whole(Comm::alone(), nodes, {false, false, false});
  const Points p = random_points(600, 0.02, true);
  Transfer of_ranks(cut, sides(walls), Kernel::three_point, p.set.vertices),
      of_one(whole, sides(walls), Kernel::three_point, p.set.vertices);
  for (Transfer* transfer : {&of_ranks, &of_one}) {
    transfer->slip_between({ratio});
    REQUIRE(transfer->place(p.set.x) == -1);
    const SlipViews slip = p.slip(*transfer);
    transfer->spread(p.force, &slip);
  }
  CHECK(largest_difference(of_ranks, of_one) < 1e-12);
  const auto u = sum_of_ranks(velocity_of(of_ranks, make_field(cut, rough), p, true));
  const auto exact = on_host(velocity_of(of_one, make_field(whole, rough), p, true));
  double off = 0;
  for (int i = 0; i < p.set.vertices; ++i)
    for (int m = 0; m < 3; ++m) off = std::max(off, std::abs(u(i, m) - exact(i, m)));
  CHECK(off < 1e-12);
}

namespace {

constexpr double high = 16;

/// A plane across y above a wall, the fluid below it `r` times as viscous, where the upper wall moves with `wall` (or there is none to it,
/// but symmetry) and the plane is pushed along x with `pull` per area, times viscosity over spacing: how much faster the plane is than it
/// should be.
double plane_error(double y, double r, double wall, double pull, bool with, Type top = Type::moving_wall) {
  constexpr int n = 4, along = 2 * n, count = along * along;
  auto boundaries = sides({Type::periodic, Type::periodic, Type::wall, top, Type::periodic, Type::periodic});
  boundaries[3].velocity = Triple{wall, 0, 0};
  auto box_of = box({n, static_cast<int>(high), n}, {n, high, n});
  Grid grid(Comm::alone(), make_node_source(box_of), {true, false, true});
  FluidSettings settings;
  settings.convection = FluidSettings::Convection::none;
  settings.kinematic_viscosity_um2_per_us = 1;
  settings.momentum_tolerance = settings.divergence_tolerance = 1e-10;
  FluidSolver fluid(grid, settings, boundaries);
  const Array<double> relative("corpuscle::test::relative", grid.index().size()),
      fluidity("corpuscle::test::fluidity", grid.index().size());
  const auto at = on_host(grid.views().x);
  const auto mu = Kokkos::create_mirror_view(relative), inverse = Kokkos::create_mirror_view(fluidity);
  for (int c = 0; c < grid.index().size(); ++c) {
    const double inside = std::clamp(y - at(c, 1) + 0.5, 0.0, 1.0), part = at(c, 1) <= 0 ? 1 : at(c, 1) >= high ? 0 : inside;
    mu(c) = part * r + 1 - part, inverse(c) = part / r + 1 - part;
  }
  Kokkos::deep_copy(relative, mu), Kokkos::deep_copy(fluidity, inverse);
  fluid.set_viscosity(relative, std::min(1.0, r), fluidity);
  const auto shifts = period_shifts(grid);
  const auto copies = static_cast<int>(shifts.size());
  const auto x = points(count * copies, [&](int v) {
    const Vec3 s = shifts[v / count];
    return Triple{0.13 + 0.5 * (v % along) + s.x, y, 0.07 + 0.5 * (v % count / along) + s.z};
  });
  const Points p(x, points(count * copies, [&](int) { return Triple{0.25 * pull, 0, 0}; }), [](int) { return Triple{0, 1, 0}; });
  Kokkos::deep_copy(p.set.area, 0.25);
  Transfer transfer(grid, boundaries, Kernel::three_point, count * copies);
  transfer.slip_between({r});
  fluid.set_face_force(transfer.faces());
  fluid.raise_reference_speed(1);
  REQUIRE(transfer.place(x) == -1);
  const SlipViews slip = p.slip(transfer);
  transfer.spread(p.force, with ? &slip : nullptr);
  for (int s = 0; s < 8; ++s) {
    fluid.begin_step(1e4);
    fluid.solve(1e4 * (s + 1), nullptr);
  }
  Components<double> velocity("corpuscle::test::velocity", count * copies, 3);
  transfer.interpolate(fluid.flux(), fluid.velocity(), with ? &slip : nullptr, velocity);
  const auto v = on_host(velocity);
  double mean = 0;
  for (int i = 0; i < count * copies; ++i) mean += v(i, 0) / count;
  return mean - (top == Type::symmetry ? pull * y / r : (wall / (high - y) + pull) / (1 / (high - y) + r / y));
}

/// The mean of it over where in a cell the plane is.
double mean_error(double r, double wall, double pull, bool with) {
  double sum = 0;
  for (int n = 0; n < 5; ++n) sum += plane_error(8.1 + 0.2 * n, r, wall, pull, with) / 5;
  return sum;
}

}  // namespace

TEST_CASE("a plane between two fluids moves as it should, sheared or pulled", "[transfer]") {
  // Sheared at one per unit of time on the outside of an inner fluid as wide: errors are in spacings times the shear's jump there.
  const double r = GENERATE(0.5, 5.0);
  const double shear = 1 / (8 + 8 / r), jump = shear * (1 - 1 / r), mean = 0.5 * (1 + r);
  const double without = mean_error(r, 1, 0, false) / jump, with = mean_error(r, 1, 0, true) / jump;
  const double pulled = mean_error(r, 0, 1, true) * mean, pulled_before = mean_error(r, 0, 1, false) * mean;
  if (std::getenv("CORPUSCLE_SHOW"))
    WARN(fmt::format("r {}: sheared {:.3f}, {:.3f} without; pulled {:.3f}, {:.3f} without", r, with, without, pulled, pulled_before));
  CHECK(without > 0.2);
  CHECK(std::abs(with) < 0.01);
  CHECK(std::abs(pulled) < (r == 5 ? 0.1 : 0.04));  // 0.03 times its mean viscosity for r = 5, whose slip is the least
  if (r == 5) CHECK(pulled_before > 0.15);
}

TEST_CASE("beside a wall a plane between two fluids moves as well as it does amid the channel", "[transfer]") {
  // Where in a cell the plane lies makes 0.1 h of shear's jump: so by that of a plane as far up in another cell.
  const double r = GENERATE(0.2, 5.0), mean = 0.5 * (1 + r);
  const auto sheared = [&](double gap, bool with) {
    return plane_error(high - gap, r, 1, 0, with) * (gap + (high - gap) / r) / (1 - 1 / r);
  };
  const auto pulled = [&](double gap, bool with, Type top) { return plane_error(high - gap, r, 0, 1, with, top) * mean; };
  for (const double gap : {0.2, 0.5, 0.85, 1.2, 1.7}) {
    const double without = sheared(gap, false), with = sheared(gap, true), far = sheared(gap + 4, true);
    const double pulled_without = pulled(gap, false, walls[3]), pulled_with = pulled(gap, true, walls[3]),
                 pulled_far = pulled(gap + 4, true, walls[3]);
    const double free_without = pulled(gap, false, Type::symmetry), free_with = pulled(gap, true, Type::symmetry),
                 free_far = pulled(gap + 4, true, Type::symmetry);
    INFO("r " << r << ", gap " << gap << " h");
    if (std::getenv("CORPUSCLE_SHOW"))
      WARN(
          fmt::format("r {}, gap {} h: sheared {:.3f} ({:.3f} without, {:.3f} far away); pulled {:.3f} ({:.3f}, {:.3f}); beside symmetry "
                      "{:.3f} ({:.3f}, {:.3f})",
                      r, gap, with, without, far, pulled_with, pulled_without, pulled_far, free_with, free_without, free_far));
    CHECK(std::abs(with) < 0.04);  // 0.034 at most, of which as much far away
    if (gap > 0.6) CHECK(without > 0.08);
    CHECK(std::abs(pulled_with) < (gap < 0.5 ? 0.28 : 0.21));  // 0.48 without
    if (gap > 1) {
      CHECK(without > 0.2);
      CHECK(std::abs(with - far) < 0.012);
      CHECK(std::abs(pulled_with - pulled_far) < 0.06);
      CHECK(std::abs(free_with - free_far) < 0.02);
    }
    CHECK(std::abs(free_with) < 0.55 * std::abs(free_without));
  }
}
