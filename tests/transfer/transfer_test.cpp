#include "transfer/transfer.hpp"

#include <catch2/catch.hpp>

#include "cells/rank_blocks.hpp"
#include "fields.hpp"
#include "transfer/delta.hpp"

using namespace corpuscle;
using namespace corpuscle::transfer_test;

TEMPLATE_TEST_CASE("kernels add up to one and keep the position", "[transfer]", ThreePointDelta, FourPointDelta) {
  for (int step = 0; step <= 40; ++step) {
    const double t = 3 + step / 40.0;
    double sum = 0, moment = 0, beyond = 0;
    for (int i = -2; i < 12; ++i) {
      const int p = i - TestType::first(t);
      const double w = TestType::value(i - t);
      if (p < 0 || p >= TestType::points) {
        beyond = std::max(beyond, std::abs(i - t) < TestType::reach ? w : 0.0);
        continue;
      }
      sum += w;
      moment += w * (i - t);
    }
    CHECK(sum == Approx(1).epsilon(1e-14));
    CHECK(std::abs(moment) < 1e-14);
    CHECK(beyond < 1e-14);
  }
}

TEST_CASE("what forces do to fluxes is what interpolated velocities say", "[transfer][ranks]") {
  // On a grid without two parallel faces, up to its walls. Round-off of sums of a few thousand terms of order one.
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  Grid grid(comm, warped_box({9, 8, 10}), {false, false, false});
  const int count = 200;
  const auto x = inside(count, 0.02, true);
  Transfer transfer(grid, sides(walls), kernel, count);
  REQUIRE(transfer.place(x) == -1);
  CHECK(comm.sum(static_cast<double>(transfer.at_home())) == count);
  Noise noise;
  const auto force = points(count, [&](int) { return Triple{noise(-1, 1), noise(-1, 1), noise(-1, 1)}; });
  transfer.spread(force);
  Field field = make_field(grid, rough);
  Kokkos::deep_copy(field.u, 0.0);  // walls at rest: theirs is no part of the transpose
  Components<double> v("corpuscle::test::v", count, 3);
  transfer.interpolate(field.flux, field.u, nullptr, v);
  const auto f = on_host(force);
  const auto u = sum_of_ranks(v);
  double at_vertices = 0;
  for (int i = 0; i < count; ++i)
    for (int m = 0; m < 3; ++m) at_vertices += f(i, m) * u(i, m);
  std::vector<decltype(on_host(field.flux[0]))> flux;
  for (int d = 0; d < 3; ++d) flux.push_back(on_host(field.flux[d]));
  const double at_faces = face_sum(transfer, [&](int d, int c) { return flux[d](c); });
  CHECK(std::abs(at_vertices) > 0.1);
  CHECK(at_faces == Approx(at_vertices).epsilon(1e-12));
}

TEST_CASE("uniform velocities are exact on any grid and linear ones on straight grids, up to the walls", "[transfer][ranks]") {
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  const int count = 300;
  Components<double> v("corpuscle::test::v", count, 3);
  const auto error = [&](Grid& grid, bool curved, const std::function<Triple(const Triple&)>& velocity) {
    const auto x = inside(count, 0.02, curved);
    Transfer transfer(grid, sides(walls), kernel, count);
    REQUIRE(transfer.place(x) == -1);
    const Field field = make_field(grid, velocity);
    transfer.interpolate(field.flux, field.u, nullptr, v);
    return largest_error(v, x, velocity);
  };
  Grid warped(comm, warped_box({9, 8, 10}), {false, false, false}), straight(comm, sheared_box({9, 8, 10}), {false, false, false});
  const auto uniform = [](const Triple&) { return Triple{0.3, -1, 0.7}; };
  const auto linear = [](const Triple& p) { return Triple{0.3 + p[1] - 2 * p[2], p[0] - p[1], 0.2 + p[1] + p[2] - 3 * p[0]}; };
  // The four-point kernel reaches one row further than halos do: there the faces' areas are extrapolated,
  // to 4e-6 of the velocity here.
  const bool extrapolated = kernel == Kernel::four_point && comm.size() > 1;
  CHECK(error(warped, true, uniform) < (extrapolated ? 2e-5 : 1e-12));
  CHECK(error(straight, false, uniform) < 1e-12);
  CHECK(error(straight, false, linear) < 1e-11);
  CHECK(error(warped, true, linear) < 0.1);  // second order: 1 % of the largest velocity
}

TEST_CASE("forces arrive whole", "[transfer][ranks]") {
  // Away from walls, on the faces; and in the cells of a straight grid, with what they make of the faces' forces.
  const Comm comm;
  const bool straight = GENERATE(true, false);
  Grid grid(comm, straight ? sheared_box({12, 12, 12}) : warped_box({12, 12, 12}), {false, false, false});
  const int count = 100;
  const auto x = inside(count, 0.3, !straight);
  Noise noise;
  const auto force = points(count, [&](int) { return Triple{noise(0, 1), noise(0, 1), noise(-1, 0)}; });
  Transfer transfer(grid, sides(walls), Kernel::three_point, count);
  transfer.place(x);
  transfer.spread(force);
  const auto f = on_host(force);
  const IndexSpace& index = grid.index();
  const PressureMask mask("corpuscle::test::mask", index.size());
  const Array<double> p("corpuscle::test::p", index.size());
  Components<double> gradient("corpuscle::test::gradient", index.size(), 3);
  mark_pressure(grid.views().base_kind, PressureMask("corpuscle::test::outflow", index.size()), mask);
  pressure_gradient(grid.views(), grid.views().base_kind, mask, p, gradient, transfer.faces());
  const auto density = on_host(gradient);
  const auto volume = on_host(grid.views().volume);
  for (int m = 0; m < 3; ++m) {
    double total = 0;
    for (int i = 0; i < count; ++i) total += f(i, m);
    std::vector<decltype(on_host(gradient))> area;
    for (int d = 0; d < 3; ++d) area.push_back(on_host(grid.views().face_area[d]));
    CHECK(face_sum(transfer, [&](int d, int c) { return area[d](c, m); }) == Approx(total).epsilon(1e-12));
    double in_cells = 0;
    visit_owned(index, [&](int, int, int, int c) { in_cells -= volume(c) * density(c, m); });
    in_cells = comm.sum(in_cells);
    if (!straight) UNSCOPED_INFO("on the curved grid cells receive " << in_cells / total);
    CHECK(in_cells == Approx(total).epsilon(straight ? 1e-12 : 0.02));
  }
}

TEST_CASE("a marker astride a periodic side is one of many places", "[transfer][ranks]") {
  // Moved by a cell at a time around a periodic box, forces and velocities move with it.
  const Comm comm;
  Grid grid(comm, sheared_box({8, 6, 7}), {true, true, true});
  const IndexSpace& index = grid.index();
  const auto all = sides({Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic, Type::periodic});
  // The point and its copies beyond the periodic sides.
  const auto shifts = period_shifts(grid);
  const int copies = static_cast<int>(shifts.size());
  REQUIRE(copies == 27);
  const auto force = points(copies, [](int) { return Triple{1, -2, 0.5}; });
  const int d = GENERATE(0, 1, 2);
  std::vector<double> first;
  Transfer transfer(grid, all, Kernel::three_point, copies);
  const int planes = index.global[d];
  for (int step = -2; step < planes + 2; ++step) {
    double s[3] = {0.61, 0.83, 0.37};
    s[d] = 2 * (step + 0.13) / planes;
    REQUIRE(transfer.place(points(copies, [&](int copy) {
      const Vec3& by = shifts[copy];
      return Triple{s[0] + 0.3 * s[1] + by.x, s[1] + 0.2 * s[2] + by.y, s[2] + 0.15 * s[0] + by.z};
    })) == -1);
    CHECK(comm.sum(static_cast<double>(transfer.at_home())) == 1);
    transfer.spread(force);
    const auto across = on_host(transfer.faces().across[d]);
    std::vector<double> line;
    for (int c = 0; c < planes; ++c) {
      double sum = 0;
      visit_owned(index, [&](int i, int j, int k, int cell) {
        const int at[3] = {index.first[0] + i, index.first[1] + j, index.first[2] + k};
        if (at[d] == (c + step + planes) % planes) sum += across(cell) * (1 + at[(d + 1) % 3] + 10 * at[(d + 2) % 3]);
      });
      line.push_back(comm.sum(sum));
    }
    if (first.empty()) first = line;
    for (int c = 0; c < planes; ++c) CHECK(line[c] == Approx(first[c]).margin(1e-10));
    const auto uniform = make_field(grid, [](const Triple&) { return Triple{1, 2, 3}; });
    Components<double> v("corpuscle::test::v", copies, 3);
    transfer.interpolate(uniform.flux, uniform.u, nullptr, v);
    const auto u = sum_of_ranks(v);
    for (int m = 0; m < 3; ++m) {
      double sum = 0;
      for (int copy = 0; copy < copies; ++copy) sum += u(copy, m);
      CHECK(sum == Approx(1 + m).epsilon(1e-12));
    }
  }
}

TEST_CASE("spreading is the same bits again, and markers are sorted", "[transfer]") {
  const Comm comm;
  Grid grid(comm, warped_box({9, 8, 10}), {false, false, false});
  const int count = 3000;  // several to a cell
  const auto x = inside(count, 0.02, true);
  Noise noise;
  const auto force = points(count, [&](int) { return Triple{noise(-1, 1), noise(-1, 1), noise(-1, 1)}; });
  Transfer transfer(grid, sides(walls), Kernel::three_point, count);
  std::vector<double> before;
  for (int run = 0; run < 3; ++run) {
    transfer.place(x);
    transfer.spread(force);
    std::vector<double> now;
    for (int d = 0; d < 3; ++d) {
      const auto across = on_host(transfer.faces().across[d]);
      now.insert(now.end(), across.data(), across.data() + across.extent(0));
    }
    if (run > 0) CHECK(now == before);
    before = now;
  }
}

TEST_CASE("how the grid is cut over ranks changes neither forces nor velocities", "[transfer][ranks]") {
  // Vertices everywhere, those beside a plane between ranks with parts on both. Round-off of sums of some hundred terms. What
  // the four-point kernel sees beyond the halo is exact where faces are alike.
  const auto kernel = GENERATE(Kernel::three_point, Kernel::four_point);
  const Comm comm;
  if (comm.size() == 1) return;
  const int count = 600;
  const bool curved = kernel == Kernel::three_point;
  const auto x = inside(count, 0.02, curved);
  Noise noise;
  const auto force = points(count, [&](int) { return Triple{noise(-1, 1), noise(-1, 1), noise(-1, 1)}; });
  const NodeSource nodes = curved ? warped_box({9, 8, 10}) : sheared_box({9, 8, 10});
  Grid cut(comm, nodes, {false, false, false}), whole(Comm::alone(), nodes, {false, false, false});
  Transfer of_ranks(cut, sides(walls), kernel, count), of_one(whole, sides(walls), kernel, count);
  for (Transfer* transfer : {&of_ranks, &of_one}) {
    REQUIRE(transfer->place(x) == -1);
    transfer->spread(force);
  }
  CHECK(of_one.markers() == count);
  CHECK(comm.sum(static_cast<double>(of_ranks.markers())) > 1.2 * count);  // many are on more than one rank
  CHECK(largest_difference(of_ranks, of_one) < 1e-12);
  const auto velocity = [&](Grid& grid, Transfer& transfer) {
    const Field field = make_field(grid, rough);
    Components<double> v("corpuscle::test::v", count, 3);
    transfer.interpolate(field.flux, field.u, nullptr, v);
    return v;
  };
  const auto u = sum_of_ranks(velocity(cut, of_ranks));
  const auto exact = on_host(velocity(whole, of_one));
  double off = 0;
  for (int i = 0; i < count; ++i)
    for (int m = 0; m < 3; ++m) off = std::max(off, std::abs(u(i, m) - exact(i, m)));
  CHECK(off < 1e-12);
}

TEST_CASE("a vertex beyond a wall is named", "[transfer][ranks]") {
  const Comm comm;
  Grid grid(comm, sheared_box({8, 8, 8}), {false, false, false});
  Transfer transfer(grid, sides(walls), Kernel::three_point, 3);
  const auto x = points(3, [](int i) { return i == 1 ? Triple{1.2, -0.08, 1} : Triple{1.2, 1, 1}; });
  CHECK(comm.max(transfer.place(x)) == 1);  // on the rank whose wall it is, since it is less than a cell beyond
}
