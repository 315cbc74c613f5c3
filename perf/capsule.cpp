// A capsule in shear, beside boundary integrals and small deformations; perf/capsule.py runs the tables.
//   capsule LAW CAPILLARY RATIO A_OVER_H BOX VERTICES KERNEL SLIP STEP UNTIL EVERY    prints t,D,angle
// LAW is neo-hookean or skalak; BOX in radii; KERNEL three-point or four-point; SLIP 0 or 1; STEP, UNTIL and EVERY (between two
// lines) in units of the inverse shear rate.
#include "capsule.hpp"

#include <cstring>

#include "program.hpp"

using namespace corpuscle;

int main(int argc, char** argv) {
  return run_program(argc, argv, 11, "LAW CAPILLARY RATIO A_OVER_H BOX VERTICES KERNEL SLIP STEP UNTIL EVERY", [](int, char** words) {
    scenes::ShearedCapsule capsule;
    capsule.law = std::strcmp(words[1], "skalak") == 0 ? CellSettings::Law::skalak : CellSettings::Law::neo_hookean;
    capsule.capillary = std::atof(words[2]);
    capsule.viscosity_ratio = std::atof(words[3]);
    capsule.cells_per_radius = std::atof(words[4]);
    capsule.box = std::atof(words[5]);
    capsule.vertices = std::atoi(words[6]);
    if (std::strcmp(words[7], "four-point") == 0) capsule.kernel = CouplingSettings::Kernel::four_point;
    capsule.slip = std::atoi(words[8]) != 0;
    capsule.step = std::atof(words[9]);
    const double until = std::atof(words[10]), every = std::atof(words[11]);
    Timers timers;
    Case scene = capsule.scene(until);
    scene.time.first_step_us = scene.time.step_us / 8;  // a flow that starts at once is behind by half a step, and its pressure by some
    FlowSimulation simulation(Comm(), scene, timers);
    double next = every;
    long momentum = 0;
    int steps = 0;
    while (!simulation.done()) {
      simulation.step();
      momentum += simulation.fluid().statistics().momentum_iterations;
      ++steps;
      const double t = simulation.time() * capsule.rate;
      if (t < next - 1e-9 && !simulation.done()) continue;
      next += every;
      const auto shape = scenes::deformation(body_mesh(simulation.surfaces()[0], 0));
      std::printf("%.6g,%.5f,%.2f\n", t, shape.taylor, shape.angle_deg);
      std::fflush(stdout);
    }
    std::printf("# %.2f momentum iterations a step\n", static_cast<double>(momentum) / steps);
  });
}
