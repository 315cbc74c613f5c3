#include <catch2/catch.hpp>

#include "core/error.hpp"
#include "fluid/algebraic_multigrid.hpp"
#include "fluid/flux.hpp"
#include "fluid/pressure_krylov.hpp"
#include "fluid_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::fluid_test;

namespace {

/// One in eleven owned cells becomes immersed.
void mark_bodies(const IndexSpace& index, const Array<NodeKind>& kind) {
  for_owned(
      "corpuscle::test::bodies", index, KOKKOS_LAMBDA(int i, int j, int k) {
        if ((3 * i + 5 * j + 7 * k) % 11 == 0) kind(index.cell(i, j, k)) = NodeKind::immersed;
      });
}

/// A grid with everything the pressure rows are made from. Some cells are marked as bodies, one side as an outflow.
struct Scene {
  Grid grid;
  ViscousCoefficients g;
  Array<NodeKind> kind;
  PressureMask outflow, mask;
  bool skewed;

  Scene(const NodeSource& source, bool with_bodies, bool with_outflow)
      : grid(Comm(), source, {false, false, false}), skewed(!grid.orthogonal()) {
    const IndexSpace index = grid.index();
    const int n = index.size();
    for (int d = 0; d < 3; ++d) {
      g.normal[d] = Array<double>("corpuscle::test::normal", n);
      for (int e = 0; e < 3; ++e) g.cross[d][e] = Array<double>("corpuscle::test::cross", n);
    }
    if (skewed)
      viscous_coefficients<true>(grid.views(), g);
    else
      viscous_coefficients<false>(grid.views(), g);
    kind = Array<NodeKind>("corpuscle::test::kind", n);
    Kokkos::deep_copy(kind, grid.views().base_kind);
    outflow = PressureMask("corpuscle::test::outflow", n);
    mask = PressureMask("corpuscle::test::mask", n);
    if (with_bodies) mark_bodies(index, kind);
    if (with_outflow) mark_box(index, {{0, 0, index.n[2]}, {index.n[0], index.n[1], index.n[2] + 1}}, outflow);
    mark_pressure(kind, outflow, mask);
  }

  Table<double> rows(int pinned = -1) const {
    const RowPattern pattern = RowPattern::make(skewed);
    Table<double> value("corpuscle::test::value", grid.index().owned(), pattern.count);
    if (skewed)
      pressure_rows<true>(grid.views(), g.normal, kind, mask, pattern, pinned, value);
    else
      pressure_rows<false>(grid.views(), g.normal, kind, mask, pattern, pinned, value);
    return value;
  }
};

NodeSource straight_box() { return make_node_source(box({6, 5, 7}, {3, 2.5, 4})); }

/// Largest difference between A psi, from the rows, and minus the divergence of psi's flux, from correct_flux.
double row_error(const Scene& s) {
  const IndexSpace index = s.grid.index();
  const auto psi = Array<double>("corpuscle::test::psi", index.size());
  const auto mask = s.mask;
  const auto kind = s.kind;
  Kokkos::parallel_for(
      "corpuscle::test::psi", Policy(0, index.size()),
      KOKKOS_LAMBDA(int c) { psi(c) = kind(c) == NodeKind::fluid ? std::sin(0.37 * c) + 0.2 * std::cos(0.011 * c) : 0.0; });
  Array<double> flux[3];
  for (auto& f : flux) f = Array<double>("corpuscle::test::flux", index.size());
  const Array<double> divergence("corpuscle::test::divergence", index.owned());
  if (s.skewed)
    correct_flux<true>(s.grid.views(), s.g.normal, mask, psi, flux);
  else
    correct_flux<false>(s.grid.views(), s.g.normal, mask, psi, flux);
  negative_divergence(s.grid.views(), kind, flux, divergence);
  const auto rows = s.rows();
  const RowPattern pattern = RowPattern::make(s.skewed);
  double worst = 0;
  reduce_owned(
      "corpuscle::test::row_error", index,
      KOKKOS_LAMBDA(int i, int j, int k, double& most) {
        const int r = index.compact(i, j, k);
        if (kind(index.cell(i, j, k)) != NodeKind::fluid) return;
        double sum = divergence(r);
        for (int n = 0; n < pattern.count; ++n)
          sum += rows(r, n) * psi(index.cell(i + pattern.di[n], j + pattern.dj[n], k + pattern.dk[n]));
        most = larger(most, std::abs(sum));
      },
      Largest(worst));
  return worst;
}

/// Largest error of the nodal and of the face gradient for a pressure that is linear in space.
double linear_error(const Scene& s) {
  const IndexSpace index = s.grid.index();
  const auto x = s.grid.views().x;
  const auto mask = s.mask;
  const auto kind = s.kind;
  const Vec3 slope{0.7, -1.1, 0.4};
  const auto p = Array<double>("corpuscle::test::p", index.size());
  Kokkos::parallel_for(
      "corpuscle::test::p", Policy(0, index.size()), KOKKOS_LAMBDA(int c) {
        // A value that would spoil any formula that read it where there is no pressure.
        p(c) = mask(c) ? dot(slope, load(x, c)) : 1e6;
      });
  double worst = 0;
  for (int d = 0; d < 3; ++d) {
    const auto area = s.grid.views().face_area[d];
    const auto coefficient = s.g.normal[d];
    const bool skewed = s.skewed;
    double here = 0;
    reduce_owned(
        "corpuscle::test::linear_error", index,
        KOKKOS_LAMBDA(int i, int j, int k, double& most) {
          const int c = index.cell(i, j, k);
          if (kind(c) != NodeKind::fluid) return;
          // Where no neighbour along a direction has a pressure the gradient along it is taken as zero.
          for (int e = 0; e < 3; ++e)
            if (!mask(c - index.stride(e)) && !mask(c + index.stride(e))) return;
          double error = norm(cell_gradient(p, mask, x, index, c) - slope);
          const int low = c - index.stride(d);
          bool face = mask(low);
          for (int e = 0; e < 3; ++e) face = face && (e == d || mask(low - index.stride(e)) || mask(low + index.stride(e)));
          if (face) {
            const Vec3 a = load(area, c);
            const double flux = skewed ? face_gradient<true>(p, mask, x, a, coefficient(c), index, d, c)
                                       : face_gradient<false>(p, mask, x, a, coefficient(c), index, d, c);
            const double off = std::abs(flux - dot(slope, a)) / norm(a);
            error = larger(error, off);
          }
          most = larger(most, error);
        },
        Largest(here));
    worst = larger(worst, here);
  }
  return worst;
}

}  // namespace

TEST_CASE("pressure rows are minus the divergence of the flux correction", "[fluid]") {
  const bool bodies = GENERATE(false, true), outflow = GENERATE(false, true);
  CHECK(row_error(Scene(straight_box(), bodies, outflow)) < 1e-13);  // coefficients of order one: round-off
  CHECK(row_error(Scene(warped_box({6, 5, 7}), bodies, outflow)) < 1e-13);
}

TEST_CASE("pressure rows sum to zero away from an outflow and are symmetric on an orthogonal grid", "[fluid]") {
  for (const bool skewed : {false, true}) {
    const Scene s(skewed ? warped_box({6, 5, 7}) : straight_box(), true, true);
    REQUIRE(s.skewed == skewed);
    const IndexSpace index = s.grid.index();
    const auto value = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), s.rows());
    const auto kind = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), s.kind);
    const RowPattern pattern = RowPattern::make(skewed);
    visit_owned(index, [&](int i, int j, int k, int c) {
      if (kind(c) != NodeKind::fluid) return;
      const int r = index.compact(i, j, k);
      double sum = 0;
      for (int n = 0; n < pattern.count; ++n) sum += value(r, n);
      if (k + 2 < index.n[2]) CHECK(std::abs(sum) < 1e-14);  // round-off
      CHECK(value(r, 0) > 0);
      for (int n = 1; n < pattern.count && !skewed; ++n) {
        const int to[3] = {i + pattern.di[n], j + pattern.dj[n], k + pattern.dk[n]};
        if (!index.owns(to[0], to[1], to[2]) || kind(index.cell(to[0], to[1], to[2])) != NodeKind::fluid) continue;
        for (int m = 1; m < pattern.count; ++m)
          if (pattern.di[m] == -pattern.di[n] && pattern.dj[m] == -pattern.dj[n] && pattern.dk[m] == -pattern.dk[n])
            CHECK(value(r, n) == value(index.compact(to[0], to[1], to[2]), m));
      }
    });
  }
}

TEST_CASE("pressure gradients are exact for linear pressures, beside walls, bodies and outflows too", "[fluid]") {
  const bool bodies = GENERATE(false, true), outflow = GENERATE(false, true);
  CHECK(linear_error(Scene(straight_box(), bodies, outflow)) < 1e-12);  // differences over spacings of 0.3
  CHECK(linear_error(Scene(warped_box({6, 5, 7}), bodies, outflow)) < 1e-12);
}

TEST_CASE("the Krylov solver reaches the tolerance it is given", "[fluid][ranks]") {
  const Comm comm;
  const bool skewed = GENERATE(false, true);
  const std::array<bool, 3> periodic{false, false, true};
  const NodeSource sheared{{8, 9, 12}, [](int i, int j, int k) { return Triple{i + 0.4 * j, 1.0 * j, 1.2 * k}; }};
  Grid grid(comm, skewed ? sheared : make_node_source(box({8, 9, 12}, {4, 4, 6})), periodic);
  REQUIRE(grid.orthogonal() == !skewed);
  // One for each, since both work on their system's vectors.
  HypreSystem system(grid.comm(), grid.index(), grid.halo(), skewed), same(grid.comm(), grid.index(), grid.halo(), skewed);
  AlgebraicMultigrid amg(same);
  PressureKrylov solver(
      system, [&](const Array<double>& r, const Array<double>& z) { amg.cycle(r, z); }, 200);
  const IndexSpace index = grid.index();
  ViscousCoefficients g;
  for (int d = 0; d < 3; ++d) {
    g.normal[d] = Array<double>("corpuscle::test::normal", index.size());
    for (int e = 0; e < 3; ++e) g.cross[d][e] = Array<double>("corpuscle::test::cross", index.size());
  }
  PressureMask none("corpuscle::test::outflow", index.size()), mask("corpuscle::test::mask", index.size());
  mark_pressure(grid.views().base_kind, none, mask);
  // No outflow: the level is free, and one node fixes it.
  const int pinned = comm.root() ? index.cell(0, 0, 0) : -1;
  if (skewed) {
    viscous_coefficients<true>(grid.views(), g);
    pressure_rows<true>(grid.views(), g.normal, grid.views().base_kind, mask, system.pattern(), pinned, system.values());
  } else {
    viscous_coefficients<false>(grid.views(), g);
    pressure_rows<false>(grid.views(), g.normal, grid.views().base_kind, mask, system.pattern(), pinned, system.values());
  }
  Kokkos::deep_copy(same.values(), system.values());
  system.set_values();
  same.set_values();
  amg.set_up();
  // A right-hand side that sums to zero: the divergence of an arbitrary flux through inner faces.
  const Array<double> psi("corpuscle::test::psi", index.size());
  Kokkos::parallel_for(
      "corpuscle::test::psi", Policy(0, index.size()), KOKKOS_LAMBDA(int c) {
        int i, j, k;
        index.unpack(c, i, j, k);
        psi(c) = std::sin(0.9 * (i + index.first[0])) * std::cos(1.1 * (j + index.first[1])) +
                 std::cos(0.5235987755982988 * 2 * (k + index.first[2]));
      });
  Array<double> flux[3];
  for (auto& f : flux) f = Array<double>("corpuscle::test::flux", index.size());
  const Array<double> rhs("corpuscle::test::rhs", index.owned()), x("corpuscle::test::x", index.owned());
  const Array<double> field("corpuscle::test::field", index.size());
  const auto correct = [&](const Array<double>& p) {
    if (skewed)
      correct_flux<true>(grid.views(), g.normal, mask, p, flux);
    else
      correct_flux<false>(grid.views(), g.normal, mask, p, flux);
  };
  correct(psi);
  negative_divergence(grid.views(), grid.views().base_kind, flux, rhs);
  // The first solve stops ten digits down; the second one starts from the divergence that is left.
  double residual = comm.max(largest_magnitude(rhs));
  REQUIRE(residual > 0.1);
  // Ten digits of the 2-norm, which is at most the largest entry times the root of their number (864). At the pinned
  // node the divergence is the sum of all rows' residuals, which is at most that root times their 2-norm.
  const double root = std::sqrt(864.0), ten_digits = 1e-10 * root * residual;
  for (const double bound : {(1 + root) * ten_digits, (1 + root) * 1e-12}) {
    const auto result = solver.solve(rhs, x, 1e-12);
    CHECK(result.converged);
    CHECK(result.iterations < 40);
    scalar_from_compact(index, x, field);
    grid.halo().exchange(field);
    correct(field);
    negative_divergence(grid.views(), grid.views().base_kind, flux, rhs);
    residual = comm.max(largest_magnitude(rhs));
    INFO("residual over bound " << residual / bound);
    CHECK(residual < bound);
  }
  // A third one finds nothing to do.
  CHECK(solver.solve(rhs, x, (1 + root) * root * 1e-12).iterations == 0);
  CHECK(largest_magnitude(x) == 0);
}

namespace {

/// What setting up BoomerAMG says about a unit matrix in which the last rank has a row of zeros.
std::string message_for_zero_row(const Comm& comm) {
  Grid grid(comm, make_node_source(box({8, 9, 12}, {4, 4, 6})), {false, false, false});
  HypreSystem system(grid.comm(), grid.index(), grid.halo(), false);
  const auto value = system.values();
  const int zero = comm.rank() == comm.size() - 1 ? 17 : -1;
  Kokkos::parallel_for(
      "corpuscle::test::rows", Policy(0, grid.index().owned()), KOKKOS_LAMBDA(int r) { value(r, 0) = r == zero ? 0.0 : 1.0; });
  system.set_values();
  AlgebraicMultigrid amg(system);
  try {
    amg.set_up();
  } catch (const ComputationError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a failure that hypre reports stops all ranks with its words, and is not held against what follows", "[fluid][ranks]") {
  const Comm comm;
  const std::string message = message_for_zero_row(comm);
  CHECK_THAT(message, Catch::Contains("pressure: hypre could not set up BoomerAMG"));
  CHECK_THAT(message, Catch::Contains("[Error in argument 1]"));
  CHECK_THAT(message, Catch::Contains("time.step_us"));
  HypreErrors errors;
  errors.check(HypreErrors::krylov);
  CHECK_NOTHROW(errors.raise(comm));
}
