// Loops over boxes of cells.
#include "grid/index_space.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#ifdef _OPENMP
#include <omp.h>
#endif

using namespace corpuscle;

#if !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)

#if defined(_OPENMP) && defined(KOKKOS_ENABLE_SERIAL)
TEST_CASE("small boxes are done by the calling thread, large ones by all") {
  const auto in_parallel = [](int side) {
    Array<int> found("corpuscle::test::found", side);
    for_box(
        "corpuscle::test::box", {0, 0, 0}, {side, side, side}, KOKKOS_LAMBDA(int i, int j, int k) {
          if (j == 0 && k == 0) found(i) = omp_in_parallel() ? 2 : 1;
        });
    return found(0);
  };
  CHECK(in_parallel(12) == 1);
  CHECK(in_parallel(32) == (Exec().concurrency() > 1 ? 2 : 1));
}
#endif

TEST_CASE("who adds up a sum does not change its bits") {
  IndexSpace index;
  index.n[0] = 7, index.n[1] = 5, index.n[2] = 9;
  REQUIRE(index.owned() < worth_threads);
  const auto body = KOKKOS_LAMBDA(int i, int j, int k) { return std::sin(1.3 * i + 2.7 * j - 0.9 * k) / (1 + i + k); };
  const int threads = Exec().concurrency();
  double by_all = 0;
  Kokkos::parallel_reduce(
      "corpuscle::test::sum", Policy(0, threads),
      [=](int thread, double& total) {
        total += sum_lines({7, 5, 9}, thread, threads, body);
      },
      by_all);
  CHECK(sum_owned("corpuscle::test::sum", index, body) == by_all);
}

TEST_CASE("every cell of boxes is visited once, by lines and by numbers") {
  CellBoxes boxes;
  boxes.add({{-2, 0, 1}, {5, 3, 4}});
  boxes.add({{0, 0, 0}, {0, 9, 9}});  // empty
  boxes.add({{-2, 3, 1}, {-1, 6, 4}});
  boxes.add({{-2, 0, 4}, {5, 6, 5}});
  REQUIRE(boxes.count == 3);
  CHECK(boxes.size() == 63 + 9 + 42);
  const auto at = [](int i, int j, int k) { return (i + 2) + 7 * (j + 6 * (k - 1)); };
  Array<int> by_lines("corpuscle::test::visits", 7 * 6 * 4), by_numbers("corpuscle::test::visits", 7 * 6 * 4);
  for_boxes(
      "corpuscle::test::boxes", boxes, KOKKOS_LAMBDA(int b, int i, int j, int k) { by_lines(at(i, j, k)) += b + 1; });
  for (int e = 0; e < boxes.size(); ++e) boxes.visit(e, [&](int b, int i, int j, int k) { by_numbers(at(i, j, k)) += b + 1; });
  int wrong = 0;
  for (int k = 1; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = -2; i < 5; ++i) {
        const int box = k == 4 ? 3 : j < 3 ? 1 : i < -1 ? 2 : 0;
        wrong += by_lines(at(i, j, k)) != box || by_numbers(at(i, j, k)) != box;
      }
  CHECK(wrong == 0);
}

TEST_CASE("every cell of a box is visited once, whatever its size") {
  for (const int side : {1, 3, 12, 13, 31}) {
    Array<int> visits("corpuscle::test::visits", side * (side + 1) * (side + 2));
    for_box(
        "corpuscle::test::box", {-1, 2, 0}, {side - 1, side + 3, side + 2},
        KOKKOS_LAMBDA(int i, int j, int k) { visits(i + 1 + side * (j - 2 + (side + 1) * k)) += 1; });
    int wrong = 0;
    for (std::size_t n = 0; n < visits.extent(0); ++n) wrong += visits(n) != 1;
    CHECK(wrong == 0);
  }
}

#endif
