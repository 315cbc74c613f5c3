#include <algorithm>
#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "grid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::grid_test;

namespace {

/// Number of the global cell behind a local index, -1 beyond a physical side.
int global_number(const IndexSpace& index, int i, int j, int k) {
  int g[3] = {i + index.first[0], j + index.first[1], k + index.first[2]};
  for (int d = 0; d < 3; ++d) {
    if (index.periodic[d]) g[d] = (g[d] + index.global[d]) % index.global[d];
    if (g[d] < 0 || g[d] >= index.global[d]) return -1;
  }
  return g[0] + index.global[0] * (g[1] + index.global[1] * g[2]);
}

template <class Body>
void for_padded(const IndexSpace& index, const Body& body) {
  constexpr int h = IndexSpace::halo;
  for (int k = -h; k < index.n[2] + h; ++k)
    for (int j = -h; j < index.n[1] + h; ++j)
      for (int i = -h; i < index.n[0] + h; ++i) body(i, j, k);
}

constexpr int untouched = 99;

/// Entries of `field` that differ from value(global number, component) after the exchange.
template <class Field, class Value>
int wrong_entries(const IndexSpace& index, Halo& halo, const Field& field, const Value& value) {
  auto host = Kokkos::create_mirror_view(field);
  using Entry = typename Field::non_const_value_type;
  const auto visit = [&](const auto& body) {
    for_padded(index, [&](int i, int j, int k) {
      for (int m = 0; m < (Field::rank == 1 ? 1 : static_cast<int>(field.extent(1))); ++m) {
        const int c = index.cell(i, j, k);
        if constexpr (Field::rank == 1)
          body(i, j, k, m, host(c));
        else
          body(i, j, k, m, host(c, m));
      }
    });
  };
  visit([&](int i, int j, int k, int m, Entry& entry) {
    entry = index.owns(i, j, k) ? value(global_number(index, i, j, k), m) : static_cast<Entry>(untouched);
  });
  Kokkos::deep_copy(field, host);
  halo.exchange(field);
  Kokkos::deep_copy(host, field);
  int wrong = 0;
  visit([&](int i, int j, int k, int m, Entry& entry) {
    const int number = global_number(index, i, j, k);
    wrong += entry != (number < 0 ? static_cast<Entry>(untouched) : value(number, m));
  });
  return wrong;
}

}  // namespace

TEST_CASE("halos hold the neighbour's cells, corners and periodic images included", "[grid][ranks]") {
  const std::array<bool, 3> periodic = GENERATE(std::array{false, false, false}, std::array{false, false, true},
                                                std::array{true, false, true}, std::array{true, true, true});
  const std::array<int, 3> cells = GENERATE(std::array{7, 6, 9}, std::array{3, 3, 13}, std::array{13, 3, 3});
  const Comm comm;
  std::array<int, 3> ranks;
  const IndexSpace index = decompose(comm, cells, periodic, &ranks);
  Halo halo(comm, index, ranks);
  const int n = index.size();
  CHECK(wrong_entries(index, halo, Array<double>("corpuscle::test::d", n), [](int g, int) { return 0.5 * g; }) == 0);
  CHECK(wrong_entries(index, halo, Components<double>("corpuscle::test::v", n, 3), [](int g, int m) { return g + 1000.0 * m; }) == 0);
  CHECK(wrong_entries(index, halo, Array<int>("corpuscle::test::i", n), [](int g, int) { return g; }) == 0);
  CHECK(wrong_entries(index, halo, Array<NodeKind>("corpuscle::test::k", n), [](int g, int) { return static_cast<NodeKind>(g % 5); }) == 0);
}

TEST_CASE("blocks tile the grid once", "[grid][ranks]") {
  const Comm comm;
  const std::array<int, 3> cells{11, 7, 17};
  std::array<int, 3> ranks;
  const IndexSpace index = decompose(comm, cells, {false, false, false}, &ranks);
  CHECK(ranks[0] * ranks[1] * ranks[2] == comm.size());
  std::vector<double> owners(11 * 7 * 17, 0.0);
  for (int k = 0; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) owners[global_number(index, i, j, k)] += 1;
  comm.sum(owners.data(), static_cast<int>(owners.size()));
  CHECK(std::count(owners.begin(), owners.end(), 1.0) == 11 * 7 * 17);
  for (int d = 0; d < 3; ++d) CHECK((ranks[d] == 1 || index.n[d] >= IndexSpace::halo));
}

TEST_CASE("a grid too small for the ranks is refused", "[grid][ranks]") {
  const Comm comm;
  const std::array<bool, 3> open{false, false, false};
  if (comm.size() == 1) {
    CHECK_NOTHROW(decompose(comm, {5, 5, 5}, open));
  } else {
    CHECK_THROWS_AS(decompose(comm, {5, 5, 5}, open), InputError);
    CHECK_THROWS_WITH(decompose(comm, {5, 5, 5}, open), Catch::Contains("fewer ranks"));
  }
}

TEST_CASE("every rank hears which cell is folded", "[grid][ranks]") {
  const Comm comm;
  const auto box = sheared_box(8, 0);
  const NodeSource folded{box.cells, [&](int i, int j, int k) {
                            Triple x = box.node(i, j, k);
                            if (i == 7 && j == 6 && k == 7) x[0] -= 0.7;
                            return x;
                          }};
  CHECK_THROWS_WITH(Grid(comm, folded, {false, false, false}), Catch::Contains("cell (6, "));
}

TEST_CASE("the decomposition does not change the geometry", "[grid][ranks]") {
  const Comm comm;
  const NodeSource source = crumpled_box({9, 8, 10});
  const Grid grid(comm, source, {false, false, false});
#ifdef CORPUSCLE_MPI
  const Grid whole(Comm(MPI_COMM_SELF), source, {false, false, false});
#else
  const Grid whole(comm, source, {false, false, false});
#endif
  CHECK(grid.total_volume() == Approx(whole.total_volume()).epsilon(1e-14));  // sums in another order
  CHECK(grid.skewness() == Approx(whole.skewness()).epsilon(1e-13));
  const auto mine = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid.views().x);
  const auto all = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), whole.views().x);
  const IndexSpace& index = grid.index();
  int different = 0;
  for_padded(index, [&](int i, int j, int k) {
    const int c = index.cell(i, j, k);
    const int w = whole.index().cell(i + index.first[0], j + index.first[1], k + index.first[2]);
    const int g[3] = {i + index.first[0], j + index.first[1], k + index.first[2]};
    for (int d = 0; d < 3; ++d)
      if (g[d] < -1 || g[d] > index.global[d]) return;  // void layers
    for (int m = 0; m < 3; ++m) different += mine(c, m) != all(w, m);
  });
  CHECK(different == 0);
}
