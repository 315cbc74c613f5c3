#include "membrane/membrane_viscosity.hpp"

#include <algorithm>
#include <cstdlib>

#include "membrane/interface.hpp"

namespace corpuscle {

MembraneViscosity::MembraneViscosity(bool tangential) : tangential_(tangential) {}

namespace {

auto label(const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); }

std::size_t scratch_numbers(const MembraneViews& m) {
  const std::size_t entries = 3 * static_cast<std::size_t>(m.triangles);
  return entries + (entries + 1) / 2 + 22 * static_cast<std::size_t>(m.vertices);
}

}  // namespace

void MembraneViscosity::make_room(const MembraneViews& m) {
  scratch_ = Array<double>(label("viscous_scratch"), scratch_numbers(m));
  divide_scratch(m, scratch_.data());
  views_.right_side = Components<double>(label("right_side_vertex"), m.vertices, 3);
  views_.iterations = Array<int>("corpuscle::membrane::iterations_cell", m.cells);
}

void MembraneViscosity::divide_scratch(const MembraneViews& m, double* memory) {
  const std::size_t vertices = m.vertices, entries = 3 * static_cast<std::size_t>(m.triangles);
  const auto take = [&](std::size_t numbers) {
    double* from = memory;
    memory += numbers;
    return from;
  };
  views_.inverse_length = Array<double>(take(entries), entries);
  views_.neighbour = Array<int>(reinterpret_cast<int*>(take((entries + 1) / 2)), entries);
  views_.diagonal = Array<double>(take(vertices), vertices);
  views_.block = Table<double>(take(6 * vertices), vertices, 6);
  for (auto* vectors : {&views_.gradient, &views_.residual, &views_.search, &views_.image, &views_.inverse_gradient})
    *vectors = Components<double>(take(3 * vertices), vertices, 3);
}

void MembraneViscosity::force(const MembraneViews& m, const Elasticity& elasticity, const Components<double>& v,
                              const Components<double>& force) const {
  measure_membranes(m, m.surface.x);
  elasticity.evaluate_triangles(m, m.surface.x);
  if (tangential_) {
    assemble_viscous<FullDamping>(m, views_, NoLoad{}, 1);
    dissipative_force<FullDamping>(m, views_, v, force);
  } else {
    assemble_viscous<CentralDamping>(m, views_, NoLoad{}, 1);
    dissipative_force<CentralDamping>(m, views_, v, force);
  }
}

template <class Damping>
void MembraneViscosity::resist_with(const MembraneViews& m, double beta, const Components<double>& force) const {
  constexpr double massless = 1e300;  // us: mass over it
  predict_held_velocity<Damping>(m, views_, FluidReaction{beta, m.surface.v, given_, force}, massless);
  subtract_damping<Damping>(m, views_, m.surface.v, force, views_.right_side);
  copy_vertices(m.vertices, force, given_);
}

void MembraneViscosity::resist(const MembraneViews& m, Workspace& workspace, double beta, const Components<double>& force) {
  divide_scratch(m, workspace.reserve(scratch_numbers(m)));
  if (tangential_)
    resist_with<FullDamping>(m, beta, force);
  else
    resist_with<CentralDamping>(m, beta, force);
}

double MembraneViscosity::dissipation(const MembraneViews& m) const {
  if (given_.data()) return damping_power(m, views_.right_side);  // they move as the fluid does, not quite as D was told
  return tangential_ ? viscous_power<FullDamping>(m) : viscous_power<CentralDamping>(m);
}

int MembraneViscosity::iterations() const {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.iterations);
  int largest = 0;
  for (std::size_t c = 0; c < host.extent(0); ++c) largest = std::max(largest, std::abs(host(c)));
  return largest;
}

}  // namespace corpuscle
