// A vertex whose position or force is not a number must not pass for a small one.
#include <catch2/catch.hpp>

#include "membrane/diagnostics.hpp"
#include "membrane/relaxation.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

TEST_CASE("a vertex that is not a number shows in a cell's extents and stretch, and a force in the largest", "[membrane]") {
  Membranes membranes({cell_settings(200)});
  const auto& m = membranes.views();
  const Table<double> table("corpuscle::test::table", 1, CellColumn::count);
  const auto value = [&](int column) { return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), table)(0, column); };
  RelaxationViews work;
  work.force = Components<double>("corpuscle::test::force", m.vertices, 3);
  Kokkos::deep_copy(work.force, 2.0);
  CHECK(largest_force(m, work) == Approx(std::sqrt(12.0)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const int vertex : {0, 100, 199}) {
    INFO("vertex " << vertex);
    const auto position = Kokkos::subview(m.surface.x, vertex, 1), force = Kokkos::subview(work.force, vertex, 1);
    double before = 0;
    Kokkos::deep_copy(before, position);
    Kokkos::deep_copy(position, nan);
    membranes.elasticity().measure_cells(m, table);
    CHECK(std::isfinite(value(CellColumn::lower)));
    CHECK(std::isnan(value(CellColumn::lower + 1)));
    CHECK(std::isnan(value(CellColumn::upper + 1)));
    CHECK(std::isnan(value(CellColumn::stretch)));
    Kokkos::deep_copy(position, before);
    Kokkos::deep_copy(force, nan);
    CHECK(std::isnan(largest_force(m, work)));
    Kokkos::deep_copy(force, 2.0);
  }
  membranes.elasticity().measure_cells(m, table);
  CHECK(value(CellColumn::upper) > value(CellColumn::lower));
  CHECK(value(CellColumn::stretch) < 1);
}
