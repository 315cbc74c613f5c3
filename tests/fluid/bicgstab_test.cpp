#include "fluid/bicgstab.hpp"

#include <catch2/catch.hpp>

using namespace corpuscle;

namespace {

/// y = A x for one-dimensional diffusion and transport: 2 + shift on the diagonal, -1 - skew and -1 + skew beside it.
void apply_transport(double shift, double skew, const Array<double>& x, const Array<double>& y) {
  const int n = static_cast<int>(x.extent(0));
  Kokkos::parallel_for(
      "corpuscle::test::transport", Policy(0, n), KOKKOS_LAMBDA(int i) {
        const double low = i > 0 ? x(i - 1) : 0.0, high = i + 1 < n ? x(i + 1) : 0.0;
        y(i) = (2 + shift) * x(i) - (1 + skew) * low - (1 - skew) * high;
      });
}

void set_wave(const Array<double>& x) {
  Kokkos::parallel_for(
      "corpuscle::test::wave", Policy(0, static_cast<int>(x.extent(0))),
      KOKKOS_LAMBDA(int i) { x(i) = std::sin(0.3 * i) + 0.1 * i; });
}

double distance(const Array<double>& a, const Array<double>& b) {
  const Array<double> difference("corpuscle::test::difference", a.extent(0));
  KokkosBlas::update(1.0, a, -1.0, b, 0.0, difference);
  return std::sqrt(KokkosBlas::dot(difference, difference));
}

Comm alone() {
#ifdef CORPUSCLE_MPI
  return Comm(MPI_COMM_SELF);
#else
  return Comm();
#endif
}

}  // namespace

TEST_CASE("BiCGStab solves a known system that is not symmetric", "[fluid]") {
  constexpr int n = 300;
  const double skew = GENERATE(0.0, 0.4);
  BiCGStab solver(alone(), n, "corpuscle::test");
  const Array<double> exact("corpuscle::test::exact", n), rhs("corpuscle::test::rhs", n), x("corpuscle::test::x", n);
  set_wave(exact);
  apply_transport(0.05, skew, exact, rhs);
  const double tolerance = 1e-9;
  const auto result =
      solver.solve([&](const Array<double>& in, const Array<double>& out) { apply_transport(0.05, skew, in, out); },
                   rhs, x, tolerance, 500);
  REQUIRE(result.converged);
  CHECK(result.iterations > 5);
  CHECK(result.residual <= tolerance);
  CHECK(distance(x, exact) < tolerance / 0.05);  // the smallest singular value is at least the shift
  Array<double> again("corpuscle::test::again", n), b("corpuscle::test::b", n);
  apply_transport(0.05, skew, x, again);
  apply_transport(0.05, skew, exact, b);
  CHECK(distance(b, again) < 2 * tolerance);  // the recursive residual has not drifted from the true one
}

TEST_CASE("BiCGStab stops at the limit and says so", "[fluid]") {
  constexpr int n = 300;
  BiCGStab solver(alone(), n, "corpuscle::test");
  const Array<double> exact("corpuscle::test::exact", n), rhs("corpuscle::test::rhs", n), x("corpuscle::test::x", n);
  const auto apply = [](const Array<double>& in, const Array<double>& out) { apply_transport(0.001, 0, in, out); };
  set_wave(exact);
  apply(exact, rhs);
  const auto result = solver.solve(apply, rhs, x, 1e-12, 3);
  CHECK_FALSE(result.converged);
  CHECK(result.iterations == 3);
  Kokkos::deep_copy(rhs, 0.0);
  const auto nothing = solver.solve(apply, rhs, x, 0.0, 3);
  CHECK(nothing.converged);
  CHECK(nothing.iterations == 0);
}

TEST_CASE("BiCGStab reports a breakdown instead of an answer", "[fluid]") {
  // A rotation by a right angle: the first search direction is orthogonal to its image.
  BiCGStab solver(alone(), 2, "corpuscle::test");
  const Array<double> rhs("corpuscle::test::rhs", 2), x("corpuscle::test::x", 2);
  Kokkos::deep_copy(rhs, 1.0);
  const auto result = solver.solve(
      [](const Array<double>& in, const Array<double>& out) {
        Kokkos::parallel_for(
            "corpuscle::test::rotate", Policy(0, 2), KOKKOS_LAMBDA(int i) { out(i) = i == 0 ? -in(1) : in(0); });
      },
      rhs, x, 1e-10, 50);
  CHECK_FALSE(result.converged);
}
