#include "membrane/membrane_viscosity.hpp"

#include <algorithm>
#include <cstdlib>

#include "membrane/elimination_order.hpp"
#include "membrane/interface.hpp"

namespace corpuscle {

MembraneViscosity::MembraneViscosity(bool tangential) : tangential_(tangential) {}

namespace {

auto label(const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); }

}  // namespace

std::size_t MembraneViscosity::scratch_numbers(const MembraneViews& m) const {
  const std::size_t numbers = (given_.data() ? 4 : 1) + 3 + (band_.teams > 0 ? 0 : 6 + 4 * 3);  // of each vertex, as divided below
  std::size_t most = 0;
  for_parts(m, parts_, [&](const MembraneViews& part) {
    const std::size_t entries = 3 * static_cast<std::size_t>(part.triangles);
    most = std::max(most, entries + (entries + 1) / 2 + numbers * static_cast<std::size_t>(part.vertices));
  });
  return most;
}

/// A cell of n vertices takes about n^2 operations in a factorisation, and about as many in conjugate gradients, which take four times
/// as long for 642 vertices; beyond some 2500 the band takes too much memory.
void MembraneViscosity::prepare(const std::vector<CellReference>& types) {
  constexpr bool on_host = Kokkos::SpaceAccessibility<Kokkos::HostSpace, Memory>::accessible;
  constexpr double most_mb = 16, most_together_mb = on_host ? 64 : 512;  // of the matrices at hand
  constexpr int most_teams = on_host ? 128 : 512;
  std::vector<int> first, place;
  std::size_t vertices = 0;
  for (const CellReference& type : types) {
    const EliminationOrder order = elimination_order(type.mesh);
    first.push_back(static_cast<int>(place.size()));
    place.insert(place.end(), order.place.begin(), order.place.end());
    vertices = std::max(vertices, order.place.size());
    band_.width = std::max(band_.width, order.width);
  }
  const std::size_t numbers = 3 * vertices * band_.stride();
  const double mb = 8e-6 * static_cast<double>(numbers);
  if (numbers == 0 || mb > most_mb) return;
  band_.teams = std::min({Exec().concurrency(), most_teams, static_cast<int>(most_together_mb / mb)});
  band_.first_place = Array<int>(label("viscous_first_place"), first.size());
  band_.place = Array<int>(label("viscous_place"), place.size());
  for (const auto& [view, values] : {std::pair{&band_.first_place, &first}, {&band_.place, &place}}) {
    const auto host = Kokkos::create_mirror_view(*view);
    std::copy(values->begin(), values->end(), host.data());
    Kokkos::deep_copy(*view, host);
  }
  band_.column = Table<double>(label("viscous_band"), band_.teams, numbers);
  band_.right_side = Table<double>(label("viscous_right_side"), band_.teams, 6 * vertices);
}

void MembraneViscosity::make_room(const MembraneViews& m) {
  scratch_ = Array<double>(label("viscous_scratch"), scratch_numbers(m));
  divide_scratch(m, scratch_.data());
  views_.right_side = {Components<double>(label("right_side_vertex"), m.vertices, 3)};
  views_.iterations = Array<int>("corpuscle::membrane::iterations_cell", m.cells);
}

void MembraneViscosity::divide_scratch(const MembraneViews& m, double* memory) {
  const std::size_t vertices = m.vertices, entries = 3 * static_cast<std::size_t>(m.triangles);
  const auto take = [&](std::size_t numbers) {
    double* from = memory;
    memory += numbers;
    return from;
  };
  const int first_entry = 3 * m.first_triangle;
  const auto take_vectors = [&] {
    return RowsFrom<Components<double>>{Components<double>(take(3 * vertices), vertices, 3), m.first_vertex};
  };
  views_.inverse_length = {Array<double>(take(entries), entries), first_entry};
  views_.neighbour = {Array<int>(reinterpret_cast<int*>(take((entries + 1) / 2)), entries), first_entry};
  views_.diagonal = {Array<double>(take(vertices), vertices), m.first_vertex};
  views_.gradient = take_vectors();
  if (given_.data()) views_.right_side = take_vectors();
  if (band_.teams > 0) return;
  views_.block = {Table<double>(take(6 * vertices), vertices, 6), m.first_vertex};
  for (auto* vectors : {&views_.residual, &views_.search, &views_.image, &views_.inverse_gradient}) *vectors = take_vectors();
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

template <class Damping, class Taken>
void MembraneViscosity::resist_with(const MembraneViews& m, const FluidReaction& fluid, const Taken& damping) const {
  constexpr double massless = 1e300;  // us: mass over it
  ViscosityViews views = views_;
  views.times = 1 + fluid.share;
  assemble_viscous<Damping>(m, views, fluid, massless);
  if (band_.teams > 0)
    solve_held<Damping>(m, views, band_);
  else
    solve_held<Damping>(m, views);
  subtract_damping<Damping>(m, views_, m.surface.v, fluid.force, damping);
}

template <class Taken>
void MembraneViscosity::resist_with(const MembraneViews& m, const FluidReaction& fluid, const Taken& damping) const {
  if (tangential_)
    resist_with<FullDamping>(m, fluid, damping);
  else
    resist_with<CentralDamping>(m, fluid, damping);
}

void MembraneViscosity::resist(const MembraneViews& m, Workspace& workspace, double beta, double ahead, const Components<double>& force) {
  double* const memory = workspace.reserve(scratch_numbers(m));
  for_parts(m, parts_, [&](const MembraneViews& part) {
    divide_scratch(part, memory);
    resist_with(part, {beta, share_, ahead, m.surface.v, given_, force, past_}, taken_);
  });
  copy_vertices(m.vertices, force, given_);
}

void MembraneViscosity::relieve(const MembraneViews& m, Workspace& workspace, double beta, const StiffnessViews& work) {
  double* const memory = workspace.reserve(scratch_numbers(m));
  MembraneViews at_rest = m;
  at_rest.force = work.mode;
  at_rest.surface.v = work.force_ahead;
  Kokkos::deep_copy(work.force_ahead, 0.0);
  Kokkos::deep_copy(work.force_behind, 0.0);
  for_parts(at_rest, parts_, [&](const MembraneViews& part) {
    divide_scratch(part, memory);
    resist_with(part, {beta, share_, 0, work.force_ahead, work.force_behind, work.mode, work.force_behind}, work.probe);
  });
  Kokkos::deep_copy(taken_, 0.0f);  // nothing has been taken off any force yet
}

template <class Damping>
void MembraneViscosity::damp_with(const MembraneViews& part, const StiffnessViews& work) const {
  assemble_viscous<Damping>(part, views_, FluidReaction{1, 0, 0, work.force_ahead, work.force_behind, work.mode, work.force_behind}, 1);
  damp_mode<Damping>(part, views_, work);
}

void MembraneViscosity::damp(const MembraneViews& m, Workspace& workspace, const StiffnessViews& work) {
  double* const memory = workspace.reserve(scratch_numbers(m));
  Kokkos::deep_copy(work.force_ahead, 0.0);
  Kokkos::deep_copy(work.force_behind, 0.0);
  for_parts(m, parts_, [&](const MembraneViews& part) {
    divide_scratch(part, memory);
    if (tangential_)
      damp_with<FullDamping>(part, work);
    else
      damp_with<CentralDamping>(part, work);
  });
  copy_vertices(m.vertices, work.probe, work.mode);
}

double MembraneViscosity::dissipation(const MembraneViews& m) const {
  if (given_.data()) return damping_power(m, taken_);  // they move as the fluid does, not quite as D was told
  return tangential_ ? viscous_power<FullDamping>(m) : viscous_power<CentralDamping>(m);
}

int MembraneViscosity::iterations() const {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), views_.iterations);
  int largest = 0;
  for (std::size_t c = 0; c < host.extent(0); ++c) largest = std::max(largest, std::abs(host(c)));
  return largest;
}

}  // namespace corpuscle
