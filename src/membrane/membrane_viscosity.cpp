#include "membrane/membrane_viscosity.hpp"

#include <algorithm>
#include <cstdlib>

namespace corpuscle {

MembraneViscosity::MembraneViscosity(const MembraneViews& m, bool tangential) : tangential_(tangential) {
  const auto label = [](const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); };
  const int entries = 3 * m.triangles;
  views_.along = Table<double>(label("along_ring"), entries, 3);
  views_.diagonal = Array<double>(label("diagonal_vertex"), m.vertices);
  views_.block = Table<double>(label("block_vertex"), m.vertices, 6);
  views_.right_side = Components<double>(label("right_side_vertex"), m.vertices, 3);
  views_.gradient = Components<double>(label("gradient_vertex"), m.vertices, 3);
  views_.residual = Components<double>(label("residual_vertex"), m.vertices, 3);
  views_.search = Components<double>(label("search_vertex"), m.vertices, 3);
  views_.image = Components<double>(label("image_vertex"), m.vertices, 3);
  views_.iterations = Array<int>("corpuscle::membrane::iterations_cell", m.cells);
}

void MembraneViscosity::force(const MembraneViews& m, const Elasticity& elasticity, const Components<double>& v,
                              const Components<double>& force) const {
  measure_membranes(m, m.surface.x);
  elasticity.evaluate_triangles(m, m.surface.x);
  if (tangential_) {
    assemble_viscous<FullDamping>(m, views_, NoLoad{}, 1);
    dissipative_force<FullDamping>(m, v, views_.along, force);
  } else {
    assemble_viscous<CentralDamping>(m, views_, NoLoad{}, 1);
    dissipative_force<CentralDamping>(m, v, views_.along, force);
  }
}

void MembraneViscosity::remember_forces(const MembraneViews& m, const Components<double>& force) {
  if (!last_force_.data()) last_force_ = Components<double>(uninitialised("corpuscle::membrane::last_force_vertex"), m.vertices, 3);
  Kokkos::deep_copy(Exec(), last_force_, force);
}

template <class Damping>
void MembraneViscosity::resist_with(const MembraneViews& m, const MotionViews& motion, double beta,
                                    const Components<double>& force) const {
  constexpr double massless = 1e300;  // us: mass over it
  predict_viscous_velocity<Damping>(m, motion, views_, FluidReaction{beta, m.surface.v, last_force_, force}, massless);
  keep_volume(m, motion);
  subtract_damping<Damping>(m, views_.along, m.surface.v, force, last_force_);
}

void MembraneViscosity::resist(const MembraneViews& m, const MotionViews& motion, double beta,
                               const Components<double>& force) const {
  if (tangential_)
    resist_with<FullDamping>(m, motion, beta, force);
  else
    resist_with<CentralDamping>(m, motion, beta, force);
}

double MembraneViscosity::dissipation(const MembraneViews& m) const {
  if (last_force_.data()) return damping_power(m, last_force_);  // they move as the fluid does, not quite as D was told
  return tangential_ ? viscous_power<FullDamping>(m) : viscous_power<CentralDamping>(m);
}

int MembraneViscosity::iterations() const {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.iterations);
  int largest = 0;
  for (std::size_t c = 0; c < host.extent(0); ++c) largest = std::max(largest, std::abs(host(c)));
  return largest;
}

}  // namespace corpuscle
