// What ranks, and the ends of a period, take over from each other of the search's band.
#include <catch2/catch.hpp>

#include "scenes.hpp"

#include "coupling/periodic_frame.hpp"
#include "immersed/surface.hpp"
#include "immersed/surface_geometry.hpp"

#include <fmt/format.h>

namespace corpuscle {
namespace {

template <class View>
auto on_host(const View& view) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
}

/// Nodes that a rank has, within two layers of the halo: the outermost of its own search misses links beyond it.
template <class Visit>
void for_nodes(const Lattice& lattice, const Visit& visit) {
  int lower[3], upper[3];
  for (int d = 0; d < 3; ++d) {
    lower[d] = std::max(lattice.lower[d], -2);
    upper[d] = std::min(lattice.upper[d], lattice.index.n[d] + 1);
  }
  for (int k = lower[2]; k <= upper[2]; ++k)
    for (int j = lower[1]; j <= upper[1]; ++j)
      for (int i = lower[0]; i <= upper[0]; ++i) visit(lattice.node(i, j, k), lattice.index.owns(i, j, k));
}

}  // namespace

TEST_CASE("the band that others have marked is the one that a rank would mark itself", "[coupling][ranks]") {
  using Type = BoundarySettings::Type;
  const std::array<bool, 3> periodic =
      GENERATE(std::array<bool, 3>{true, true, true}, std::array<bool, 3>{true, false, false}, std::array<bool, 3>{false, false, true},
               std::array<bool, 3>{false, true, true}, std::array<bool, 3>{false, false, false});
  GridSettings box = scenes::cube(8, 16);
  const int longest = GENERATE(0, 1, 2);  // the direction that two ranks cut
  box.nodes[longest] = 25, box.lower_um[longest] = -6, box.upper_um[longest] = 6;
  Grid grid(Comm(), make_node_source(box), periodic);
  std::vector<BodySettings> bodies(3, scenes::sphere(1.3));
  // Across the planes between ranks, one half-way around; across the sides, their edges and corners; near two of the walls.
  bodies[0].center_um = {0.1, 0.2, 0.15};
  for (int d = 0; d < 3; ++d) {
    bodies[1].center_um[d] = periodic[d] ? box.upper_um[d] - 0.3 : -2.1;
    bodies[2].center_um[d] = d == 1 ? -2.1 : (d == longest ? 3.2 : 2.1);
  }
  std::vector<TriangleMesh> meshes;
  for (auto& body : bodies) body.vertices = 200, meshes.push_back(make_body_mesh(body, 0.5));
  const SurfaceSet surfaces = make_surface_set(meshes);
  ImmersedOptions options;
  options.frame = periodic_frame(grid);
  ImmersedBoundary by_itself(grid.views(), surfaces, options);
  options.exchange_band = [&](const BandViews& band) { grid.halo().exchange(band.key), grid.halo().exchange(band.cut); };
  ImmersedBoundary shared(grid.views(), surfaces, options);
  INFO(fmt::format("periodic {} {} {}, longest {}", periodic[0], periodic[1], periodic[2], longest));
  for (int step = 0; step < 2; ++step) {  // the second with what the first has left
    by_itself.classify(), shared.classify();
    const auto key = on_host(by_itself.band().key), other_key = on_host(shared.band().key);
    const auto cut = on_host(by_itself.band().cut), other_cut = on_host(shared.band().cut);
    const auto distance = on_host(by_itself.band().distance), other_distance = on_host(shared.band().distance);
    const auto foot = on_host(by_itself.band().foot), other_foot = on_host(shared.band().foot);
    const unsigned triangles = static_cast<unsigned>(surfaces.triangles);
    int in_band = 0, missed = 0, turned = 0, uncut = 0;
    double farthest = 0;
    for_nodes(shared.lattice(), [&](int c, bool own) {
      missed += (key(c) == no_key) != (other_key(c) == no_key);
      uncut += cut(c) != other_cut(c);
      if (key(c) == no_key || other_key(c) == no_key) return;
      in_band += !own;
      turned += key_item(key(c)) / triangles != key_item(other_key(c)) / triangles;
      farthest = std::max(farthest, std::abs(distance(c) - other_distance(c)));
      farthest = std::max(farthest, norm(load(foot, c) - load(other_foot, c)));
    });
    CHECK(missed == 0);
    CHECK(turned == 0);
    CHECK(uncut == 0);
    CHECK(farthest < 1e-12);  // round-off: of two triangles as near as each other, either may have been taken
    const bool any_shared = grid.comm().size() > 1 || periodic[0] || periodic[1] || periodic[2];
    CHECK((grid.comm().sum(static_cast<long>(in_band)) > 100) == any_shared);
    CHECK(shared.counts().immersed == by_itself.counts().immersed);
    auto x = on_host(surfaces.x);
    for (int v = 0; v < surfaces.vertices; ++v) x(v, 0) += 0.07, x(v, 1) -= 0.11, x(v, 2) += 0.05;
    Kokkos::deep_copy(surfaces.x, x);
    update_surface_geometry(surfaces);
  }
}

}  // namespace corpuscle
