#include "membrane/stretching.hpp"

#include <catch2/catch.hpp>
#include <thread>

#include "core/error.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;
using Catch::Matchers::Contains;

namespace {

const std::string mills = std::string(CORPUSCLE_SOURCE_DIR) + "/cases/mills2004.csv";

struct CheckedRow {
  int step;  // of 15 to 200 pN
  double axial, transverse;
};

/// An independent code's diameters, um, on meshes of its own.
const std::vector<CheckedRow>& checked(int vertices) {
  static const std::vector<CheckedRow> v500 = {{0, 7.80, 7.81},  {1, 9.31, 7.22},   {2, 10.15, 6.82},  {4, 11.58, 6.20}, {6, 12.74, 5.79},
                                               {8, 13.65, 5.52}, {10, 14.37, 5.31}, {12, 14.95, 5.13}, {15, 15.63, 4.90}};
  static const std::vector<CheckedRow> v1000 = {{0, 7.81, 7.81},  {1, 9.32, 7.21},   {2, 10.18, 6.80},  {4, 11.60, 6.17}, {6, 12.76, 5.74},
                                                {8, 13.68, 5.46}, {10, 14.41, 5.23}, {12, 15.00, 5.03}, {15, 15.70, 4.77}};
  static const std::vector<CheckedRow> v3000 = {{0, 7.82, 7.81},  {1, 9.32, 7.22},   {2, 10.18, 6.82},  {4, 11.60, 6.20}, {6, 12.77, 5.79},
                                                {8, 13.70, 5.51}, {10, 14.44, 5.30}, {12, 15.04, 5.12}, {15, 15.75, 4.88}};
  return vertices == 500 ? v500 : (vertices == 1000 ? v1000 : v3000);
}

}  // namespace

TEST_CASE("stretching follows the checked curve and the experiment") {
  const int vertices = GENERATE(500, 1000, 3000);
  Membranes m({cell_settings(vertices)});
  StretchingSettings settings;
  settings.steps = 15;
  Kokkos::Timer timer;
  const StretchingResult r = stretch_cell(m, settings);
  const double seconds = timer.seconds();
  INFO(vertices << " vertices, " << seconds << " s on " << Exec().concurrency() << " threads of " << std::thread::hardware_concurrency()
                << " processors");
  REQUIRE(r.steps.size() == 16);
  CHECK(r.patch_vertices == vertices / 50);
  for (const CheckedRow& row : checked(vertices)) {
    const StretchingStep& s = r.steps[row.step];
    INFO(s.force_pN << " pN: " << s.axial_um << " / " << s.transverse_um);
    // Turning a mesh about z shifts the diameters by up to this much; two meshes agree no better.
    CHECK(s.axial_um == Approx(row.axial).margin(0.28));
    CHECK(s.transverse_um == Approx(row.transverse).margin(0.15));
    CHECK(s.residual <= settings.tolerance);
    CHECK(s.cell.stretch < 0.9);
  }
  // Relaxed: the ranges of the independent code over all N_v, widened by 0.02 um for meshes that differ.
  CHECK(r.rest.diameter_um == Approx(7.81).margin(0.03));
  CHECK(r.rest.thickness_center_um == Approx(0.835).margin(0.035));
  CHECK(r.rest.thickness_max_um == Approx(2.55).margin(0.03));
  const ExperimentComparison e = compare(r, read_experiment(mills));
  INFO("rms " << e.rms_axial_um << " axial, " << e.rms_transverse_um << " transverse");
  CHECK(e.points == 13);
  CHECK(e.inside_both == 13);
  // Independent code: 0.21 to 0.25 and 0.68 to 0.73 um. Over orientations ours range from 0.19 to 0.27 and 0.70 to
  // 0.75.
  CHECK(e.rms_axial_um < 0.30);
  CHECK(e.rms_transverse_um < 0.78);
  if (vertices == 500) CHECK(seconds < 10);  // the bound asked for on two threads
  report("{} vertices: {:.2f} s, rms {:.3f} / {:.3f} um, at rest {:.3f} {:.3f} {:.3f} um", vertices, seconds, e.rms_axial_um,
         e.rms_transverse_um, r.rest.diameter_um, r.rest.thickness_center_um, r.rest.thickness_max_um);
  for (const CheckedRow& row : checked(vertices)) {
    const StretchingStep& step = r.steps[row.step];
    report("{:.1f} pN: {:.2f} / {:.2f} um", step.force_pN, step.axial_um, step.transverse_um);
  }
}

TEST_CASE("the residual allowed does not show in the diameters") {
  StretchingSettings loose, tight;
  loose.steps = tight.steps = 2;
  tight.tolerance = 1e-8;
  Membranes a({cell_settings(300)}), b({cell_settings(300)});
  const auto x = stretch_cell(a, loose).steps.back(), y = stretch_cell(b, tight).steps.back();
  CHECK(x.axial_um == Approx(y.axial_um).margin(0.01));  // a hundredth of what two meshes differ by is 0.003
  CHECK(x.transverse_um == Approx(y.transverse_um).margin(0.01));
  CHECK(y.residual <= 1e-8);
}

TEST_CASE("stretching twice gives the same bits") {
  StretchingSettings settings;
  settings.steps = 2;
  Membranes a({cell_settings(300)}), b({cell_settings(300)});
  stretch_cell(a, settings);
  stretch_cell(b, settings);
  CHECK(a.state() == b.state());
}

TEST_CASE("a pulled cell returns to its shape") {
  StretchingSettings settings;
  settings.steps = 4;
  Membranes m({cell_settings(300)});
  const DiscShape before = disc_shape(body_mesh(m.surfaces(), 0));
  stretch_cell(m, settings);
  settings.force_pN = 1e-3;  // let go
  settings.steps = 1;
  settings.tolerance = 1e-2;
  const StretchingResult back = stretch_cell(m, settings);
  // A thousandth of a pN left, and a reference state that is the cell's own shape.
  CHECK(back.rest.diameter_um == Approx(before.diameter_um).margin(0.01));
  CHECK(back.rest.thickness_center_um == Approx(before.thickness_center_um).margin(0.02));
}

TEST_CASE("thickness of a known shape") {
  const DiscShape sphere = disc_shape(ellipsoid_mesh({2, 2, 1}, 2000));
  // Chords cut the surface by edge^2 / (8 radius), 0.003 um at this size.
  CHECK(sphere.diameter_um == Approx(4).margin(0.01));
  CHECK(sphere.thickness_center_um == Approx(2).margin(0.01));
  CHECK(sphere.thickness_max_um == Approx(2).margin(0.01));
}

TEST_CASE("stretching settings out of range are refused") {
  Membranes m({cell_settings(200)}), two({cell_settings(200), cell_settings(200)});
  const auto with = [](auto change) {
    StretchingSettings s;
    change(s);
    return s;
  };
  CHECK_THROWS_WITH(stretch_cell(two, {}), Contains("2 cells"));
  CHECK_THROWS_WITH(stretch_cell(m, with([](auto& s) { s.force_pN = 0; })), Contains("force_pN = 0"));
  CHECK_THROWS_WITH(stretch_cell(m, with([](auto& s) { s.steps = 0; })), Contains("steps = 0"));
  CHECK_THROWS_WITH(stretch_cell(m, with([](auto& s) { s.patch_fraction = 0.6; })), Contains("patch_fraction"));
  CHECK_THROWS_WITH(stretch_cell(m, with([](auto& s) { s.tolerance = 0; })), Contains("tolerance"));
}

TEST_CASE("a pull beyond what links can bear is a computation error") {
  StretchingSettings settings;
  settings.force_pN = 1e6;
  settings.steps = 2;
  settings.max_iterations = 2000;
  Membranes m({cell_settings(200)});
  CHECK_THROWS_WITH(stretch_cell(m, settings), Contains("not at rest") && Contains("stretching.force_pN"));
}

TEST_CASE("a membrane too soft for the force is called that, though it rests") {
  StretchingSettings settings;
  settings.steps = 16;
  auto soft = cell_settings(200);
  soft.shear_modulus_uN_per_m = 1e-3;
  Membranes m({soft});
  CHECK_THROWS_WITH(stretch_cell(m, settings),
                    Contains("of its contour length") && Contains("cells.0.shear_modulus_uN_per_m") && !Contains("not at rest"));
}

TEST_CASE("how far the curve may lie from the lines between computed forces") {
  StretchingResult r;
  for (double force : {0.0, 50.0, 100.0}) {
    StretchingStep step;
    step.force_pN = force;
    step.axial_um = 8 + 4e-4 * force * force;  // a parabola: 50^2 x 4e-4 / 4 from its chords
    step.transverse_um = 8 - 0.01 * force;
    r.steps.push_back(step);
  }
  ExperimentPoint point{25, 7.75, 8.25, 0, 10, 0, 10};
  CHECK(compare(r, {point}).interpolation_um == Approx(0.25));
  r.steps.pop_back();
  CHECK(compare(r, {point}).interpolation_um == Approx(0.5));
  point.force_pN = 60;
  CHECK(compare(r, {point}).points == 0);
}

TEST_CASE("experiment files") {
  const auto points = read_experiment(mills);
  REQUIRE(points.size() == 13);
  CHECK(points[1].force_pN == 15.987);
  CHECK(points[1].axial_hi_um == 9.995);
  CHECK_THROWS_WITH(read_experiment("/no/such.csv"), Contains("cannot be opened"));
}
