#include <catch2/catch.hpp>

#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

TEST_CASE("the viscous force on a cell is what its six faces carry", "[fluid]") {
  // The operator collects the faces node by node; energies and momentum balances go over the faces themselves.
  const Comm comm;
  const Grid grid(comm, warped_box({6, 5, 7}), {false, false, false});
  const IndexSpace index = grid.index();
  ViscousCoefficients g;
  for (int d = 0; d < 3; ++d) {
    g.normal[d] = Array<double>("corpuscle::test::normal", index.size());
    for (int e = 0; e < 3; ++e) g.cross[d][e] = Array<double>("corpuscle::test::cross", index.size());
  }
  viscous_coefficients<true>(grid.views(), g);
  const Components<double> u("corpuscle::test::u", index.size(), 3);
  Kokkos::parallel_for(
      "corpuscle::test::u", Policy(0, index.size()), KOKKOS_LAMBDA(int c) {
        store(u, c, Vec3{std::sin(1.7 * c), std::cos(0.9 * c), std::sin(0.31 * c + 1)});
      });
  double worst = 0, size = 0;
  reduce_owned(
      "corpuscle::test::difference", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int c = index.cell(i, j, k);
        const Vec3 force = viscous_force<true>(g, u, index, c);
        for (int m = 0; m < 3; ++m) {
          double sum = 0;
          for (int d = 0; d < 3; ++d)
            sum += viscous_face<true>(g, u, index, d, c + index.stride(d), m) - viscous_face<true>(g, u, index, d, c, m);
          const double difference = std::fabs(force[m] - sum);
          most = difference <= most ? most : difference;
        }
      },
      Kokkos::Max<double>(worst));
  reduce_owned(
      "corpuscle::test::size", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const double here = norm(viscous_force<true>(g, u, index, index.cell(i, j, k)));
        most = here > most ? here : most;
      },
      Kokkos::Max<double>(size));
  CHECK(size > 1);
  CHECK(worst < 1e-13 * size);  // round-off
}
