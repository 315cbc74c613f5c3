// A capsule in shear, beside boundary integrals and small deformations; perf/capsule.py runs the tables.
//   capsule LAW CAPILLARY RATIO A_OVER_H BOX VERTICES SLIP STEP UNTIL    prints t,D,angle
// LAW is neo-hookean or skalak; BOX in radii; SLIP 0 or 1; STEP and UNTIL in units of the inverse shear rate.
#include "capsule.hpp"

#include <cstring>

#include "program.hpp"

using namespace corpuscle;

int main(int argc, char** argv) {
  return run_program(argc, argv, 9, "LAW CAPILLARY RATIO A_OVER_H BOX VERTICES SLIP STEP UNTIL", [](int, char** words) {
    scenes::ShearedCapsule capsule;
    capsule.law = std::strcmp(words[1], "skalak") == 0 ? CellSettings::Law::skalak : CellSettings::Law::neo_hookean;
    capsule.capillary = std::atof(words[2]);
    capsule.viscosity_ratio = std::atof(words[3]);
    capsule.cells_per_radius = std::atof(words[4]);
    capsule.box = std::atof(words[5]);
    capsule.vertices = std::atoi(words[6]);
    capsule.slip = std::atoi(words[7]) != 0;
    capsule.step = std::atof(words[8]);
    const double until = std::atof(words[9]);
    Timers timers;
    FlowSimulation simulation(Comm(), capsule.scene(until), timers);
    double next = 0.5 * std::min(until, 1.0);
    const double every = next;
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
      std::printf("%.4g,%.5f,%.2f\n", t, shape.taylor, shape.angle_deg);
      std::fflush(stdout);
    }
    std::printf("# %.2f momentum iterations a step\n", static_cast<double>(momentum) / steps);
  });
}
