#include "membrane/membrane_viscosity.hpp"

#include <algorithm>
#include <cstdlib>

#include "membrane/interface.hpp"

namespace corpuscle {

MembraneViscosity::MembraneViscosity(bool tangential) : tangential_(tangential) {}

namespace {

auto label(const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); }

std::size_t scratch_numbers(const MembraneViews& m, bool drifting) {
  return 9 * static_cast<std::size_t>(m.triangles) + (drifting ? 22 : 19) * static_cast<std::size_t>(m.vertices);
}

}  // namespace

void MembraneViscosity::make_room(const MembraneViews& m) {
  const bool drifting = given_.data();
  const std::size_t numbers = scratch_numbers(m, drifting);
  if (!scratch_.data() || scratch_.extent(0) < numbers) {
    scratch_ = Array<double>();  // free before taking more
    scratch_ = Array<double>(label("viscous_scratch"), numbers + (drifting ? numbers / 16 : 0));
  }
  divide_scratch(m);
  if (drifting) return;
  views_.right_side = Components<double>(label("right_side_vertex"), m.vertices, 3);
  views_.iterations = Array<int>("corpuscle::membrane::iterations_cell", m.cells);
}

void MembraneViscosity::divide_scratch(const MembraneViews& m) {
  const std::size_t vertices = m.vertices, entries = 3 * static_cast<std::size_t>(m.triangles);
  double* memory = scratch_.data();
  const auto take = [&](std::size_t numbers) {
    double* from = memory;
    memory += numbers;
    return from;
  };
  views_.along = Table<double>(take(3 * entries), entries, 3);
  views_.diagonal = Array<double>(take(vertices), vertices);
  views_.block = Table<double>(take(6 * vertices), vertices, 6);
  for (auto* vectors : {&views_.gradient, &views_.residual, &views_.search, &views_.image})
    *vectors = Components<double>(take(3 * vertices), vertices, 3);
  if (given_.data()) direction_ = Components<double>(take(3 * vertices), vertices, 3);
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

template <class Damping>
void MembraneViscosity::resist_with(const MembraneViews& m, const MotionViews& motion, double beta,
                                    const Components<double>& force) const {
  constexpr double massless = 1e300;  // us: mass over it
  predict_viscous_velocity<Damping>(m, motion, views_, FluidReaction{beta, m.surface.v, given_, force}, massless);
  keep_volume(m, motion);
  subtract_damping<Damping>(m, views_.along, m.surface.v, force, views_.right_side);
  copy_vertices(m.vertices, force, given_);
}

void MembraneViscosity::resist(const MembraneViews& m, const MotionViews& of_membranes, double beta,
                               const Components<double>& force) const {
  MotionViews motion = of_membranes;
  motion.direction = direction_;
  Kokkos::deep_copy(Exec(), direction_, 0.0);  // so that a step depends on the state alone
  if (tangential_)
    resist_with<FullDamping>(m, motion, beta, force);
  else
    resist_with<CentralDamping>(m, motion, beta, force);
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
