#include "fluid/bicgstab.hpp"

#include "common/types.hpp"

#include <KokkosBlas1_axpby.hpp>
#include <KokkosBlas1_dot.hpp>
#include <KokkosBlas1_update.hpp>
#include <array>
#include <functional>

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
      "corpuscle::test::wave", Policy(0, static_cast<int>(x.extent(0))), KOKKOS_LAMBDA(int i) { x(i) = std::sin(0.3 * i) + 0.1 * i; });
}

double distance(const Array<double>& a, const Array<double>& b) {
  const Array<double> difference("corpuscle::test::difference", a.extent(0));
  KokkosBlas::update(1.0, a, -1.0, b, 0.0, difference);
  return std::sqrt(KokkosBlas::dot(difference, difference));
}

/// A x = r with r in place of the right-hand side, preconditioned by its diagonal.
struct System {
  using Apply = std::function<void(const Array<double>&, const Array<double>&)>;
  Apply matrix;
  double diagonal;
  Array<double> r, x, direction, shadow, p, v, t;

  System(int n, double diagonal_, Apply matrix_) : matrix(std::move(matrix_)), diagonal(diagonal_) {
    for (auto* vector : {&r, &x, &direction, &shadow, &p, &v, &t}) *vector = Array<double>("corpuscle::test::vector", n);
  }
  void start() {
    Kokkos::deep_copy(shadow, r);
    Kokkos::deep_copy(p, r);
  }
  double square() const { return KokkosBlas::dot(r, r); }
  void apply(const Array<double>& from, const Array<double>& image) {
    KokkosBlas::update(1 / diagonal, from, 0.0, from, 0.0, direction);
    matrix(direction, image);
  }
  double apply_p() {
    apply(p, v);
    return KokkosBlas::dot(shadow, v);
  }
  std::array<double, 2> apply_r() {
    apply(r, t);
    return {KokkosBlas::dot(t, r), KokkosBlas::dot(t, t)};
  }
  double advance(double factor, const Array<double>& image) {
    KokkosBlas::axpy(factor, direction, x);
    KokkosBlas::axpy(-factor, image, r);
    return KokkosBlas::dot(r, r);
  }
  double advance_v(double alpha) { return advance(alpha, v); }
  std::array<double, 2> advance_t(double omega) {
    const double square = advance(omega, t);
    return {square, KokkosBlas::dot(shadow, r)};
  }
  void next_p(double beta, double w) { KokkosBlas::update(1.0, r, -beta * w, v, beta, p); }
};

System transport(int n, double shift, double skew) {
  return {n, 2 + shift, [=](const Array<double>& in, const Array<double>& out) { apply_transport(shift, skew, in, out); }};
}

}  // namespace

TEST_CASE("BiCGStab solves a known system that is not symmetric", "[fluid]") {
  constexpr int n = 300;
  const double skew = GENERATE(0.0, 0.4);
  System system = transport(n, 0.05, skew);
  const Array<double> exact("corpuscle::test::exact", n);
  set_wave(exact);
  system.matrix(exact, system.r);
  const double tolerance = 1e-9;
  const auto result = bicgstab(system, system.square(), tolerance, 500);
  REQUIRE(result.converged);
  CHECK(result.iterations > 5);
  CHECK(result.residual <= tolerance);
  CHECK(distance(system.x, exact) < tolerance / 0.05);  // the smallest singular value is at least the shift
  Array<double> again("corpuscle::test::again", n), b("corpuscle::test::b", n);
  system.matrix(system.x, again);
  system.matrix(exact, b);
  CHECK(distance(b, again) < 2 * tolerance);  // the recursive residual has not drifted from the true one
}

TEST_CASE("BiCGStab with the exact inverse needs half an iteration", "[fluid]") {
  System system(50, 4, [](const Array<double>& in, const Array<double>& out) { KokkosBlas::update(4.0, in, 0.0, in, 0.0, out); });
  set_wave(system.r);
  int applications = 0;
  const auto matrix = system.matrix;
  system.matrix = [&](const Array<double>& in, const Array<double>& out) {
    ++applications;
    matrix(in, out);
  };
  const auto result = bicgstab(system, system.square(), 1e-12, 10);
  CHECK(result.converged);
  CHECK(result.iterations == 1);
  CHECK(applications == 1);
}

TEST_CASE("BiCGStab stops at the limit and says so", "[fluid]") {
  constexpr int n = 300;
  System system = transport(n, 0.001, 0);
  const Array<double> exact("corpuscle::test::exact", n);
  set_wave(exact);
  system.matrix(exact, system.r);
  const auto result = bicgstab(system, system.square(), 1e-12, 3);
  CHECK_FALSE(result.converged);
  CHECK(result.iterations == 3);
  Kokkos::deep_copy(system.r, 0.0);
  const auto nothing = bicgstab(system, system.square(), 0.0, 3);
  CHECK(nothing.converged);
  CHECK(nothing.iterations == 0);
}

TEST_CASE("BiCGStab reports a breakdown instead of an answer", "[fluid]") {
  // A rotation by a right angle: the first search direction is orthogonal to its image.
  System system(2, 1, [](const Array<double>& in, const Array<double>& out) {
    Kokkos::parallel_for(
        "corpuscle::test::rotate", Policy(0, 2), KOKKOS_LAMBDA(int i) { out(i) = i == 0 ? -in(1) : in(0); });
  });
  Kokkos::deep_copy(system.r, 1.0);
  const auto result = bicgstab(system, system.square(), 1e-10, 50);
  CHECK_FALSE(result.converged);
}
