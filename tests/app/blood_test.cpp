// What is measured of blood, in the files of a run.
#include <cmath>
#include <fstream>

#include "program.hpp"

using namespace app;

namespace {

/// Small capsules, in rows, in a flow aslant between resting walls, or one driven by walls alone.
fs::path write_case(const fs::path& folder, const std::string& name, bool sheared, int cells = 18) {
  std::ofstream out(folder / (name + ".toml"));
  out << "[time]\nstep_us = 10\nend_us = 80\n"
         "[grid]\ngenerator = \"box\"\nnodes = [25, 9, 13]\nlower_um = [0, 0, 0]\nupper_um = [12, 4, 6]\n"
         "[fluid]\nconvection = false\nmomentum_tolerance = 1e-12\ndivergence_tolerance = 1e-13\n";
  if (!sheared) out << "pressure_gradient_Pa_per_um = [-6, 0, -2]\n";
  for (const char* side : {"i_min", "i_max", "j_min", "j_max", "k_min", "k_max"}) {
    const bool wall = side[0] == 'j', moves = wall && sheared;
    out << "[[boundary]]\nside = \"" << side << "\"\ntype = \"" << (moves ? "moving_wall" : wall ? "wall" : "periodic") << "\"\n";
    if (moves) out << "velocity_mm_per_s = [" << (side[2] == 'm' && side[3] == 'i' ? -4 : 4) << ", 0, 0]\n";
  }
  out << "[[cell_types]]\nname = \"large\"\nshape = \"sphere\"\nradius_um = 0.75\nvertices = 60\nlaw = "
         "\"neo-hookean\"\n"
         "[[cell_types]]\nname = \"small\"\nshape = \"sphere\"\nradius_um = 0.65\nvertices = 50\nlaw = "
         "\"neo-hookean\"\n";
  for (int n = 0; n < cells; ++n)
    out << "[[cells]]\ntype = \"" << (n % 3 == 0 ? "large" : "small") << "\"\ncenter_um = [" << 1 + 2.0 * (n % 6) << ", "
        << 1 + 2.0 * (n / 6 % 2) << ", " << 1.5 + 3.0 * (n / 12) << "]\n";
  out << "[coupling]\nscheme = \"force\"\n[contact]\nrange_um = 0.1\n[blood]\nfrom_us = 20\nsample_every_us = 10\n"
         "[output]\nfields = [\"wall_shear_stress\"]\nevery_us = 80\ncheckpoint_every_us = 40\nhistory_every_us = 20\n";
  return folder / (name + ".toml");
}

/// The largest difference of the numbers of two tables, over what is largest in their column.
double largest_difference(const fs::path& a, const fs::path& b) {
  std::ifstream first(a), second(b);
  std::string one, two;
  double most = 0;
  std::getline(first, one), std::getline(second, two);
  CHECK(one == two);
  while (std::getline(first, one)) {
    REQUIRE(std::getline(second, two));
    const auto x = split(one), y = split(two);
    REQUIRE(x.size() == y.size());
    for (std::size_t n = 0; n < x.size(); ++n) {
      REQUIRE(x[n].empty() == y[n].empty());
      if (!x[n].empty()) most = std::max(most, std::abs(std::stod(x[n]) - std::stod(y[n])) / (1e-12 + std::abs(std::stod(x[n]))));
    }
  }
  CHECK_FALSE(std::getline(second, two));
  return most;
}

}  // namespace

TEST_CASE("blood between walls: the report, its samples and profiles, on any ranks and after a restart") {
  const auto folder = fresh_folder("blood");
  const std::string name = write_case(folder, "driven", false).string();
  succeed(folder, {"run", name, "--out", "one"}, {1, 1});
  const auto blood = report(folder / "one")["blood"];
  INFO(blood.dump(1));
  CHECK(blood["cells"] == 18);
  CHECK(blood["samples"] == 7);  // at 20, 30, ... 80 us
  CHECK(blood["crossings"] == 0);
  const double share = blood["tube_hematocrit"];
  CHECK(share == Approx((6 * std::pow(0.75, 3) + 12 * std::pow(0.65, 3)) * 4 * M_PI / 3 / (12 * 4 * 6)).epsilon(0.12));  // coarse meshes
  const double speed = blood["mean_speed_mm_per_s"], cells = blood["cell_speed_mm_per_s"];
  CHECK(cells / speed == Approx(1.5 * 0.75).epsilon(0.1));  // of a parabola, half way from the middle to the wall
  CHECK(blood["discharge_hematocrit"].get<double>() == Approx(share * cells / speed).epsilon(1e-12));
  CHECK(blood["relative_apparent_viscosity"].get<double>() > 1);
  CHECK(blood["relative_apparent_viscosity"].get<double>() < 1.3);
  CHECK(blood["plasma_mean_speed_mm_per_s"].get<double>() ==
        Approx(std::hypot(6, 2) * 16 / (12 * 1.1)).epsilon(0.04));  // 2 over the cells across, squared
  CHECK(blood["relative_apparent_viscosity_error"].is_null());      // of seven samples none is told
  CHECK(blood["cell_free_layer_um"].get<double>() == Approx(0.3).margin(0.1));
  CHECK(blood["cell_free_layer_um"].get<double>() > 0);
#ifdef CORPUSCLE_HDF5
  const auto profile = data_set(folder / "one/blood.h5", "profile/hematocrit");
  const auto velocity = data_set(folder / "one/blood.h5", "profile/velocity_mm_per_s");
  REQUIRE(profile.size() == 8);
  double mean = 0, flow = 0;
  for (std::size_t b = 0; b < 8; ++b) mean += profile[b] / 8, flow += velocity[b] / 8;
  CHECK(mean == Approx(share).epsilon(1e-9));
  CHECK(flow == Approx(speed).epsilon(1e-9));
  CHECK(profile[0] < 0.3 * share);
  // The wall holds what the gradient drives, but for what is still speeding up.
  const auto stress = data_set(folder / "one/fields.h5", "step_000000008/wall_shear_stress_Pa");
  REQUIRE(stress.size() == 3 * 24 * 8 * 12);
  const double gradient[3] = {6, 0, 2};
  for (int d = 0; d < 3; ++d) {
    double force = 0;
    for (int k = 0; k < 12; ++k)
      for (int i = 0; i < 24; ++i)
        for (int j : {0, 7}) force += 0.25 * stress[3 * (i + 24 * (j + 8 * k)) + d];
    CHECK(force == Approx(gradient[d] * 12 * 4 * 6).epsilon(0.03).margin(1));
    for (int j = 1; j < 7; ++j) CHECK(stress[3 * (5 + 24 * (j + 8 * 3)) + d] == 0);
  }
  // Of many cells each one's shape is with its other figures.
  CHECK(data_set(folder / "one/cells.h5", "step_000000008/per_cell/deformation").size() == 18);
  CHECK(data_set(folder / "one/cells.h5", "step_000000008/per_cell/tank_treading_deg").size() == 18);
  // And at the history's times, in a series of its own.
  const auto deformation = data_set(folder / "one/cell_series.h5", "step_000000006/deformation");
  REQUIRE(deformation.size() == 18);
  CHECK(deformation[4] > 0);
  CHECK(data_set(folder / "one/cell_series.h5", "step_000000008/centroid_um") ==
        data_set(folder / "one/cells.h5", "step_000000008/per_cell/centroid_um"));
  const auto listed = contents(folder / "one/cell_series.xdmf");
  CHECK_THAT(listed, Catch::Contains("CollectionType=\"Temporal\"") && Catch::Contains("Polyvertex") &&
                         Catch::Contains("NodesPerElement=\"1\">\n     <DataItem Dimensions=\"18\"") && Catch::Contains("deformation"));
#ifdef CORPUSCLE_MPI
  for (int ranks : {2, 4}) {
    const std::string out = "on_" + std::to_string(ranks);
    succeed(folder, {"run", name, "--out", out}, {1, ranks});
    INFO(out);
    CHECK(largest_difference(folder / "one/blood.csv", folder / out / "blood.csv") < 1e-8);  // round-off, grown over eight steps
    const auto on_ranks = data_set(folder / out / "cell_series.h5", "step_000000006/deformation");
    REQUIRE(on_ranks.size() == 18);
    for (int n = 0; n < 18; ++n) CHECK(on_ranks[n] == Approx(deformation[n]).margin(1e-9));
    // A solve of the pressure alone takes some ten iterations, each with a joint reduction and a message to each neighbour.
    const auto traffic = report(folder / out)["traffic"];
    CHECK(traffic["reductions_per_step"].get<double>() > 10);
    CHECK(traffic["reductions_per_step"].get<double>() < 400);
    CHECK(traffic["messages_per_step"].get<double>() > 20);
    CHECK(traffic["bytes_per_step"].get<double>() > 4 * traffic["messages_per_step"].get<double>());
  }
  CHECK(!report(folder / "one").contains("traffic"));
#endif
  // Stopped at 40 us and gone on from there: the same bits.
  succeed(folder, {"run", name, "--out", "parts", "--set", "time.end_us=40"}, {1, 1});
  succeed(folder, {"run", name, "--out", "parts", "--restart", "parts/checkpoint.h5"}, {1, 1});
  CHECK(contents(folder / "parts/blood.csv") == contents(folder / "one/blood.csv"));
  CHECK(report(folder / "parts")["blood"] == blood);
  for (const char* set : {"hematocrit", "velocity_mm_per_s"})
    CHECK(data_set(folder / "parts/blood.h5", std::string("profile/") + set) ==
          data_set(folder / "one/blood.h5", std::string("profile/") + set));
#ifdef CORPUSCLE_MPI
  succeed(folder, {"run", name, "--out", "parts_2", "--set", "time.end_us=40"}, {1, 1});
  succeed(folder, {"run", name, "--out", "parts_2", "--restart", "parts_2/checkpoint.h5"}, {1, 2});
  CHECK(largest_difference(folder / "one/blood.csv", folder / "parts_2/blood.csv") < 1e-8);
  CHECK(report(folder / "parts_2")["blood"]["samples"] == 7);
#endif
  CHECK(data_set(folder / "parts/cell_series.h5", "step_000000006/deformation") == deformation);
  CHECK(contents(folder / "parts/cell_series.xdmf") == listed);
  // They are results: another run does not write among them unasked.
  fs::remove(folder / "parts/report.json");
  for (const char* file : {"history.csv", "cells.h5", "fields.h5", "cells.xdmf", "fields.xdmf", "checkpoint.h5"})
    fs::copy(folder / "parts" / file, folder / file), fs::remove(folder / "parts" / file);
  fail(folder, {"run", name, "--out", "parts"}, 2, {"blood.csv"}, {1, 1, "OMP_WAIT_POLICY=passive", false});
  // Other bins cannot go on from what was sampled; sampling begins anew, and says so.
  const auto anew = succeed(
      folder, {"run", name, "--out", "anew", "--restart", "checkpoint.h5", "--set", "time.end_us=100", "--set", "blood.bins=4"}, {1, 1});
  CHECK_THAT(anew.output, Catch::Contains("sampling begins anew"));
  CHECK(report(folder / "anew")["blood"]["samples"] == 2);
  // Nor those of another flow.
  const auto faster = succeed(folder,
                              {"run", name, "--out", "faster", "--restart", "checkpoint.h5", "--set", "time.end_us=100", "--set",
                               "fluid.pressure_gradient_Pa_per_um=[-7, 0, -2]"},
                              {1, 1});
  CHECK_THAT(faster.output, Catch::Contains("(fluid.pressure_gradient_Pa_per_um): sampling begins anew"));
  CHECK(report(folder / "faster")["blood"]["samples"] == 2);
  CHECK(report(folder / "faster")["blood"]["from_us"] == 80);
#endif
}

TEST_CASE("where more than blood drives or holds a flow, nothing is told of how viscous it is") {
  const auto folder = fresh_folder("disturbed");
  const std::string name = write_case(folder, "sheared", true, 2).string();
  const bool pushed = GENERATE(true, false);
  std::vector<std::string> options{
      "run",  name, "--out", "run", "--overwrite", "--set", "blood.from_us=0", "--set", "time.end_us=40", "--set", "output.every_us=40",
      "--set"};
  if (pushed) {
    options.emplace_back("cells.0.push_nN=[0.05, 0, 0]");
  } else {
    for (const char* more : {"boundary.0.type=symmetry", "--set", "boundary.1.type=symmetry"}) options.emplace_back(more);
  }
  succeed(folder, options, {1, 1});
  const auto blood = report(folder / "run")["blood"];
  CHECK_FALSE(blood.contains("relative_apparent_viscosity"));
  CHECK_THAT(blood["left_out"]["relative_apparent_viscosity"].get<std::string>(),
             Catch::Contains(pushed ? "cells are pushed" : "turns back"));
}

TEST_CASE("blood in a viscometer: what has a meaning there, and why the rest is left out") {
  const auto folder = fresh_folder("viscometer");
  const std::string name = write_case(folder, "sheared", true, 2).string();
  succeed(folder, {"run", name, "--out", "run", "--set", "blood.from_us=0", "--set", "time.end_us=200", "--set", "output.every_us=200"},
          {1, 1});
  const auto blood = report(folder / "run")["blood"];
  INFO(blood.dump(1));
  // 0.9 % of nearly round capsules: Einstein's 1 + 2.5 of it, which walls so near may double.
  const double share = blood["tube_hematocrit"], viscosity = blood["relative_apparent_viscosity"];
  CHECK(share == Approx(0.01).epsilon(0.2));
  CHECK(viscosity > 1 + 0.5 * share);
  CHECK(viscosity < 1 + 6 * share);
  CHECK(blood.contains("relative_apparent_viscosity_error"));  // null unless the 20 samples know nothing of each other
  for (const char* missing : {"discharge_hematocrit", "mean_speed_mm_per_s", "cell_speed_mm_per_s"}) {
    CHECK_FALSE(blood.contains(missing));
    CHECK_THAT(blood["left_out"][missing].get<std::string>(), Catch::Contains("no flow is driven"));
  }
  CHECK(blood.contains("cell_free_layer_um"));
  const auto lines = history(folder / "run");
  for (const char* column : {"deformation", "inclination_deg", "membrane_angle_deg", "tank_treading_deg"})
    CHECK(std::isfinite(lines.number(lines.lines.size() - 1, column)));
  // Stretched towards half a right angle, and turned with the flow, against the sense of the angles.
  CHECK(lines.number(lines.lines.size() - 1, "inclination_deg") > 20);
  CHECK(lines.number(lines.lines.size() - 1, "inclination_deg") < 50);
  CHECK(lines.number(lines.lines.size() - 1, "membrane_angle_deg") < lines.number(0, "membrane_angle_deg"));
  // Walls that come to speed slowly, in 40 times what the flow takes to follow: the same viscosity at any of their speeds.
  std::vector<std::string> ramp{"run",   name,
                                "--out", "ramp",
                                "--set", "blood.from_us=0",
                                "--set", "time.end_us=200",
                                "--set", "output.every_us=200",
                                "--set", "boundary.2.ramp_us=400",
                                "--set", "boundary.3.ramp_us=400"};
  succeed(folder, ramp, {1, 1});
  CHECK(report(folder / "ramp")["blood"]["relative_apparent_viscosity"].get<double>() == Approx(viscosity).margin(0.05));
  // Walls that swing through rest: the sample there has no rate of shear, and is left out of the mean, not the mean itself.
  succeed(folder,
          {"run", name, "--out", "swing", "--set", "blood.from_us=0", "--set", "time.end_us=80", "--set", "output.every_us=80", "--set",
           "boundary.2.time_table=[[0, 1], [40, 0], [80, -1]]", "--set", "boundary.3.time_table=[[0, 1], [40, 0], [80, -1]]"},
          {1, 1});
  const auto swing = report(folder / "swing")["blood"];
  INFO(swing.dump(1));
  CHECK(swing["relative_apparent_viscosity"].get<double>() == Approx(viscosity).margin(0.1));  // forth and back
  CHECK_THAT(swing["samples_left_out"]["relative_apparent_viscosity"].get<std::string>(), Catch::Contains("1 of 8"));
  // Walls that rest.
  succeed(folder,
          {"run", name, "--out", "rest", "--set", "blood.from_us=0", "--set", "boundary.2.velocity_mm_per_s=[0, 0, 0]", "--set",
           "boundary.3.velocity_mm_per_s=[0, 0, 0]"},
          {1, 1});
  const auto rest = report(folder / "rest");
  INFO(rest.dump(1));
  for (const char* missing : {"relative_apparent_viscosity", "cell_free_layer_um"})
    CHECK_THAT(rest["blood"]["left_out"][missing].get<std::string>(), Catch::Contains("no wall that moves"));
}

TEST_CASE("blood between four walls has speeds, hematocrits and a viscosity") {
  const auto folder = fresh_folder("duct");
  const std::string name = write_case(folder, "driven", false).string();
  std::string text = contents(name);
  for (const char* side : {"k_min", "k_max"}) {
    const std::string open = std::string(side) + "\"\ntype = \"periodic\"";
    const auto at = text.find(open);
    REQUIRE(at != std::string::npos);
    text.replace(at, open.size(), std::string(side) + "\"\ntype = \"wall\"");
  }
  text.replace(text.find("[-6, 0, -2]"), 11, "[-6, 0, 0]");
  std::ofstream(name) << text;
  const Words run = with({"run", name, "--out", "run"}, {"grid.nodes=[13,17,25]", "output.fields=false"});
  succeed(folder, run, {1, 1});
  const auto blood = report(folder / "run")["blood"];
  INFO(blood.dump(1));
  // In a duct of 4 x 6 um plasma flows at G b^2 / (3 mu) (1 - 192 b / (pi^5 a) sum tanh(n pi a / 2 b) / n^5), n odd (White, Viscous
  // Fluid Flow, 3-48); half widths a = 3, b = 2.
  const double pi = std::acos(-1.0);
  double sum = 0;
  for (int n = 1; n < 20; n += 2) sum += std::tanh(n * pi * 3 / (2 * 2)) / std::pow(n, 5);
  const double exact = 6e-3 * 2 * 2 / (3 * 1.1) * (1 - 192 * 2.0 / (std::pow(pi, 5) * 3) * sum) / 1e-3;
  CHECK(blood["plasma_mean_speed_mm_per_s"].get<double>() == Approx(exact).epsilon(0.02));  // of second order: 4.4 % with half the cells
  CHECK(blood["mean_speed_mm_per_s"].get<double>() > 0);
  CHECK(blood["relative_apparent_viscosity"].get<double>() > 1);
  CHECK(blood["discharge_hematocrit"].get<double>() > 0);
  CHECK_THAT(blood["left_out"]["cell_free_layer_um"].get<std::string>(), Catch::Contains("four walls"));
  CHECK(blood.dump().find("no flow is driven") == std::string::npos);
}

TEST_CASE("packed cells with membrane viscosity run") {
  const auto folder = fresh_folder("viscous_population");
  const std::string name = write_case(folder, "driven", false, 1).string();
  std::ofstream(name, std::ios::app) << "[[populations]]\ntype = \"large\"\ncount = 2\n";
  succeed(folder,
          {"run", name, "--out", "run", "--set", "time.end_us=20", "--set", "blood.from_us=0", "--set",
           "cell_types.0.membrane_viscosity_N_s_per_m=1e-8"},
          {1, 1});
  CHECK(report(folder / "run")["blood"]["cells"] == 3);
}

TEST_CASE("blood is sampled at fixed times, whatever the steps") {
  const auto folder = fresh_folder("blood_times");
  const std::string name = write_case(folder, "driven", false, 1).string();
  std::string text = contents(name);
  const auto key = text.find("sample_every_us = 10\n");
  REQUIRE(key != std::string::npos);
  text.erase(key, std::string("sample_every_us = 10\n").size());
  std::ofstream(name) << text;
  // Shorter steps at first: 25 of each length. Ten whole steps between samples all the same.
  succeed(folder,
          {"run", name, "--out", "run", "--set", "blood.from_us=0", "--set", "time.step_us=4", "--set", "time.first_step_us=1", "--set",
           "time.end_us=160", "--set", "output.every_us=160"},
          {1, 1});
  std::ifstream table(folder / "run/blood.csv");
  std::string line;
  std::getline(table, line);
  for (double time = 40; std::getline(table, line); time += 40) CHECK(std::stod(line) == Approx(time).margin(1e-6));
  CHECK(report(folder / "run")["blood"]["samples"] == 4);
}

TEST_CASE("blood in tubes, straight and bent") {
  const auto folder = fresh_folder("blood_tubes");
  const auto write = [&](const std::string& name, const std::string& shape, const std::string& ends, const std::string& place) {
    std::ofstream out(folder / name);
    out << "[time]\nstep_us = 8\nend_us = 320\n[grid]\nnodes = [17, 17, 25]\ndiameter_um = 8\n"
        << shape << "[fluid]\nconvection = false\nmomentum_tolerance = 1e-11\ndivergence_tolerance = 1e-12\n"
        << ends;
    for (const char* side : {"i_min", "i_max", "j_min", "j_max"}) out << "[[boundary]]\nside = \"" << side << "\"\ntype = \"wall\"\n";
    out << "[[cells]]\nshape = \"sphere\"\nradius_um = 2\nlaw = \"neo-hookean\"\nshear_modulus_uN_per_m = 15\nvertices "
           "= 200\ncenter_um = "
        << place
        << "\n[coupling]\nscheme = \"force\"\n[blood]\nfrom_us = 100\nsample_every_us = 8\n[output]\nfields = "
           "false\ncells = false\n";
    return (folder / name).string();
  };
  const auto end = [](const char* side, const std::string& what) { return "[[boundary]]\nside = \"" + std::string(side) + "\"\n" + what; };
  const std::string straight =
      write("straight.toml", "generator = \"straight_tube\"\nlength_um = 12\n",
            "pressure_gradient_Pa_per_um = [0, 0, -2]\n" + end("k_min", "type = \"periodic\"\n") + end("k_max", "type = \"periodic\"\n"),
            "[0, 0, 5.5]");
  succeed(folder, {"run", straight, "--out", "straight"}, {1, 1});
  const auto tube = report(folder / "straight")["blood"];
  INFO(tube.dump(1));
  // A stiff ball of half the tube's width on its axis: by Faxen's law, 2 (1 - 2/3 (a/R)^2) times the mean speed, of one
  // so small that the walls do not feel it, in an endless tube.
  const double share = tube["tube_hematocrit"], viscosity = tube["relative_apparent_viscosity"];
  CHECK(share == Approx(4.0 / 3 * 8 / (16 * 12)).epsilon(0.03));
  CHECK(tube["cell_speed_mm_per_s"].get<double>() / tube["mean_speed_mm_per_s"].get<double>() == Approx(5.0 / 3).epsilon(0.03));
  CHECK(viscosity > 1.005);
  CHECK(viscosity < 1.15);
  if (tube["relative_apparent_viscosity_error"].is_number())
    CHECK(tube["relative_apparent_viscosity_error"].get<double>() < 0.05);
  else
    CHECK_THAT(tube["left_out"]["relative_apparent_viscosity_error"].get<std::string>(), Catch::Contains("at least"));
  CHECK(tube["cell_free_layer_um"].get<double>() == Approx(2).margin(0.6));
#ifdef CORPUSCLE_MPI
  succeed(folder, {"run", straight, "--out", "straight_2"}, {1, 2});
  CHECK(largest_difference(folder / "straight/blood.csv", folder / "straight_2/blood.csv") < 1e-7);
#endif
  // A quarter of a circle of 20 um around (20, 0, 0).
  const std::string bent = write(
      "bent.toml", "generator = \"swept_tube\"\ncenterline = \"arc\"\narc_radius_um = 20\narc_angle_deg = 90\n",
      end("k_min", "type = \"velocity_inlet\"\nvelocity_mm_per_s = 4\nprofile = \"parabolic\"\n") + end("k_max", "type = \"outflow\"\n"),
      "[4.7, 0, 12.9]");
  succeed(folder, {"run", bent, "--out", "bent", "--set", "coupling.slip=false"}, {1, 1});
  const auto curve = report(folder / "bent")["blood"];
  INFO(curve.dump(1));
  CHECK(curve["mean_speed_mm_per_s"].get<double>() == Approx(4).epsilon(0.01));
  CHECK(curve["cell_speed_mm_per_s"].get<double>() / 4 == Approx(5.0 / 3).epsilon(0.06));
  CHECK_THAT(curve["left_out"]["relative_apparent_viscosity"].get<std::string>(), Catch::Contains("bent tube"));
}
