// What each node is: fluid, immersed, inside. Once the band's keys and cut links are there, those of the halo from other
// ranks, no step needs a neighbour's answer: every rank holds all surfaces and classifies its halo itself.
#pragma once

#include "common/summing.hpp"
#include "immersed/band.hpp"
#include "immersed/clearance.hpp"

namespace corpuscle {

/// While classifying: a node beyond the band, whose side its grid line will tell.
constexpr NodeKind undecided = static_cast<NodeKind>(5);

/// Kind and body of the nodes of `box` from the signed distance; undecided beyond the band.
inline void classify_band(const GridViews& grid, const NodeBox& box, const SurfaceSet& s, const BandViews& band, const NodeViews& nodes) {
  const IndexSpace index = grid.index;
  const auto base = grid.base_kind;
  const auto triangle_body = s.triangle_body;
  const BandViews b = band;
  const NodeViews out = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::classify_band", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        out.kind(c) = base(c);
        out.body(c) = -1;
        if (base(c) != NodeKind::fluid) return;
        if (b.key(c) == no_key) {
          out.kind(c) = undecided;
        } else if (b.distance(c) < 0) {
          out.kind(c) = NodeKind::inside;
          out.body(c) = key_body(triangle_body, b.key(c));
        }
      });
}

/// Give undecided nodes the side of the decided node next to them on their grid line along `direction`. Links with an
/// undecided end cross no surface (mark_cut_links puts both ends of a crossing into the band), so this is exact; after
/// all three directions every node is decided unless the whole box holds no band node.
inline void fill_lines(const IndexSpace& index, const NodeBox& box, int direction, const NodeViews& nodes) {
  const int d1 = (direction + 1) % 3, d2 = (direction + 2) % 3;
  const int lines1 = box.extent(d1), lines2 = box.extent(d2), length = box.extent(direction);
  const int stride = index.stride(direction);
  const NodeViews out = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::fill_lines", Policy(0, length > 0 ? lines1 * lines2 : 0), KOKKOS_LAMBDA(int e) {
        int i[3];
        i[direction] = box.lower[direction];
        i[d1] = box.lower[d1] + e % lines1;
        i[d2] = box.lower[d2] + e / lines1;
        const int first = index.cell(i[0], i[1], i[2]);
        for (int pass = 0; pass < 2; ++pass) {  // forwards, then backwards for what comes before the first decided
          bool known = false;
          NodeKind kind = NodeKind::fluid;
          int body = -1;
          for (int step = 0; step < length; ++step) {
            const int c = first + stride * (pass == 0 ? step : length - 1 - step);
            if (out.kind(c) == NodeKind::fluid || out.kind(c) == NodeKind::inside) {
              known = true, kind = out.kind(c), body = out.body(c);
            } else if (out.kind(c) == undecided) {
              if (known) out.kind(c) = kind, out.body(c) = body;
            } else {
              known = false;
            }
          }
        }
      });
}

/// Every undecided node gets the given kind and body.
inline void decide_rest(const IndexSpace& index, const NodeBox& box, NodeKind kind, int body, const NodeViews& nodes) {
  const NodeViews out = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::decide_rest", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        if (out.kind(c) == undecided) out.kind(c) = kind, out.body(c) = body;
      });
}

/// Winding number of triangles first to last, under all images, around p: 1 inside, 0 outside (van Oosterom & Strackee
/// 1983).
inline double winding_number(const SurfaceSet& surface, const Images& images, int first, int last, const Vec3& p) {
  const SurfaceSet s = surface;
  const int triangles = last - first;
  double angle = 0;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::winding_number", Policy(0, triangles * images.count),
      KOKKOS_LAMBDA(int item, double& sum) {
        const Corners k = corners(s, first + item % triangles, images.shift[item / triangles]);
        const Vec3 a = k.a - p, b = k.b - p, c = k.c - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
      },
      angle);
  return angle / (4 * M_PI);
}

/// Outside nodes with a cut link, or an inside neighbour, become immersed.
inline void mark_immersed(const Lattice& lattice, const NodeBox& box, const SurfaceSet& s, const BandViews& band, const NodeViews& nodes) {
  const auto triangle_body = s.triangle_body;
  const BandViews b = band;
  const NodeViews out = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::mark_immersed", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        if (out.kind(c) != NodeKind::fluid) return;
        bool crossed = b.cut(c) != 0;
        for (int d = 0; d < 3; ++d) {
          const int stride = lattice.index.stride(d);
          if (i[d] > lattice.lower[d]) {
            crossed = crossed || (b.cut(c - stride) & (1 << d)) || out.kind(c - stride) == NodeKind::inside;
          }
          if (i[d] < lattice.upper[d]) crossed = crossed || out.kind(c + stride) == NodeKind::inside;
        }
        if (!crossed || b.key(c) == no_key) return;
        out.kind(c) = NodeKind::immersed;
        out.body(c) = key_body(triangle_body, b.key(c));
      });
}

/// Fluid nodes without a fluid neighbour become immersed; their foot is the best among their own and their neighbours'
/// triangles. Two such nodes are never neighbours, so the order does not matter. @returns how many of them are owned.
inline int absorb_isolated(const Lattice& lattice, const NodeBox& box, const SurfaceSet& surface, const Images& images,
                           const PseudoNormals& normals, const BandViews& band, const NodeViews& nodes) {
  const SurfaceSet s = surface;
  const BandViews b = band;
  const NodeViews out = nodes;
  int isolated = 0;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::absorb_isolated", Policy(0, box.size()),
      KOKKOS_LAMBDA(int e, int& sum) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        if (out.kind(c) != NodeKind::fluid) return;
        const Vec3 p = lattice.position(c);
        Key best = b.key(c);
        for (int side = 0; side < 6; ++side) {
          const int d = side / 2, step = side % 2 == 0 ? -1 : 1;
          if (i[d] + step < lattice.lower[d] || i[d] + step > lattice.upper[d]) return;  // unknown: leave it
          const int n = c + step * lattice.index.stride(d);
          if (out.kind(n) == NodeKind::fluid) return;
          if (out.kind(n) != NodeKind::immersed && out.kind(n) != NodeKind::inside) continue;
          if (b.key(n) == no_key) continue;
          const unsigned item = key_item(b.key(n));
          const int t = static_cast<int>(item % static_cast<unsigned>(s.triangles));
          const Key offered = offer(p, corners(s, t, images.shift[item / static_cast<unsigned>(s.triangles)]), static_cast<int>(item));
          best = offered < best ? offered : best;
        }
        if (best == no_key) return;
        Vec3 foot;
        b.key(c) = best;
        b.distance(c) = signed_foot(s, normals, images, p, key_item(best), foot);
        store(b.foot, c, foot);
        out.kind(c) = NodeKind::immersed;
        out.body(c) = key_body(s.triangle_body, best);
        if (lattice.index.owns(i[0], i[1], i[2])) sum += 1;
      },
      isolated);
  return isolated;
}

/// Which faces of a node box end a rank's view of the surfaces: [direction][low, high]. Beyond the others lie nodes of
/// another rank, or of the other end of a periodic direction, or the grid's boundary.
struct OpenFaces {
  bool open[3][2] = {{true, true}, {true, true}, {true, true}};
};

/// reached = 1 at the fluid nodes beyond the band or on an open face, 0 elsewhere in the box.
inline void seed_open_fluid(const IndexSpace& index, const NodeBox& box, const OpenFaces& faces, const BandViews& band,
                            const NodeViews& nodes, const Array<std::int8_t>& reached) {
  const auto kind = nodes.kind;
  const auto key = band.key;
  Kokkos::parallel_for(
      "corpuscle::immersed::seed_open_fluid", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        bool open = key(c) == no_key;
        for (int d = 0; d < 3; ++d) open = open || (i[d] == box.lower[d] && faces.open[d][0]) || (i[d] == box.upper[d] && faces.open[d][1]);
        reached(c) = open && kind(c) == NodeKind::fluid ? 1 : 0;
      });
}

/// Carry `reached` along the grid lines of a direction, both ways, through fluid nodes.
inline void reach_along(const IndexSpace& index, const NodeBox& box, int direction, const NodeViews& nodes,
                        const Array<std::int8_t>& reached) {
  const int d1 = (direction + 1) % 3, d2 = (direction + 2) % 3;
  const int lines1 = box.extent(d1), lines2 = box.extent(d2), length = box.extent(direction);
  const int stride = index.stride(direction);
  const auto kind = nodes.kind;
  Kokkos::parallel_for(
      "corpuscle::immersed::reach_along", Policy(0, length > 0 ? lines1 * lines2 : 0), KOKKOS_LAMBDA(int e) {
        int i[3];
        i[direction] = box.lower[direction];
        i[d1] = box.lower[d1] + e % lines1;
        i[d2] = box.lower[d2] + e / lines1;
        const int first = index.cell(i[0], i[1], i[2]);
        for (int pass = 0; pass < 2; ++pass) {
          bool carried = false;
          for (int step = 0; step < length; ++step) {
            const int c = first + stride * (pass == 0 ? step : length - 1 - step);
            if (kind(c) != NodeKind::fluid) {
              carried = false;
            } else if (reached(c)) {
              carried = true;
            } else if (carried) {
              reached(c) = 1;
            }
          }
        }
      });
}

/// Fluid nodes of the box that have not been reached: owned ones, and all.
inline Sums<2> count_unreached(const IndexSpace& index, const NodeBox& box, const NodeViews& nodes, const Array<std::int8_t>& reached) {
  const auto kind = nodes.kind;
  Sums<2> unreached;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::count_unreached", Policy(0, box.size()),
      KOKKOS_LAMBDA(int e, Sums<2>& sum) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        if (kind(c) != NodeKind::fluid || reached(c)) return;
        sum[0] += index.owns(i[0], i[1], i[2]) ? 1 : 0;
        sum[1] += 1;
      },
      Kokkos::Sum<Sums<2>>(unreached));
  return unreached;
}

/// Carry `reached` as far as it goes within the box. @returns how many owned fluid nodes it does not reach
inline long reach_all(const IndexSpace& index, const NodeBox& box, const NodeViews& nodes, const Array<std::int8_t>& reached) {
  Sums<2> left;
  double before;
  left[1] = box.size() + 1.0;
  do {
    before = left[1];
    for (int d = 0; d < 3; ++d) reach_along(index, box, d, nodes, reached);
    left = count_unreached(index, box, nodes, reached);
  } while (left[0] > 0 && left[1] < before);
  return static_cast<long>(left[0]);
}

/// Fluid nodes of the box that have not been reached become immersed: fluid that a surface's folds close in, on the grid,
/// has no pressure equation that could be solved. @returns how many of them are owned.
inline int absorb_unreached(const IndexSpace& index, const NodeBox& box, const SurfaceSet& surface, const BandViews& band,
                            const NodeViews& nodes, const Array<std::int8_t>& reached) {
  const auto triangle_body = surface.triangle_body;
  const auto key = band.key;
  const NodeViews out = nodes;
  int absorbed = 0;
  Kokkos::parallel_reduce(
      "corpuscle::immersed::absorb_unreached", Policy(0, box.size()),
      KOKKOS_LAMBDA(int e, int& sum) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        if (out.kind(c) != NodeKind::fluid || reached(c) || key(c) == no_key) return;
        out.kind(c) = NodeKind::immersed;
        out.body(c) = key_body(triangle_body, key(c));
        if (index.owns(i[0], i[1], i[2])) sum += 1;
      },
      absorbed);
  return absorbed;
}

/// Slots of the array filled by count_nodes().
enum NodeCount {
  count_band,
  count_immersed,
  count_inside,
  count_undecided,
  count_cut,
  count_uncovered,
  count_crossed,  // links of crossed_links()
  crossed_node,   // 1 + the highest owned node with such a link, 0: none
  count_slots
};

/// Owned nodes of `box` (band nodes: halos too): totals into counts[0 .. count_slots), then per body immersed and
/// inside. A node is uncovered when it was inside at the last classification and is fluid now.
inline void count_nodes(const Lattice& lattice, const NodeBox& box, const BandViews& band, const NodeViews& nodes,
                        const Array<NodeKind>& previous, const Array<int>& counts) {
  const BandViews b = band;
  const auto kind = nodes.kind;
  const auto body = nodes.body;
  Kokkos::deep_copy(Exec(), counts, 0);
  Kokkos::parallel_for(
      "corpuscle::immersed::count_nodes", Policy(0, box.size()), KOKKOS_LAMBDA(int e) {
        int i[3];
        box.unpack(e, i);
        const int c = lattice.node(i[0], i[1], i[2]);
        if (b.key(c) != no_key) Kokkos::atomic_fetch_add(&counts(count_band), 1);
        if (!lattice.index.owns(i[0], i[1], i[2])) return;
        if (kind(c) == undecided) Kokkos::atomic_fetch_add(&counts(count_undecided), 1);
        if (kind(c) == NodeKind::fluid && previous(c) == NodeKind::inside) {
          Kokkos::atomic_fetch_add(&counts(count_uncovered), 1);
        }
        const int cut = b.cut(c), links = (cut & 1) + ((cut >> 1) & 1) + ((cut >> 2) & 1);
        if (links > 0) Kokkos::atomic_fetch_add(&counts(count_cut), links);
        if (kind(c) == NodeKind::immersed) {
          Kokkos::atomic_fetch_add(&counts(count_immersed), 1);
          Kokkos::atomic_fetch_add(&counts(count_slots + 2 * body(c)), 1);
          const int crossed = crossed_links(lattice, b, kind, c);
          if (crossed == 0) return;
          Kokkos::atomic_fetch_add(&counts(count_crossed), crossed);
          Kokkos::atomic_fetch_max(&counts(crossed_node), c + 1);
        } else if (kind(c) == NodeKind::inside) {
          Kokkos::atomic_fetch_add(&counts(count_inside), 1);
          Kokkos::atomic_fetch_add(&counts(count_slots + 2 * body(c) + 1), 1);
        }
      });
}

/// Owned immersed nodes in ascending order; entries beyond the list's extent are dropped. @returns how many there are.
inline int list_immersed(const IndexSpace& index, const NodeBox& box, const Array<NodeKind>& kind, const Array<int>& list) {
  return running_sum<int>(
      "corpuscle::immersed::list_immersed", box.size(), KOKKOS_LAMBDA(int e, int& position, bool final) {
        int i[3];
        box.unpack(e, i);
        const int c = index.cell(i[0], i[1], i[2]);
        if (!index.owns(i[0], i[1], i[2]) || kind(c) != NodeKind::immersed) return;
        if (final && position < static_cast<int>(list.extent(0))) list(position) = c;
        ++position;
      });
}

}  // namespace corpuscle
