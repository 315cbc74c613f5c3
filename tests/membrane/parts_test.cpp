// Many cells are dealt with in parts, for the memory: a cell must not see which one it is in.
#include "membrane/membrane_viscosity.hpp"
#include "membrane_fixture.hpp"

using namespace corpuscle;
using namespace corpuscle::testing;

namespace {

/// The force of a cell, what is left of it once its viscosity has resisted in two steps, and its velocity then.
struct Answer {
  std::vector<Vec3> force, given, velocity;
};

/// Of each cell. @param x, v  [cell][vertex]
std::vector<Answer> answers(const std::vector<CellReference>& types, const std::vector<HeldCell>& cells,
                            const std::vector<std::vector<Vec3>>& x, const std::vector<std::vector<Vec3>>& v) {
  Membranes m(types, std::make_shared<Workspace>());
  m.hold(cells, static_cast<int>(cells.size()));
  std::vector<Vec3> all_x, all_v;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    all_x.insert(all_x.end(), x[c].begin(), x[c].end());
    all_v.insert(all_v.end(), v[c].begin(), v[c].end());
  }
  to_device(all_x, m.surfaces().x);
  m.take_share_of_resistance(1e-3);
  std::vector<Vec3> force;
  for (int step = 0; step < 2; ++step) {
    to_device(all_v, m.surfaces().v);
    m.compute_forces();
    force = to_host(m.views().force, m.vertices());
    m.resist(0.7, 0.9, m.views().force);
    m.forget_geometry();
  }
  const auto given = to_host(m.views().force, m.vertices()), velocity = to_host(m.surfaces().v, m.vertices());
  std::vector<Answer> of_cells;
  auto at = std::size_t(0);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const auto part = [&](const std::vector<Vec3>& values) {
      return std::vector<Vec3>(values.begin() + at, values.begin() + at + x[c].size());
    };
    of_cells.push_back({part(force), part(given), part(velocity)});
    at += x[c].size();
  }
  return of_cells;
}

double difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, norm(a[i] - b[i])), size = std::max(size, norm(b[i]));
  return most / size;
}

}  // namespace

TEST_CASE("a cell has the same forces and the same viscosity whichever others are held with it", "[membrane][parts]") {
  const bool of_one_law = GENERATE(true, false);
  const bool factorised = GENERATE(true, false);
  // Of different sizes, so that parts begin nowhere in particular; with 3000 vertices a membrane's matrix is too large.
  std::vector<CellSettings> settings{cell_settings(200), cell_settings(260)};
  for (CellSettings& cell : settings) cell.membrane_viscosity_N_s_per_m = 5e-7;
  if (!of_one_law) settings[1].law = CellSettings::Law::skalak;
  if (!factorised) settings.push_back(settings[0]), settings.back().vertices = 3000;
  const auto types = find_cell_types(settings).references;
  const int parts = 3, count = parts * std::max(16, 8 * std::min(Exec().concurrency(), 128)) + 5;
  Noise noise;
  std::vector<HeldCell> cells;
  std::vector<std::vector<Vec3>> x, v;
  for (int c = 0; c < count; ++c) {
    const int type = c % 3 == 1 ? 1 : 0;
    cells.push_back({type, c});
    std::vector<Vec3> places, velocities;
    for (const Triple& p : types[type].mesh.vertices) {
      places.push_back(Vec3{p[0], p[1], p[2]} + 0.02 * noise.vec());
      velocities.push_back(1e-3 * noise.vec());
    }
    // One that is squeezed to a fifth of its area: what it and its neighbours have at rest is asked for across cells.
    const auto [a, b, apex] = types[type].mesh.triangles[7];
    places[apex] = places[apex] - 0.8 * (places[apex] - 0.5 * (places[a] + places[b]));
    x.push_back(places), v.push_back(velocities);
  }
  const auto together = answers(types, cells, x, v);
  double force = 0, given = 0, velocity = 0;
  for (int c = 0; c < count; c += 7) {
    const Answer alone = answers(types, {cells[c]}, {x[c]}, {v[c]})[0];
    force = std::max(force, difference(together[c].force, alone.force));
    given = std::max(given, difference(together[c].given, alone.given));
    velocity = std::max(velocity, difference(together[c].velocity, alone.velocity));
  }
  INFO("of the largest: forces " << force << ", what is left of them " << given << ", velocities " << velocity);
  // Round-off, of compilers that add up in another order where arrays begin elsewhere; the solvers' matrices are stiff.
  CHECK(force < 1e-13);
  CHECK(given < (factorised ? 1e-10 : 1e-6));
  CHECK(velocity < (factorised ? 1e-10 : 1e-6));
}
