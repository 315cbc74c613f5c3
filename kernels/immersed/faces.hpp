// Faces between fluid and immersed nodes, sorted by the body that owns the immersed node.
#pragma once

#include "common/summing.hpp"
#include "immersed/views.hpp"

namespace corpuscle {

/// A face that two ranks share, or the two ends of a periodic direction, is stored on both sides: both list it, so that
/// both copies get the same flux, and the owner of the fluid node counts it in sums.
struct FaceViews {
  Array<int> start;  // [bodies + 1] into the lists below
  Array<int> cell;   // face between cell - stride(direction) and cell
  Array<std::int8_t> direction;
  Array<std::int8_t> sign;     // +1: the fluid node is on the high side, so a flux along +direction enters the fluid
  Array<std::int8_t> counted;  // 1 where this rank owns the fluid node, else 0
  Array<std::int8_t> image;    // under which the surface is seen here
  Array<int> body;
};

/// Faces of fluid node i that belong to `body` and of which this rank owns at least one node; calls
/// `found(cell, direction, sign, immersed)` for each.
template <class Found>
KOKKOS_INLINE_FUNCTION void node_faces(const IndexSpace& index, const NodeViews& nodes, const int (&i)[3], int body, const Found& found) {
  const int c = index.cell(i[0], i[1], i[2]);
  if (nodes.kind(c) != NodeKind::fluid) return;
  const bool own = index.owns(i[0], i[1], i[2]);
  for (int d = 0; d < 3; ++d) {
    const int stride = index.stride(d);
    for (int step = -1; step <= 1; step += 2) {
      int beside[3] = {i[0], i[1], i[2]};
      beside[d] += step;
      const int other = c + step * stride;
      if (!own && !index.owns(beside[0], beside[1], beside[2])) continue;
      if (nodes.kind(other) == NodeKind::immersed && nodes.body(other) == body) found(step < 0 ? c : other, d, -step, other);
    }
  }
}

/// The nodes that can have faces of a body: owned ones and one layer around them.
KOKKOS_INLINE_FUNCTION NodeBox body_box(const IndexSpace& index, const Array<int>& box, int body) {
  NodeBox b;
  for (int d = 0; d < 3; ++d) {
    const int offset = 6 * (1 + body);
    b.lower[d] = box(offset + d) > -1 ? box(offset + d) : -1;
    b.upper[d] = box(offset + 3 + d) < index.n[d] ? box(offset + 3 + d) : index.n[d];
  }
  return b;
}

/// Fills faces.start. @returns the number of faces.
inline int count_faces(const IndexSpace& index, const Array<int>& boxes, int bodies, const NodeViews& nodes, const FaceViews& faces) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const auto start = faces.start;
  const NodeViews in = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::count_faces", Team(bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int body = team.league_rank();
        const NodeBox box = body_box(index, boxes, body);
        int count = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, box.size()),
            [&](int e, int& sum) {
              int i[3];
              box.unpack(e, i);
              node_faces(index, in, i, body, [&](int, int, int, int) { ++sum; });
            },
            count);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { start(body) = count; });
      });
  return running_sum<int>(
      "corpuscle::immersed::face_offsets", bodies + 1, KOKKOS_LAMBDA(int b, int& sum, bool final) {
        const int count = b < bodies ? start(b) : 0;
        if (final) start(b) = sum;
        sum += count;
      });
}

/// Fills the lists, in ascending order of the fluid node within each body; the lists must be long enough.
/// @param key        [cell] the search's, at the immersed nodes
/// @param triangles  of all surfaces
inline void list_faces(const IndexSpace& index, const Array<int>& boxes, int bodies, int triangles, const NodeViews& nodes,
                       const Array<Key>& key, const FaceViews& faces) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const FaceViews out = faces;
  const NodeViews in = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::list_faces", Team(bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int body = team.league_rank(), first = out.start(body);
        const NodeBox box = body_box(index, boxes, body);
        Kokkos::parallel_scan(Kokkos::TeamThreadRange(team, box.size()), [&](int e, int& position, bool final) {
          int i[3];
          box.unpack(e, i);
          const bool own = index.owns(i[0], i[1], i[2]);
          node_faces(index, in, i, body, [&](int cell, int d, int sign, int immersed) {
            if (final) {
              const int at = first + position;
              out.cell(at) = cell;
              out.direction(at) = static_cast<std::int8_t>(d);
              out.sign(at) = static_cast<std::int8_t>(sign);
              out.counted(at) = own ? 1 : 0;
              out.image(at) =
                  static_cast<std::int8_t>(key(immersed) == no_key ? 0 : key_item(key(immersed)) / static_cast<unsigned>(triangles));
              out.body(at) = body;
            }
            ++position;
          });
        });
      });
}

}  // namespace corpuscle
