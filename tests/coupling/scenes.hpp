// Scenes for the tests of coupled runs, built in code.
#pragma once

#include "cells/shared_cells.hpp"
#include "coupling/flow_simulation.hpp"
#include "coupling/restart.hpp"

#include <unistd.h>

#include <cmath>
#include <filesystem>

namespace corpuscle::scenes {

inline std::vector<BoundarySettings> sides(BoundarySettings::Type type) {
  std::vector<BoundarySettings> all(6);
  for (int s = 0; s < 6; ++s) {
    all[s].side = static_cast<BoundarySettings::Side>(s);
    all[s].type = type;
  }
  return all;
}

/// Cubic box of `cells` a side around the origin.
inline GridSettings cube(double side_um, int cells) {
  GridSettings grid;
  grid.nodes = {cells + 1, cells + 1, cells + 1};
  grid.lower_um = {-side_um / 2, -side_um / 2, -side_um / 2};
  grid.upper_um = {side_um / 2, side_um / 2, side_um / 2};
  return grid;
}

/// Box that is periodic along x and z, where a gradient drives the fluid aslant and the upper wall slides; spacing 0.5 um, steps
/// of 15 us, membranes as forces, tight tolerances.
inline Case aslant_flow(double length_um, double end_us) {
  Case scene;
  scene.time = {15, end_us};
  GridSettings grid;
  const int nodes = static_cast<int>(2 * length_um) + 1;
  grid.nodes = {nodes, 9, nodes};
  grid.upper_um = {length_um, 4, length_um};
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.fluid->momentum_tolerance = scene.fluid->divergence_tolerance = 1e-13;
  scene.fluid->pressure_gradient_Pa_per_um = {-2.4, 0, -1.6};
  scene.boundaries = sides(BoundarySettings::Type::periodic);
  scene.boundaries[2].type = BoundarySettings::Type::wall;
  scene.boundaries[3].type = BoundarySettings::Type::moving_wall;
  scene.boundaries[3].velocity = Triple{1e-3, 0, -5e-4};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = CouplingSettings::Scheme::force;
  return scene;
}

/// Sphere whose centre avoids every symmetry of the grid.
inline BodySettings sphere(double radius_um) {
  BodySettings body;
  body.radius_um = radius_um;
  body.center_um = {0.013, 0.021, 0.017};
  return body;
}

/// The paper's tube with one cell on a grid of n x n x nk nodes, Stokes flow.
inline Case tube_with_cell(int n, int nk, double mass_pg, CouplingSettings::Scheme scheme, double end_us) {
  Case scene;
  scene.time = {1, end_us};
  GridSettings grid;
  grid.generator = GridSettings::Generator::straight_tube;
  grid.nodes = {n, n, nk};
  grid.diameter_um = 10;
  grid.length_um = 45;
  scene.grid = grid;
  scene.fluid = FluidSettings{};
  scene.fluid->convection = FluidSettings::Convection::none;
  scene.boundaries = sides(BoundarySettings::Type::wall);
  scene.boundaries[4].type = BoundarySettings::Type::velocity_inlet;
  scene.boundaries[4].speed = 2e-3;
  scene.boundaries[4].ramp_us = 20;
  scene.boundaries[5].type = BoundarySettings::Type::outflow;
  CellSettings cell;
  cell.mass_pg = mass_pg;
  scene.cells = {cell};
  scene.coupling = CouplingSettings{};
  scene.coupling->scheme = scheme;
  return scene;
}

/// Of positions one after the other, the first ones moved by `shift`.
inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b, const Triple& shift = {}) {
  double most = a.size() == b.size() ? 0 : 1e300;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) most = std::max(most, std::abs(a[i] - b[i] + shift[i % 3]));
  return most;
}

/// A file of all ranks together, which no other run of the tests has. Every rank calls.
class SharedFile {
 public:
  explicit SharedFile(const std::string& name) {
    std::string unique = "corpuscle_" + name + "_" + std::to_string(::getpid()) + ".h5";
    Comm().broadcast(unique);
    path_ = std::filesystem::temp_directory_path() / unique;
  }
  ~SharedFile() {
    Comm().barrier();
    if (Comm().root()) std::filesystem::remove(path_);
  }
  SharedFile(const SharedFile&) = delete;
  SharedFile& operator=(const SharedFile&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

#ifdef CORPUSCLE_HDF5
/// Takes both to their end, the second from a checkpoint of the first after so many steps. Every rank that has one calls.
inline void go_on_from_checkpoint(const SharedFile& file, FlowSimulation& whole, FlowSimulation& after, long steps) {
  CheckpointTexts texts;
  texts.resolved = "title = \"a\"\n", texts.totals = "{}";
  while (!whole.done()) {
    whole.step();
    if (whole.steps() != steps) continue;
    write_checkpoint(file.path(), whole, texts);
    read_checkpoint(file.path(), after, texts.resolved, "");
  }
  while (!after.done()) after.step();
}
#endif

/// Calls work(comm) on the first ranks, among themselves. Every rank calls.
template <class Work>
void on_first_ranks(int count, const Work& work) {
#ifdef CORPUSCLE_MPI
  const bool here = Comm().rank() < count;
  MPI_Comm handle;
  MPI_Comm_split(MPI_COMM_WORLD, here ? 0 : 1, Comm().rank(), &handle);
  if (here) work(Comm(handle));
  MPI_Comm_free(&handle);
  Comm().barrier();
#else
  work(Comm());
#endif
}

/// Positions of every cell's vertices, moved on by the periods that it has been moved back, on every rank.
inline std::vector<double> positions(FlowSimulation& simulation) {
  const SharedCells& cells = *simulation.shared_cells();
  std::vector<double> all(3 * cells.total_vertices(), 0.0);
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), cells.surfaces().x);
  int vertex = 0;
  for (const CellRecord& cell : cells.own()) {
    const Triple travelled = cells.wrapped_by(cell);
    const int count = static_cast<int>(cells.membranes().types()[cell.type].mesh.vertices.size());
    for (int i = 0; i < count; ++i, ++vertex)
      for (int d = 0; d < 3; ++d) all[3 * (cell.first_vertex + i) + d] = x(vertex, d) + travelled[d];
  }
  simulation.grid().comm().sum(all.data(), static_cast<int>(all.size()));
  return all;
}

}  // namespace corpuscle::scenes
