// A number that is none must come out of every extreme, wherever it stands, on any number of threads and ranks.
#include <catch2/catch.hpp>

#include "fluid/flux.hpp"
#include "fluid/reference_flow.hpp"
#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

const double no_number = std::numeric_limits<double>::quiet_NaN();

template <class View, class... At>
void put(const View& view, double value, At... at) {
  Kokkos::deep_copy(Kokkos::subview(view, at...), value);
}

}  // namespace

TEST_CASE("the larger and the smaller of two numbers are not numbers if either is not", "[fluid]") {
  CHECK(larger(1, 2) == 2);
  CHECK(larger(2, 1) == 2);
  CHECK(smaller(1, 2) == 1);
  CHECK(smaller(2, 1) == 1);
  CHECK(std::isnan(larger(no_number, 1)));
  CHECK(std::isnan(larger(1, no_number)));
  CHECK(std::isnan(smaller(no_number, 1)));
  CHECK(std::isnan(smaller(1, no_number)));
}

TEST_CASE("the largest value of a field is not a number if one is not: first, in the middle, last", "[fluid][ranks]") {
  const IndexSpace index{{7, 6, 5}, {0, 0, 0}, {7, 6, 5}};
  const Array<double> vector("corpuscle::test::vector", index.owned()), x("corpuscle::test::x", index.size());
  const Array<NodeKind> kind("corpuscle::test::kind", index.size());  // zero: fluid
  const Components<double> u("corpuscle::test::u", index.size(), 3);
  Kokkos::deep_copy(vector, -2.5);
  Kokkos::deep_copy(u, 1.0);
  CHECK(largest_magnitude(vector) == 2.5);
  CHECK(largest_speed(index, kind, u) == std::sqrt(3.0));
  GridViews grid;
  grid.index = index;
  grid.x = Components<double>("corpuscle::test::x", index.size(), 3);
  CHECK(couette_difference(grid, u, 2, -1, 1, {}, {}) == std::sqrt(3.0));
  CHECK(poiseuille_difference(grid, u, 1, 0, 1) == std::sqrt(3.0));
  for (const auto& at : {std::array{0, 0, 0}, std::array{3, 2, 1}, std::array{6, 5, 4}}) {
    const int c = index.cell(at[0], at[1], at[2]), e = index.compact(at[0], at[1], at[2]);
    INFO("entry " << e);
    put(vector, no_number, e);
    CHECK(std::isnan(largest_magnitude(vector)));
    put(vector, 0, e);
    put(u, no_number, c, 2);
    CHECK(std::isnan(largest_speed(index, kind, u)));
    CHECK(std::isnan(couette_difference(grid, u, 2, -1, 1, {}, {})));
    CHECK(std::isnan(poiseuille_difference(grid, u, at[2], 0, 1)));
    put(u, 0, c, 2);
  }
}

TEST_CASE("a rank without fluid nodes has a largest speed of zero", "[fluid]") {
  const IndexSpace index{{3, 2, 2}, {0, 0, 0}, {3, 2, 2}};
  const Array<NodeKind> kind("corpuscle::test::kind", index.size());
  Kokkos::deep_copy(kind, NodeKind::inside);
  CHECK(largest_speed(index, kind, Components<double>("corpuscle::test::u", index.size(), 3)) == 0);
}

TEST_CASE("extremes over ranks are not numbers on all ranks where one rank's is not", "[fluid][ranks]") {
  const Comm comm;
  CHECK(comm.max(comm.rank()) == comm.size() - 1);
  CHECK(comm.min(comm.rank()) == 0);
  for (int bad = 0; bad < comm.size(); ++bad) {
    INFO("rank " << bad << " of " << comm.size());
    const double mine = comm.rank() == bad ? no_number : comm.rank();
    CHECK(std::isnan(comm.max(mine)));
    CHECK(std::isnan(comm.min(mine)));
    double values[3] = {1.0 * comm.rank(), mine, -1.0 * comm.rank()};
    comm.max(values, 3);
    CHECK(values[0] == comm.size() - 1);
    CHECK(std::isnan(values[1]));
    CHECK(values[2] == 0);
  }
}
