// Loops and sums over a block's cells visit each once, at its own place.
#include <catch2/catch.hpp>

#include "fluid/integrals.hpp"

using namespace corpuscle;

namespace {

IndexSpace block(const std::array<int, 3>& n) {
  IndexSpace index;
  for (int d = 0; d < 3; ++d) index.n[d] = index.global[d] = n[d];
  return index;
}

/// A number that tells where a cell is; sums of these over a few thousand cells are exact.
KOKKOS_INLINE_FUNCTION double mark(int i, int j, int k) { return i * i + 1000.0 * j * j * j + 1e7 * k * i + j; }

double sum_of_marks(const IndexSpace& index) {
  double sum = 0;
  for (int k = 0; k < index.n[2]; ++k)
    for (int j = 0; j < index.n[1]; ++j)
      for (int i = 0; i < index.n[0]; ++i) sum += mark(i, j, k);
  return sum;
}

}  // namespace

TEST_CASE("compact numbers and cells belong to each other", "[grid]") {
  // The arithmetic of every loop over plain numbers, on devices too; three different sizes, so that none can stand for another.
  const IndexSpace index = block({7, 5, 3});
  int next = 0;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 7; ++i, ++next) {
        REQUIRE(index.compact(i, j, k) == next);
        int extra = 17;
        const bool same = index.visit_compact(
            next,
            [&](int a, int b, int c, int& more) {
              more += 1;
              return a == i && b == j && c == k;
            },
            extra);
        REQUIRE(same);
        REQUIRE(extra == 18);
      }
}

TEST_CASE("sums over owned cells count each cell once", "[grid]") {
  // Small and large enough to be shared out over threads.
  const std::array<int, 3> n = GENERATE(std::array{7, 5, 3}, std::array{3, 5, 7}, std::array{1, 1, 4}, std::array{19, 17, 13});
  const IndexSpace index = block(n);
  const double expected = sum_of_marks(index);
  const double sum = sum_owned(
      "corpuscle::test::sum", index, KOKKOS_LAMBDA(int i, int j, int k) { return mark(i, j, k); });
  CHECK(sum == expected);
  double reduced = 0;
  reduce_owned(
      "corpuscle::test::reduce", index, KOKKOS_LAMBDA(int i, int j, int k, double& total) { total += mark(i, j, k); },
      Kokkos::Sum<double>(reduced));
  CHECK(reduced == expected);
}

TEST_CASE("a loop over a box runs each of its cells once", "[grid]") {
  const IndexSpace index = block({9, 6, 4});
  const std::array<int, 3> lower = GENERATE(std::array{0, 0, 0}, std::array{-2, 1, -1}, std::array{3, -3, 2}), upper{8, 5, 4};
  const Array<int> visits("corpuscle::test::visits", index.size());
  for_box(
      "corpuscle::test::box", lower, upper, KOKKOS_LAMBDA(int i, int j, int k) { visits(index.cell(i, j, k)) += 1; });
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), visits);
  for (int c = 0; c < index.size(); ++c) {
    int at[3];
    index.unpack(c, at[0], at[1], at[2]);
    bool inside = true;
    for (int d = 0; d < 3; ++d) inside = inside && at[d] >= lower[d] && at[d] < upper[d];
    REQUIRE(host(c) == (inside ? 1 : 0));
  }
}
