// Which nodes are fluid, immersed and inside.
#include <catch2/catch.hpp>

#include "brute_force.hpp"

using namespace corpuscle;
using namespace scene;

namespace {

ImmersedOptions plain() { return {}; }

struct Findings {
  int wrong_side = 0, leaks = 0, stray = 0, wrong_distance = 0, lonely = 0, band = 0;
};

/// Compare every owned node and link with brute force.
Findings inspect(const GridViews& grid, const ImmersedBoundary& ib, const Soup& soup) {
  Findings found;
  const IndexSpace& index = grid.index;
  const auto x = on_host(grid.x), foot = on_host(ib.band().foot);
  const auto kind = on_host(ib.nodes().kind);
  const auto key = on_host(ib.band().key);
  const auto distance = on_host(ib.band().distance);
  for (int c = 0; c < index.size(); ++c) {
    int i[3];
    index.unpack(c, i[0], i[1], i[2]);
    if (!index.owns(i[0], i[1], i[2])) continue;
    const Vec3 p = load(x, c);
    found.wrong_side += soup.inside(p) != (kind(c) == NodeKind::inside);
    if (key(c) != no_key) {
      ++found.band;
      // The search ranks distances in single precision.
      const double exact = soup.distance(p);
      found.wrong_distance += std::fabs(std::fabs(distance(c)) - exact) > 1e-6 * (1 + exact);
      found.wrong_distance += std::fabs(norm(p - load(foot, c)) - std::fabs(distance(c))) > 1e-12;
    }
    int fluid_neighbours = 0, crossed = 0;
    for (int side = 0; side < 6; ++side) {
      const int n = c + (side % 2 ? 1 : -1) * index.stride(side / 2);
      fluid_neighbours += kind(n) == NodeKind::fluid;
      crossed += soup.crossings(p, load(x, n)) > 0;
    }
    found.leaks += kind(c) == NodeKind::fluid && crossed > 0;
    found.lonely += kind(c) == NodeKind::fluid && fluid_neighbours == 0;
    found.stray += kind(c) == NodeKind::immersed && crossed == 0 && fluid_neighbours > 0;
  }
  return found;
}

void check_scene(const GridViews& grid, const SurfaceSet& surface) {
  ImmersedBoundary ib(grid, surface, plain());
  ib.classify();
  const Findings found = inspect(grid, ib, Soup(surface));
  CHECK(found.wrong_side == 0);
  CHECK(found.leaks == 0);
  CHECK(found.lonely == 0);
  CHECK(found.stray == 0);
  CHECK(found.wrong_distance == 0);
  CHECK(found.band > ib.counts().immersed);
  CHECK(ib.counts().owned_vertices == surface.vertices);
  CHECK(ib.counts().lost_vertex == -1);
  CHECK(ib.counts().crossed_links == 0);
}

int crossed_links(const GridViews& grid, const SurfaceSet& surface) {
  ImmersedBoundary ib(grid, surface, plain());
  ib.classify();
  const auto& counts = ib.counts();
  CHECK((counts.crossed_node >= 0) == (counts.crossed_links > 0));
  return counts.crossed_links;
}

}  // namespace

TEST_CASE("classification of a biconcave cell agrees with brute force") {
  const double tilt = GENERATE(0.0, 0.6);
  SECTION("isotropic") {
    check_scene(make_grid({{22, 22, 14}}, uniform({-4.95, -4.95, -3.15}, {0.45, 0.45, 0.45})),
                make_surface_set({biconcave(3, {0.02, 0.01, -0.03}, tilt * 0.3)}));
  }
  SECTION("anisotropic, thin side across the coarse direction") {
    check_scene(make_grid({{30, 30, 14}}, uniform({-4.65, -4.65, -6.3}, {0.31, 0.31, 0.9})),
                make_surface_set({biconcave(3, {0.02, 0.01, 0.45 - 0.03}, tilt)}));
  }
  SECTION("skewed") {
    check_scene(make_grid({{36, 36, 16}}, skewed({-7.25, -4.7, -8.6}, {0.31, 0.31, 0.9})),
                make_surface_set({biconcave(3, {0.02, 0.01, -0.03}, tilt)}));
  }
  SECTION("wavy") {
    check_scene(make_grid({{32, 32, 16}}, wavy({-5.0, -5.0, -7.2}, {0.31, 0.31, 0.9})),
                make_surface_set({biconcave(3, {0.02, 0.01, -0.03}, tilt)}));
  }
}

TEST_CASE("a film thinner than the grid separates its two sides") {
  // The dimple, 0.81 um thick, between two layers of nodes 1.2 um apart: its middle holds no inside node.
  const GridViews grid = make_grid({{24, 24, 10}}, uniform({-4.8, -4.8, -6.0}, {0.4, 0.4, 1.2}));
  const SurfaceSet surface = make_surface_set({biconcave(3, {0.013, 0.017, 0})});
  ImmersedBoundary ib(grid, surface, plain());
  ib.classify();
  const auto kind = on_host(ib.nodes().kind);
  CHECK(kind(grid.index.cell(12, 12, 4)) == NodeKind::immersed);
  CHECK(kind(grid.index.cell(12, 12, 5)) == NodeKind::immersed);
  const Findings found = inspect(grid, ib, Soup(surface));
  CHECK(found.leaks == 0);
  CHECK(found.wrong_side == 0);
  CHECK(ib.counts().cut_links > 0);
}

TEST_CASE("nodes on the surface and surfaces aligned with the grid are no exception") {
  // Vertices, edges and poles of the sphere fall exactly on nodes and grid planes.
  const GridViews grid = make_grid({{17, 17, 17}}, uniform({-4.25, -4.25, -4.25}, {0.5, 0.5, 0.5}));
  const SurfaceSet surface = make_surface_set({sphere(2, 2.0, {0, 0, 0})});
  ImmersedBoundary ib(grid, surface, plain());
  ib.classify();
  const auto kind = on_host(ib.nodes().kind);
  const auto x = on_host(grid.x);
  const Soup soup(surface);
  for (int k = 0; k < 17; ++k) {
    for (int j = 0; j < 17; ++j) {
      for (int i = 0; i < 17; ++i) {
        const int c = grid.index.cell(i, j, k);
        const double r = norm(load(x, c));
        // Chords of the level-2 sphere come as near as 0.95 radii to the centre.
        if (r < 0.95 * 2.0 - 1e-9) REQUIRE(kind(c) == NodeKind::inside);
        if (r > 2.0 + 0.5 + 1e-9) REQUIRE(kind(c) == NodeKind::fluid);
        for (int d = 0; d < 3; ++d) {
          const int n = c + grid.index.stride(d);
          if (kind(c) == NodeKind::fluid && kind(n) == NodeKind::fluid) {
            REQUIRE(soup.crossings(load(x, c), load(x, n)) == 0);
          }
          REQUIRE_FALSE((kind(c) == NodeKind::fluid && kind(n) == NodeKind::inside));
          REQUIRE_FALSE((kind(c) == NodeKind::inside && kind(n) == NodeKind::fluid));
        }
      }
    }
  }
  CHECK(ib.counts().crossed_links == 0);
}

TEST_CASE("surfaces that cross are noticed, and where") {
  const GridViews grid = make_grid({{30, 24, 24}}, wavy({-4.35, -3.35, -3.35}, {0.3, 0.28, 0.28}));
  const auto spheres = [](double radius, double distance) {
    return make_surface_set({sphere(3, 1.5, {-1.01, 0.02, 0.03}), sphere(3, radius, {-1.01 + distance, 0.02, 0.03})});
  };
  CHECK(crossed_links(grid, spheres(1.2, 2.75)) == 0);
  CHECK(crossed_links(grid, spheres(1.2, 2.4)) > 0);
  CHECK(crossed_links(grid, spheres(1.2, 1.0)) > 0);
  CHECK(crossed_links(grid, spheres(0.6, 0.1)) > 0);  // one wholly inside the other

  ImmersedBoundary ib(grid, spheres(1.2, 2.4), plain());
  ib.classify();
  const NearBodies near = ib.bodies_near(ib.counts().crossed_node);
  CHECK(std::min(near.body, near.other) == 0);
  CHECK(std::max(near.body, near.other) == 1);
  CHECK(near.at.x == Approx(0.45).margin(0.6));  // the lens spans 0.19 to 0.49 um; a node beside it, spacing 0.3 um

  // A dent pushed in until it comes out at the other end.
  const auto dented = [](double depth) {
    TriangleMesh mesh = sphere(4, 1.5, {0.01, 0.02, 0.03});
    for (auto& v : mesh.vertices) {
      if (v[0] > 0.75) v[0] -= depth * (v[0] - 0.75);
    }
    return make_surface_set({mesh});
  };
  CHECK(crossed_links(grid, dented(3.0)) == 0);
  CHECK(crossed_links(grid, dented(5.0)) > 0);
}

TEST_CASE("the least gap between two bodies is counted in spacings") {
  const int direction = GENERATE(0, 2);
  const double spacings = GENERATE(0.1, 0.5, 0.95);
  const Vec3 h{0.3, 0.25, 0.45}, centre{0.03, 0.02, 0.04};
  const double radius = 1.1, gap = spacings * h[direction];
  Block block{{30, 30, 20}};
  Vec3 other = centre;
  other[direction] += 2 * radius + gap;
  SECTION("of two bodies") {
    const GridViews grid = make_grid(block, uniform({-2.5, -2.5, -2.5}, h));
    ImmersedBoundary ib(grid, make_surface_set({sphere(4, radius, centre), sphere(4, radius, other)}), plain());
    ib.classify();
    CHECK(ib.counts().body_spacings >= spacings - 1e-6);
    // The surface points compared lie up to half a spacing beside the poles, where the spheres have receded by 0.03 um.
    CHECK(ib.counts().body_spacings == Approx(spacings).margin(0.1));
    CHECK(ib.bodies_near(ib.counts().gap_node).at[direction] == Approx(centre[direction] + radius).margin(1.5 * h[direction]));
  }
  SECTION("of a body and its image") {
    block.periodic[direction] = true;
    Vec3 spacing = h;
    spacing[direction] = (2 * radius + gap) / block.global[direction];
    const GridViews grid = make_grid(block, uniform({-2.5, -2.5, -2.5}, spacing));
    ImmersedOptions options;
    options.frame.period[direction][direction] = 2 * radius + gap;
    ImmersedBoundary ib(grid, make_surface_set({sphere(4, radius, centre)}), options);
    ib.classify();
    CHECK(ib.counts().body_spacings == Approx(gap / spacing[direction]).margin(0.3));  // the same, spacing 0.07 to 0.13 um
  }
  SECTION("where there is none") {
    const GridViews grid = make_grid(block, uniform({-2.5, -2.5, -2.5}, h));
    ImmersedBoundary ib(grid, make_surface_set({sphere(4, radius, centre)}), plain());
    ib.classify();
    CHECK(ib.counts().body_spacings == 1e30);
  }
}

TEST_CASE("a cell that creeps through the grid is classified like one put there afresh") {
  const GridViews grid = make_grid({{30, 30, 14}}, uniform({-4.65, -4.65, -6.3}, {0.31, 0.31, 0.9}));
  const SurfaceSet moving = make_surface_set({biconcave(3, {0, 0, -0.9}, 0.3)});
  ImmersedBoundary ib(grid, moving, plain());
  const Vec3 step{0.03, -0.02, 0.11};
  for (int n = 0; n < 12; ++n) {
    ib.classify();
    ImmersedBoundary fresh(grid, moving, plain());
    fresh.classify();
    const auto kind = on_host(ib.nodes().kind), expected = on_host(fresh.nodes().kind);
    const auto body = on_host(ib.nodes().body), expected_body = on_host(fresh.nodes().body);
    for (int c = 0; c < grid.index.size(); ++c) {
      REQUIRE(kind(c) == expected(c));
      REQUIRE(body(c) == expected_body(c));
    }
    REQUIRE(ib.counts().immersed == fresh.counts().immersed);
    REQUIRE(ib.counts().uncovered == 0);  // a step is a tenth of a node: no node jumps over the immersed layer
    move(moving, step);
  }
}

TEST_CASE("blocks of a decomposed grid agree with the whole, each vertex owned once") {
  const Mapping mapping = wavy({-5.0, -5.0, -7.2}, {0.31, 0.31, 0.9});
  const std::array<int, 3> n{32, 32, 16};
  const SurfaceSet surface = make_surface_set({biconcave(3, {0.3, 0.01, -0.03}, 0.5), sphere(2, 1.0, {0, 0, 4.5})});
  const GridViews grid = make_grid({n}, mapping);
  ImmersedBoundary whole(grid, surface, plain());
  whole.classify();
  whole.build_stencils();
  const auto kind = on_host(whole.nodes().kind);
  std::vector<int> owners(surface.vertices, 0);
  int faces = 0, immersed = 0;
  for (int part = 0; part < 8; ++part) {
    Block block{n};
    for (int d = 0; d < 3; ++d) {
      const int half = n[d] / 2 - 1;
      block.first[d] = (part >> d) & 1 ? half : 0;
      block.n[d] = (part >> d) & 1 ? n[d] - half : half;
    }
    const GridViews piece = make_grid(block, mapping);
    ImmersedBoundary ib(piece, surface, plain());
    ib.classify();
    ib.build_stencils();
    const auto piece_kind = on_host(ib.nodes().kind);
    for (int k = -1; k <= piece.index.n[2]; ++k) {
      for (int j = -1; j <= piece.index.n[1]; ++j) {
        for (int i = -1; i <= piece.index.n[0]; ++i) {
          REQUIRE(piece_kind(piece.index.cell(i, j, k)) ==
                  kind(grid.index.cell(i + block.first[0], j + block.first[1], k + block.first[2])));
        }
      }
    }
    const std::vector<char> owned = ib.owned_vertices();
    for (int v = 0; v < surface.vertices; ++v) owners[v] += owned[v];
    faces += ib.counts().faces;
    immersed += ib.counts().immersed;
  }
  for (int v = 0; v < surface.vertices; ++v) REQUIRE(owners[v] == 1);
  CHECK(faces == whole.counts().faces);
  CHECK(immersed == whole.counts().immersed);
}

TEST_CASE("a block that lies wholly inside a body knows it") {
  const Block block{{40, 40, 40}, {18, 18, 18}, {4, 4, 4}};
  const GridViews piece = make_grid(block, uniform({-4, -4, -4}, {0.2, 0.2, 0.2}));
  ImmersedBoundary ib(piece, make_surface_set({sphere(3, 3.0, {0, 0, 0})}), plain());
  ib.classify();
  CHECK(ib.counts().inside == 64);
  CHECK(ib.counts().fluid == 0);
}

TEST_CASE("a body across a periodic boundary is seen from both ends") {
  const int cells = 20;
  const double h = 0.3, period = cells * h;
  Block block{{20, 20, cells}};
  block.periodic = {false, false, true};
  const GridViews grid = make_grid(block, uniform({-3, -3, 0}, {h, h, h}));
  ImmersedOptions options;
  options.frame.period[2] = {0, 0, period};
  const SurfaceSet across = make_surface_set({sphere(3, 1.5, {0.02, 0.03, 0.1})});
  const SurfaceSet centred = make_surface_set({sphere(3, 1.5, {0.02, 0.03, 0.1 + 10 * h})});
  ImmersedBoundary ib(grid, across, options), reference(grid, centred, options);
  ib.classify();
  reference.classify();
  ib.find_faces();
  reference.find_faces();
  CHECK(ib.counts().owned_vertices == across.vertices);
  CHECK(ib.counts().immersed == reference.counts().immersed);
  // Faces at the periodic side are stored at both its ends, and listed twice, so that both copies get the same flux.
  const auto counted = on_host(ib.faces().counted), direction = on_host(ib.faces().direction);
  const auto cell = on_host(ib.faces().cell);
  int all = 0;
  std::map<int, int> at_seam;  // place in the plane -> copies
  for (int n = 0; n < ib.counts().faces; ++n) {
    all += counted(n);
    int i[3];
    grid.index.unpack(cell(n), i[0], i[1], i[2]);
    if (direction(n) == 2 && (i[2] == 0 || i[2] == cells)) ++at_seam[i[0] + 100 * i[1]];
  }
  CHECK(all == reference.counts().faces);
  CHECK(ib.counts().faces == all + static_cast<int>(at_seam.size()));
  REQUIRE(!at_seam.empty());
  for (const auto& [place, copies] : at_seam) CHECK(copies == 2);
  CHECK(ib.smallest_spacing() == Approx(h).epsilon(1e-12));
  const auto kind = on_host(ib.nodes().kind), expected = on_host(reference.nodes().kind);
  for (int k = 0; k < cells; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) {
        REQUIRE(kind(grid.index.cell(i, j, k)) == expected(grid.index.cell(i, j, (k + 10) % cells)));
      }
    }
  }
}

TEST_CASE("vertices beyond a boundary and close to a wall are reported") {
  const GridViews grid = make_grid({{20, 20, 20}}, uniform({-2, -2, -2}, {0.2, 0.2, 0.2}));
  const SurfaceSet surface = make_surface_set({sphere(2, 0.5, {0, 0, 0}), sphere(2, 0.6, {1.1, 0.01, 0})});
  ImmersedOptions options;
  options.guarded = {false, true, true, true, false, false};
  ImmersedBoundary ib(grid, surface, options);
  ib.classify();
  CHECK(ib.counts().lost_vertex == -1);
  // The rightmost vertex sits at x = 1.7, 0.3 um or 1.5 spacings from the wall at x = 2; one node of slack for a
  // vertex of the mesh that is not exactly at the pole.
  CHECK(ib.counts().wall_spacings == Approx(1.5).margin(0.1));
  CHECK(ib.counts().wall_vertex >= 162);
  move(surface, {0.5, 0, 0});
  ib.classify();
  REQUIRE(ib.counts().lost_vertex >= 162);
  CHECK(ib.counts().owned_vertices < surface.vertices);
  CHECK(ib.describe_vertex(ib.counts().lost_vertex).find("bodies.1, vertex ") == 0);
}

TEST_CASE("faces lie between fluid and immersed nodes, once each, sorted by body") {
  const GridViews grid = make_grid({{30, 24, 14}}, uniform({-4.65, -4.65, -6.3}, {0.31, 0.38, 0.9}));
  const SurfaceSet surface = make_surface_set({biconcave(3, {0.02, 0.01, -1.5}, 0.2), sphere(2, 1.2, {0, 0, 3.1})});
  ImmersedBoundary ib(grid, surface, plain());
  ib.classify();
  ib.find_faces();
  const auto kind = on_host(ib.nodes().kind);
  const auto body = on_host(ib.nodes().body);
  const FaceViews& f = ib.faces();
  const auto start = on_host(f.start), cell = on_host(f.cell), owner = on_host(f.body);
  const auto direction = on_host(f.direction), sign = on_host(f.sign);
  int expected = 0;
  for (int c = 0; c < grid.index.size(); ++c) {
    if (kind(c) != NodeKind::fluid) continue;
    for (int d = 0; d < 3; ++d) {
      expected += (kind(c - grid.index.stride(d)) == NodeKind::immersed) + (kind(c + grid.index.stride(d)) == NodeKind::immersed);
    }
  }
  REQUIRE(ib.counts().faces == expected);
  REQUIRE(start(2) == expected);
  std::map<std::pair<int, int>, int> seen;
  for (int b = 0; b < 2; ++b) {
    CHECK(start(b + 1) > start(b));
    for (int e = start(b); e < start(b + 1); ++e) {
      const int high = cell(e), low = high - grid.index.stride(direction(e));
      const int fluid = sign(e) > 0 ? high : low, immersed = sign(e) > 0 ? low : high;
      REQUIRE(kind(fluid) == NodeKind::fluid);
      REQUIRE(kind(immersed) == NodeKind::immersed);
      REQUIRE(body(immersed) == b);
      REQUIRE(owner(e) == b);
      REQUIRE(++seen[{high, direction(e)}] == 1);
    }
  }
}

TEST_CASE("a winding corridor is reached to its end, and what lies behind a wall is not", "[immersed]") {
  IndexSpace index;
  for (int d = 0; d < 3; ++d) index.n[d] = index.global[d] = 9;
  const int size = index.size();
  const NodeViews nodes{Array<NodeKind>("corpuscle::test::kind", size), Array<int>("corpuscle::test::body", size)};
  BandViews band;
  band.key = Array<Key>("corpuscle::test::key", size);
  const Array<std::int8_t> reached("corpuscle::test::reached", size);
  // In the plane k = 4, open at i = 0 and winding between j = 1 and 7: each turn takes a round of its own. A closed piece at its
  // end.
  const auto kind = nodes.kind;
  for_owned(
      "corpuscle::test::walls", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const bool turn = (i % 4 == 1 && j == 7) || (i % 4 == 3 && j == 1);
        const bool corridor = k == 4 && j >= 1 && j <= 7 && i <= 6 && (i % 2 == 0 || turn);
        const bool behind = k == 4 && i == 8 && j == 4;
        kind(index.cell(i, j, k)) = corridor || behind ? NodeKind::fluid : NodeKind::immersed;
      });
  NodeBox box;
  for (int d = 0; d < 3; ++d) box.lower[d] = 0, box.upper[d] = 8;
  OpenFaces faces;
  for (int d = 0; d < 3; ++d) faces.open[d][0] = faces.open[d][1] = false;
  faces.open[0][0] = true;
  seed_open_fluid(index, box, faces, band, nodes, reached);
  CHECK(reach_all(index, box, nodes, reached) == 1);
  const auto found = on_host(reached);
  CHECK(found(index.cell(6, 7, 4)) == 1);
  CHECK(found(index.cell(8, 4, 4)) == 0);
}

TEST_CASE("a pocket of fluid that bodies close in becomes immersed, and open fluid does not", "[immersed]") {
  IndexSpace index;
  for (int d = 0; d < 3; ++d) index.n[d] = index.global[d] = 9;
  const int size = index.size();
  const NodeViews nodes{Array<NodeKind>("corpuscle::test::kind", size), Array<int>("corpuscle::test::body", size)};
  BandViews band;
  band.key = Array<Key>("corpuscle::test::key", size);  // every node's closest triangle is the first one
  SurfaceSet surface;
  surface.triangles = 1;
  surface.triangle_body = Array<int>("corpuscle::test::triangle_body", 1);
  const Array<std::int8_t> reached("corpuscle::test::reached", size);
  // A bent corridor of three nodes, walled in all around; a second one, open at its end.
  const auto kind = nodes.kind;
  for_owned(
      "corpuscle::test::walls", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const bool inner = i > 0 && i < 8 && j > 0 && j < 8 && k > 1 && k < 7;
        const bool closed = (k == 4 && j == 3 && (i == 3 || i == 4)) || (k == 4 && j == 4 && i == 4);
        const bool open = j == 6 && k == 4 && i >= 3;
        kind(index.cell(i, j, k)) = inner && !closed && !open ? NodeKind::immersed : NodeKind::fluid;
      });
  NodeBox box;
  for (int d = 0; d < 3; ++d) box.lower[d] = 0, box.upper[d] = 8;
  seed_open_fluid(index, box, OpenFaces{}, band, nodes, reached);
  CHECK(reach_all(index, box, nodes, reached) == 3);
  CHECK(absorb_unreached(index, box, surface, band, nodes, reached) == 3);
  const auto found = on_host(nodes.kind);
  CHECK(found(index.cell(3, 3, 4)) == NodeKind::immersed);
  CHECK(found(index.cell(4, 4, 4)) == NodeKind::immersed);
  CHECK(found(index.cell(3, 6, 4)) == NodeKind::fluid);
}
