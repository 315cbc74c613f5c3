// How much memory a scene takes, and whether it can be had: from the case alone, before anything is built.
#pragma once

#include "input/case.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

/// What the memory of a scene depends on. Counts are numbers of a kind that no case overflows.
struct SceneSize {
  std::array<double, 3> cells{};    // of the whole grid; zero without one
  std::array<double, 3> block{};    // of the largest rank
  std::array<double, 3> spacing{};  // mean, um, along each index direction
  std::array<bool, 3> periodic{}, cut{};
  bool skewed = false;         // the pressure equation needs a matrix
  bool sampled = true;         // skewness and spacing are the grid's; false: of a file that was not read
  double volume = 0;           // um3, about; 0 where the grid was not sampled
  double vertices = 0;         // of all surfaces
  double rigid = 0;            // of them, those of rigid bodies, which every rank has
  double images = 1;           // under which each surface is seen: 3 for every periodic direction
  double pairs = 0;            // of the vertices of a cell, over the types of cells that move with the fluid
  double cells_listed = 0;     // cells of the whole scene
  bool shared = false;         // cells are shared out over ranks: coupling.scheme = "force"
  bool writes_cells = false;   // cells.h5
  double own = 0, copies = 0;  // vertices that a rank holds, of its own cells and of copies of others; all without sharing

  double owned() const { return block[0] * block[1] * block[2]; }
  /// With the halo.
  double padded() const;
};

/// @throws InputError  for a grid that cannot be cut into that many blocks
SceneSize measure_scene(const Case& scene, int ranks);

/// Of the largest rank, MB.
struct MemoryEstimate {
  double program = 0, fields = 0, multigrid = 0, pressure_matrix = 0, surfaces = 0, output = 0;

  double rank() const { return program + fields + multigrid + pressure_matrix + surfaces + output; }
};

/// Within 25 % of the largest resident memory of a run, on the scenes of the tests.
MemoryEstimate estimate_memory(const Case& scene, const SceneSize& size, int ranks);

/// Counts that the program, MPI, hypre or HDF5 hold in 32 bits.
/// @throws InputError  naming the count, its limit and what to do
void require_countable(const SceneSize& size, int ranks);

/// Memory that this process may still take, MB: what the machine has left, or a limit of its control group or process.
double memory_at_hand_mb();

/// Refuse what cannot be counted, or does not fit the memory at hand of a machine that its ranks share. All ranks call.
/// @return the estimate, of the largest rank
/// @throws InputError  on every rank, with the figures
MemoryEstimate require_memory(const Comm& comm, const Case& scene);

/// What the time of a run depends on, beyond how long its set-up takes.
struct RunSize {
  double cells = 0;  // of the grid
  bool skewed = false;
  double vertices = 0;  // of all surfaces
  double membrane_vertices = 0, substeps = 1;
  double steps = 0, cores = 1;
};

/// Of a scene's set-up, s: into meshes, and into the largest stable step of membranes that move with the fluid.
double estimate_set_up_s(const SceneSize& size, int threads);
/// Of all steps, s: within a factor of two or so, of which grid, surfaces and cores account for as much each.
double estimate_steps_s(const RunSize& size);

/// One line of the screen.
std::string memory_text(const MemoryEstimate& estimate, int ranks);

}  // namespace corpuscle
