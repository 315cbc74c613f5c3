// A program of one's own on top of corpuscle: a membrane law that case files do not know, a step loop, and a table of results.
//
//   own_law CASE.toml HARDENING TABLE.csv
//
// The case has one cell of law = "neo-hookean", which then has the Yeoh law with the same shear modulus: it hardens with strain.
#include <Kokkos_Core.hpp>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "core/error.hpp"
#include "coupling/flow_simulation.hpp"
#include "input/case_file.hpp"
#include "membrane/membranes.hpp"

using namespace corpuscle;

namespace {

/// W = G/2 (I + c I^2) with I = a^2 + b^2 + 1 / (a b)^2 - 3 (Yeoh, Rubber Chem. Technol. 66, 1993, to second order): neo-Hookean
/// for c = 0. Per area at rest, of the principal stretches a and b; `trace` is a^2 + b^2, `ratio` a b.
struct YeohSheet {
  static constexpr double limit = 10;  // of the larger stretch, at which a step is refused

  double shear_modulus = 0;  // G, nN/um
  double hardening = 0;      // c

  KOKKOS_INLINE_FUNCTION EnergyDensity density(double trace, double ratio) const {
    const double g = 0.5 * shear_modulus, inverse = 1 / ratio, i = trace + inverse * inverse - 3, slope = 1 + 2 * hardening * i;
    return {g * i * (1 + hardening * i), g * slope, -2 * g * slope * inverse * inverse * inverse};
  }
  /// How many times as stiff as at rest, about: sub-steps of a membrane with a mass go by it.
  KOKKOS_INLINE_FUNCTION double stiffening(double trace, double ratio) const {
    const double square = ratio * ratio, i = trace + 1 / square - 3;
    return 0.125 * (2 + 3 * trace / (square * square)) * (1 + 6 * hardening * i);
  }
};
using Yeoh = TriangleLaw<YeohSheet>;

/// For the cells of all types, each with its own shear modulus.
std::unique_ptr<Elasticity> yeoh(double hardening, const std::vector<CellReference>& types, const std::vector<int>& type_of_cell) {
  Array<Yeoh> laws("own_law::laws", types.size());
  const auto host = Kokkos::create_mirror_view(laws);
  for (std::size_t t = 0; t < types.size(); ++t)
    host(t) = Yeoh{{std::get<NeoHookean>(types[t].in_plane).material.shear_modulus, hardening}};
  Kokkos::deep_copy(laws, host);
  return std::make_unique<ElasticityOf<Yeoh, AllCells>>(laws, AllCells{static_cast<int>(type_of_cell.size())});
}

void run(const char* path, double hardening, const char* table) {
  const Case scene = read_case(path);
  Timers timers(false);
  FlowSimulation simulation(Comm(), scene, timers);
  Membranes& membranes = *simulation.membranes();
  membranes.take_law([=](const auto& types, const auto& type_of_cell) { return yeoh(hardening, types, type_of_cell); });
  std::FILE* const file = std::fopen(table, "w");
  if (!file) throw InputError(std::string(table) + ": cannot be written");
  std::fprintf(file, "time_us,length_um,energy_fJ\n");
  while (!simulation.done()) {
    simulation.step();
    const CellDiagnostics cell = membranes.diagnostics().at(0);
    const Triple extent = cell.extent_um();
    std::fprintf(file, "%g,%.12g,%.12g\n", simulation.time(), extent[0], cell.energy_fJ());
  }
  std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s CASE.toml HARDENING TABLE.csv\n", argv[0]);
    return 2;
  }
#ifdef CORPUSCLE_MPI
  MPI_Init(&argc, &argv);
#endif
  Kokkos::initialize(argc, argv);
  int code = 0;
  try {
    run(argv[1], std::atof(argv[2]), argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "own_law: %s\n", error.what());
    code = 3;
  }
  Kokkos::finalize();
#ifdef CORPUSCLE_MPI
  MPI_Finalize();
#endif
  return code;
}
