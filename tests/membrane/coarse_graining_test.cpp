#include "membrane/coarse_graining.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/units.hpp"
#include "membrane/spring_law.hpp"

using namespace corpuscle;

namespace {

struct TableRow {
  int vertices;  // whose formulas give the row; the paper rounds them
  double l0_um, lm_um, p_um, theta0_deg;
};

// Table 1 of Akerkouch & Le (2021).
const TableRow table[] = {{506, 0.55614, 1.2235, 1.9933e-3, 6.86},
                          {1082, 0.37992, 0.83582, 2.9179e-3, 4.69},
                          {2996, 0.22818, 0.50199, 4.8584e-3, 2.82},
                          {9176, 0.13035, 0.28678, 8.5044e-3, 1.61},
                          {27472, 0.075331, 0.16573, 1.4716e-2, 0.93}};

}  // namespace

TEST_CASE("the formulas give Table 1") {
  for (const TableRow& row : table) {
    // The vertex numbers behind the rows are known to about 0.1 %, lengths go with their square root.
    const double l0 = uniform_edge_length(135, row.vertices);
    CHECK(l0 == Approx(row.l0_um).epsilon(1e-3));
    CHECK(l0 / WlcPowSpring::x0 == Approx(row.lm_um).epsilon(1e-3));
    // The rows' angles belong to up to 1.6 % more vertices than their lengths do.
    CHECK(spontaneous_angle(row.vertices) / units::degree == Approx(row.theta0_deg).epsilon(0.01));
    CHECK(persistence_times_length(6.32e-3) / l0 == Approx(row.p_um).epsilon(2e-3));
  }
}

TEST_CASE("coarse graining between the rows of Table 1") {
  const TableRow& fine = table[4];
  for (const TableRow& row : table) {
    const double l0 = coarse_length(fine.l0_um, fine.vertices, row.vertices);
    CHECK(l0 == Approx(row.l0_um).epsilon(1e-3));
    CHECK(coarse_persistence_length(fine.p_um, fine.l0_um, l0) == Approx(row.p_um).epsilon(1e-3));
    // k_p / l0^3 is what the shear modulus holds fixed.
    CHECK(coarse_repulsion(1, fine.l0_um, l0) * std::pow(fine.l0_um / l0, 3) == Approx(1).epsilon(1e-12));
  }
}

TEST_CASE("the springs' shear modulus is 6.32e-6 N/m at p l0 = 1.1086e-3 um2") {
  // Both figures are given to four digits.
  CHECK(persistence_times_length(6.317e-3) == Approx(1.1086e-3).epsilon(1e-3));
}

TEST_CASE("model units to SI") {
  const DpdScaling scaling;
  CHECK(4900 * scaling.energy_per_area() == Approx(0.236e-3).epsilon(2e-3));  // k_a, N/m
  CHECK(100 * scaling.energy_per_area() == Approx(4.82e-6).epsilon(2e-3));    // k_d, N/m
  CHECK(5000 * scaling.energy_per_volume() == Approx(248).epsilon(2e-3));     // k_v, Pa
  CHECK(scaling.diameter_model * scaling.length() == Approx(7.82e-6));
  CHECK(scaling.energy() == Approx(scaling.force() * scaling.length()));
  // A shear modulus in model units times the factor of a force over that of a length is one in N/m.
  CHECK(scaling.force() / scaling.length() == Approx(scaling.energy_per_area()));
  // Equation 17 by hand: 7.82e-6/8.06 * (6e-3/1.8) / (18.9e-6/392.5).
  CHECK(scaling.time() == Approx(0.06716).epsilon(1e-3));
}
